"""Convex shapes by their support functions: the truth about distance and depth of two shapes."""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np

from iapb.contact.geometry import BOX, ENDLESS, HALF_PLANE, POLYGON, Shapes


class Convex(NamedTuple):
    """Points within `radius` of the hull of the corners (k, 3), with the outward normals (f, 3) of
    its faces and the directions of its edges (e, 3); a plane ends a half-space."""

    corners: np.ndarray
    radius: float
    normals: np.ndarray
    edges: np.ndarray
    endless: bool = False

    def reach(self, n: np.ndarray) -> np.ndarray:
        """Support function: the largest n·x for directions (m, 3)."""
        return (n @ self.corners.T).max(axis=1) + self.radius

    def beyond(self, x: np.ndarray) -> float:
        """Lower bound of the distance of a point from the shape, which is exact over a face."""
        if not len(self.normals):
            return float(np.linalg.norm(x - self.corners[0]) - self.radius)
        return float((self.normals @ x - self.reach(self.normals)).max())


def convex(shapes: Shapes, s: int, R: np.ndarray, p: np.ndarray) -> Convex:
    """Shape s with its bodies at rotations R (n, 3, 3) and positions p (n, 3)."""
    body = int(shapes.body[s])
    kind = int(shapes.kind[s])
    turn, origin = (R[body], p[body]) if body >= 0 else (np.eye(3), np.zeros(3))
    rows = slice(shapes.first[s], shapes.first[s] + shapes.count[s])
    flat = np.pad(shapes.vertices[rows], ((0, 0), (0, 1)))
    corners = shapes.center[s][None]
    edges = np.zeros((0, 3))
    normals = np.zeros((0, 3))
    radius = float(shapes.radius[s])
    if kind == HALF_PLANE:
        corners = flat[:1]
        normals = flat[1:]
    elif kind in ENDLESS:
        normals = shapes.axes[s][:, 2][None]
    elif kind == POLYGON:
        corners = flat
        edges = np.roll(flat, -1, axis=0) - flat
        normals = np.cross(edges, [0.0, 0.0, 1.0])
    elif kind == BOX:
        edges = shapes.axes[s].T
        corners = corners + np.array(list(product((-1, 1), repeat=3))) * shapes.half_size[s] @ edges
        normals = np.concatenate([edges, -edges])
    normals = normals / np.linalg.norm(normals, axis=1)[:, None]
    return Convex(
        corners @ turn.T + origin, radius, normals @ turn.T, edges @ turn.T, kind in ENDLESS
    )


def separations(a: Convex, b: Convex, n: np.ndarray) -> np.ndarray:
    """Gap of a and b along unit directions (m, 3) from b to a; none exceeds their distance."""
    if b.endless:
        return -a.reach(-n) - n @ b.corners[0]
    return -a.reach(-n) - b.reach(n)


def directions(a: Convex, b: Convex) -> np.ndarray:
    """Unit directions from b to a, one of which has the largest separation.

    Two boxes in space have the fifteen of the separating-axis theorem: exact unless two corners, or
    a corner and an edge, are nearest.
    """
    if b.endless:
        return b.normals
    found = [b.normals, -a.normals]
    if len(a.corners) == len(b.corners) == 8:
        crossed = np.cross(a.edges[:, None], b.edges[None]).reshape(-1, 3)
        found += [crossed, -crossed]
    elif 8 in (len(a.corners), len(b.corners)):
        box, ball, sign = (a, b, -1.0) if len(a.corners) == 8 else (b, a, 1.0)
        middle = box.corners.mean(axis=0)
        half = box.reach(box.edges) - box.edges @ middle
        inside = np.clip(box.edges @ (ball.corners[0] - middle), -half, half)
        found.append(sign * (ball.corners[0] - middle - inside @ box.edges)[None])
    else:
        found.append((a.corners[:, None] - b.corners[None]).reshape(-1, 3))
    stacked = np.concatenate(found)
    length = np.linalg.norm(stacked, axis=1)
    return stacked[length > 1e-6] / length[length > 1e-6, None]

"""A scene as triangles for a browser, and the placements of its bodies at a pose from the engine.

Planar scenes are drawn in the plane z = 0; their shapes are a tenth of the scene's size thick. Quaternions here are w,
x, y, z, as in the viewer.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from reports.figures import geometry

Floats = NDArray[np.float64]

_THICKNESS = 0.1  # of planar shapes, as a share of the scene's size
_REACH = 3.0  # of walls without end, as a multiple of the scene's size
_CUBE = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
                  [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]])  # of corners in order of x, y, z
_RINGS = 12


class Piece(NamedTuple):
    """Triangles of one shape, in the frame of its body; body ``""`` is the world."""

    body: str
    vertices: Floats  # (n, 3) [m]
    faces: NDArray[np.int64]  # (m, 3) counter-clockwise from outside


def pieces(scene: Mapping[str, Any]) -> list[Piece]:
    """Return every shape of a resolved scene."""
    low, high = extent(scene)
    size = float(np.linalg.norm(high - low))
    return list(_pieces(scene, size))


def placements(scene: Mapping[str, Any], pose: Floats) -> dict[str, tuple[Floats, Floats]]:
    """Return (quaternion, position) of every body at a pose (bodies, 3 or 7)."""
    places = geometry.body_placements(scene, pose)
    return {name: (Rotation.from_matrix(place.rotation).as_quat(scalar_first=True), place.origin)
            for name, place in places.items()}  # fmt: skip


def held_point(scene: Mapping[str, Any], pose: Floats) -> Floats | None:
    """Return the point (3,) [m] at which the hand holds the tool; None in a scene without a hand."""
    hand = scene.get("hand")
    if hand is None:
        return None
    return geometry.body_placements(scene, pose)[hand["body"]].of(np.resize([*hand["point"], 0.0], 3))


def extent(scene: Mapping[str, Any]) -> tuple[Floats, Floats]:
    """Return the lower and upper corner (3,) [m] of all bounded shapes in the initial state."""
    places = geometry.body_placements(scene)
    points = [place.origin[None] for place in places.values()]
    for piece in _pieces({**scene, "walls": [wall for wall in scene["walls"] if "normal" not in wall]}, 0.0):
        points.append(places[piece.body].of(piece.vertices) if piece.body else piece.vertices)
    every = np.vstack(points)
    return every.min(axis=0), every.max(axis=0)


def _pieces(scene: Mapping[str, Any], size: float) -> Iterator[Piece]:
    owned = [(body["name"], shape) for body in scene["bodies"] for shape in body["shapes"]]
    for name, shape in owned + [("", wall) for wall in scene["walls"]]:
        if shape["kind"] == "half_plane":
            yield _extruded(name, geometry.half_plane(shape, _REACH * size), 0.9 * _THICKNESS * size)
        elif shape["kind"] == "half_space":
            yield _slab(shape, _REACH * size)
        elif shape["kind"] == "sphere":
            yield _ball(name, np.asarray(shape["center"], dtype=float), shape["radius"])
        elif geometry.is_spatial(scene):
            yield Piece(name, geometry.placement_of(shape).of(_corners(shape["size"])), _CUBE)
        else:
            yield _extruded(name, geometry.outline(shape), _THICKNESS * size)


def _extruded(name: str, corners: Floats, thickness: float) -> Piece:
    """Return a prism over a convex outline, centred at z = 0."""
    x, y = corners[:, 0], corners[:, 1]
    if np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) < 0.0:
        corners = corners[::-1]
    n, heights = len(corners), np.full((len(corners), 1), 0.5 * thickness)
    vertices = np.vstack([np.hstack([corners, -heights]), np.hstack([corners, heights])])
    faces = [[n, n + i, n + i + 1] for i in range(1, n - 1)] + [[0, i + 1, i] for i in range(1, n - 1)]
    for i in range(n):
        j = (i + 1) % n
        faces += [[i, j, n + j], [i, n + j, n + i]]
    return Piece(name, vertices, np.array(faces))


def _corners(size: Any) -> Floats:
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    return 0.5 * signs * np.asarray(size, dtype=float)


def _slab(wall: Mapping[str, Any], reach: float) -> Piece:
    """Return a plate below a plane; it represents the half-space behind the plane."""
    normal = np.asarray(wall["normal"], dtype=float)
    normal = normal / np.linalg.norm(normal)
    along = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    along = along / np.linalg.norm(along)
    frame = geometry.Placement(np.column_stack([along, np.cross(normal, along), normal]),
                              np.asarray(wall["point"], dtype=float))
    depth = 0.02 * reach
    return Piece("", frame.of(_corners((reach, reach, depth)) - [0.0, 0.0, 0.5 * depth]), _CUBE)


def _ball(name: str, center: Floats, radius: float) -> Piece:
    """Return a sphere with vertices on circles of latitude and longitude."""
    latitude, longitude = np.linspace(0.0, np.pi, _RINGS + 1), np.linspace(0.0, 2.0 * np.pi, 2 * _RINGS + 1)[:-1]
    t, p = np.meshgrid(latitude, longitude, indexing="ij")
    vertices = center + radius * np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], -1).reshape(-1, 3)
    columns, faces = 2 * _RINGS, []
    for i in range(_RINGS):
        for j in range(columns):
            a, b = i * columns + j, i * columns + (j + 1) % columns
            faces += [[a, a + columns, b + columns], [a, b + columns, b]]
    return Piece(name, vertices, np.array(faces))

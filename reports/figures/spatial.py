"""Where the outlines of a scene in space are, from its resolved file alone, and how they look from aside.

Axes are the world's, z up where there is gravity. The view is axonometric: parallel lines stay parallel and nothing
shrinks with distance. Quaternions are x, y, z, w; rpy turns about the fixed x, y and z axes in this order.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
WORLD = "world"
_CIRCLE_CORNERS = 48
_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float) / 2.0
# corners in a ring, counter-clockwise from outside
_FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


@dataclass(frozen=True)
class Placement:
    """Where a frame is: `rotation` (3, 3) and `origin` (3,) [m], both in world axes."""

    rotation: Floats
    origin: Floats

    def __matmul__(self, inner: Placement) -> Placement:
        return Placement(self.rotation @ inner.rotation, self.origin + self.rotation @ inner.origin)

    def of(self, points: Any) -> Floats:
        """Return points of this frame (..., 3) in world axes."""
        return self.origin + np.asarray(points, dtype=float) @ self.rotation.T


def placement(origin: Any = (0.0, 0.0, 0.0), rpy: Any = (0.0, 0.0, 0.0)) -> Placement:
    """Return the frame at `origin`, turned by roll, pitch and yaw."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    roll = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    pitch = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    yaw = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return Placement(yaw @ pitch @ roll, np.asarray(origin, dtype=float))


def body_placements(scene: Mapping[str, Any], coordinates: Any = None) -> dict[str, Placement]:
    """Return where every body is, at `coordinates` (nq,) or where the scene starts."""
    places, used = {WORLD: placement()}, 0
    for body in scene["bodies"]:
        count = len(body["position"])
        q = body["position"] if coordinates is None else coordinates[used : used + count]
        used += count
        joint = placement(body["origin"], body["rpy"])
        places[body["name"]] = places[body["parent"]] @ joint @ _moved(body, np.asarray(q, dtype=float))
    del places[WORLD]
    return places


def _moved(body: Mapping[str, Any], q: Floats) -> Placement:
    """Return what the joint does to the body frame."""
    nowhere, joint = np.zeros(3), body["joint"]
    if joint == "fixed":
        return placement()
    if joint == "free_flyer":
        return Placement(_of_quaternion(q[3:]), q[:3])
    if joint == "spherical":
        return Placement(_of_quaternion(q), nowhere)
    axis = np.asarray(body["axis"], dtype=float) / np.linalg.norm(body["axis"])
    if joint == "prismatic":
        return Placement(np.eye(3), q[0] * axis)
    cosine, sine = q if joint == "continuous" else (np.cos(q[0]), np.sin(q[0]))
    return Placement(_about(axis, cosine, sine), nowhere)


def _about(axis: Floats, cosine: float, sine: float) -> Floats:
    """Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turned: Floats = cosine * np.eye(3) + sine * cross + (1.0 - cosine) * np.outer(axis, axis)
    return turned


def _of_quaternion(quaternion: Floats) -> Floats:
    x, y, z, w = quaternion / np.linalg.norm(quaternion)
    sine = float(np.linalg.norm((x, y, z)))
    axis = np.array([x, y, z]) / sine if sine > 0.0 else np.array([0.0, 0.0, 1.0])
    return _about(axis, w * w - sine * sine, 2.0 * w * sine)


def cuboid_faces(frame: Placement, size: Any) -> tuple[Floats, ...]:
    """Return the six faces of a box as rings of corners (4, 3), counter-clockwise seen from outside."""
    corners = frame.of(_CORNERS * np.asarray(size, dtype=float))
    return tuple(corners[list(ring)] for ring in _FACES)


def cuboid_of_inertia(body: Mapping[str, Any]) -> Floats:
    """Return the sides (3,) [m] of the even box with the body's mass and principal moments: m (b² + c²) / 12 = I_xx."""
    xx, yy, zz = body["inertia"][:3]
    squares = 6.0 * (np.array([yy + zz - xx, zz + xx - yy, xx + yy - zz])) / body["mass"]
    sides: Floats = np.sqrt(np.maximum(squares, 0.0))
    return sides


@dataclass(frozen=True)
class View:
    """A direction to look along: `across` and `up` (3,) span the picture, `towards` points at the reader."""

    across: Floats
    up: Floats
    towards: Floats

    def flat(self, points: Any) -> Floats:
        """Return points (..., 3) in the picture (..., 2) [m]."""
        return np.asarray(points, dtype=float) @ np.column_stack([self.across, self.up])

    def depth(self, points: Any) -> float:
        """Return how near [m] the middle of some points is to the reader."""
        return float(np.mean(np.asarray(points, dtype=float) @ self.towards))

    def faces_reader(self, ring: Floats) -> bool:
        """Tell whether a ring of corners is seen from outside."""
        return float(np.cross(ring[1] - ring[0], ring[2] - ring[1]) @ self.towards) > 0.0

    def disc(self, center: Floats, radius: float) -> Floats:
        """Return the outline (n, 3) of a ball: a circle across the line of sight."""
        turn = np.linspace(0.0, 2.0 * np.pi, _CIRCLE_CORNERS, endpoint=False)
        return center + radius * (np.outer(np.cos(turn), self.across) + np.outer(np.sin(turn), self.up))


def view(azimuth: float, elevation: float) -> View:
    """Return the view from `azimuth` [rad] about z, counter-clockwise from x, and from `elevation` above the floor."""
    (ca, ce), (sa, se) = np.cos((azimuth, elevation)), np.sin((azimuth, elevation))
    return View(np.array([-sa, ca, 0.0]), np.array([-ca * se, -sa * se, ce]), np.array([ca * ce, sa * ce, se]))


def links(scene: Mapping[str, Any], coordinates: Any = None) -> Sequence[tuple[Floats, Floats]]:
    """Return lines (from, to) [m] from joint to joint, and on to the shapes: the skeleton of what hangs together."""
    places, lines = body_placements(scene, coordinates), []
    for body in scene["bodies"]:
        if body["parent"] != WORLD:
            own = places[body["name"]]
            lines.append((places[body["parent"]].origin, own.origin))
            lines += [(own.origin, own.of(shape["center"])) for shape in body["shapes"]]
    return [(start, end) for start, end in lines if np.any(start != end)]

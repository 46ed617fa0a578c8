"""The outlines of a scene, computed from its resolved file and the poses of a run, and their projection to a picture.

A planar scene lies in the plane z = 0. Its outlines are (n, 2) arrays of corners, those of a scene in space (n, 3) [m].
The view is axonometric: parallel lines stay parallel and sizes do not depend on the distance. Quaternions are x, y, z,
w; rpy rotates about the fixed x, y and z axes in this order.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.scene.mechanism import mechanism_of, start_of
from iapb.scene.model import scene_kind

Floats = NDArray[np.float64]
WORLD = "world"
_CIRCLE_CORNERS, _BALL_CORNERS = 72, 48
_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float) / 2.0
# corners in a ring, counter-clockwise from outside
_FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


def is_spatial(scene: Mapping[str, Any]) -> bool:
    """Return whether a resolved scene is a scene in space."""
    return scene.get("dimensions") == 3


@dataclass(frozen=True)
class Placement:
    """The placement of a frame: `rotation` (3, 3) and `origin` (3,) [m], both in world axes."""

    rotation: Floats
    origin: Floats

    def __matmul__(self, inner: Placement) -> Placement:
        return Placement(self.rotation @ inner.rotation, self.origin + self.rotation @ inner.origin)

    def of(self, points: Any) -> Floats:
        """Return points (..., 2 or 3) of this frame in world axes, in the same shape."""
        points = np.asarray(points, dtype=float)
        n = points.shape[-1]
        return self.origin[:n] + points @ self.rotation[:n, :n].T


def placement(origin: Any = (0.0, 0.0, 0.0), rpy: Any = (0.0, 0.0, 0.0)) -> Placement:
    """Return the frame at `origin` (2 or 3 numbers), rotated by roll, pitch and yaw."""
    from scipy.spatial.transform import Rotation

    return Placement(Rotation.from_euler("xyz", rpy).as_matrix(), np.resize(np.append(origin, 0.0), 3))


def placement_of(placed: Mapping[str, Any], origin: str = "center") -> Placement:
    """Return the frame of a shape or joint of a resolved scene, from its `angle` (plane) or its `rpy` (space)."""
    return placement(placed.get(origin, (0.0, 0.0)), placed.get("rpy", (0.0, 0.0, placed.get("angle", 0.0))))


def start_pose(scene: Mapping[str, Any]) -> Floats:
    """Return the initial poses (bodies, 3 or 7) of a resolved scene, as computed by the engine."""
    checked = scene_kind(scene).model_validate(scene)
    poses: Floats = mechanism_of(checked).poses(start_of(checked)[0][None], planar=not is_spatial(scene))[0]
    return poses


def body_placements(scene: Mapping[str, Any], pose: Floats | None = None) -> dict[str, Placement]:
    """Return the placement of every body, at a pose (bodies, 3 or 7) of a run or at the start of the scene."""
    poses = start_pose(scene) if pose is None else pose
    return {body["name"]: _placed(one) for body, one in zip(scene["bodies"], poses, strict=True)}


def _placed(pose: Floats) -> Placement:
    if len(pose) == 3:
        return placement(pose[:2], (0.0, 0.0, pose[2]))
    from scipy.spatial.transform import Rotation

    return Placement(Rotation.from_quat(pose[3:]).as_matrix(), np.array(pose[:3]))


# In the plane


def outline(shape: Mapping[str, Any]) -> Floats:
    """Return the corners of a box, circle or polygon in the frame of its body."""
    frame = placement_of(shape)
    if shape["kind"] == "circle":
        turn = np.linspace(0.0, 2.0 * np.pi, _CIRCLE_CORNERS, endpoint=False)
        return frame.of(shape["radius"] * np.column_stack([np.cos(turn), np.sin(turn)]))
    if shape["kind"] == "box":
        half = np.asarray(shape["size"], dtype=float) / 2.0
        return frame.of(half * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]))
    return frame.of(shape["vertices"])


def half_plane(wall: Mapping[str, Any], reach: float) -> Floats:
    """Return a rectangle of size `reach` that represents the half-plane behind the wall's line."""
    normal = np.asarray(wall["normal"], dtype=float)
    normal = normal / np.hypot(*normal)
    along = np.array([-normal[1], normal[0]])
    point = np.asarray(wall["point"], dtype=float)
    return point + reach * np.array([along, along - 2 * normal, -along - 2 * normal, -along])


def body_outlines(scene: Mapping[str, Any], pose: Floats | None = None) -> Iterator[tuple[str, Floats]]:
    """Yield (body, corners in world axes) for every shape of every body."""
    places = body_placements(scene, pose)
    for body in scene["bodies"]:
        for shape in body["shapes"]:
            yield body["name"], places[body["name"]].of(outline(shape))


def bounds(points: Sequence[Floats], margin: float) -> tuple[Floats, Floats]:
    """Return the lower and upper corner of the box around all points, widened by a share of its longer side."""
    every = np.vstack(points)
    low, high = every.min(axis=0), every.max(axis=0)
    return low - margin * max(high - low), high + margin * max(high - low)


# In space


def cuboid_faces(frame: Placement, size: Any) -> tuple[Floats, ...]:
    """Return the six faces of a box as rings of corners (4, 3), counter-clockwise seen from outside."""
    corners = frame.of(_CORNERS * np.asarray(size, dtype=float))
    return tuple(corners[list(ring)] for ring in _FACES)


def cuboid_of_inertia(body: Mapping[str, Any]) -> Floats:
    """Return the sides (3,) [m] of the homogeneous box with the body's mass and principal moments of inertia.

    The sides a, b, c follow from m (b² + c²) / 12 = I_xx and so on.
    """
    xx, yy, zz = body["inertia"][:3]
    squares = 6.0 * (np.array([yy + zz - xx, zz + xx - yy, xx + yy - zz])) / body["mass"]
    sides: Floats = np.sqrt(np.maximum(squares, 0.0))
    return sides


@dataclass(frozen=True)
class View:
    """A viewing direction: `across` and `up` (3,) span the picture, `towards` points at the reader."""

    across: Floats
    up: Floats
    towards: Floats

    def flat(self, points: Any) -> Floats:
        """Return the projection (..., 2) [m] of points (..., 3) to the picture."""
        return np.asarray(points, dtype=float) @ np.column_stack([self.across, self.up])

    def depth(self, points: Any) -> float:
        """Return the coordinate [m] of the mean of some points along `towards`; it is larger nearer to the reader."""
        return float(np.mean(np.asarray(points, dtype=float) @ self.towards))

    def faces_reader(self, ring: Floats) -> bool:
        """Return whether a ring of corners is seen from outside."""
        return float(np.cross(ring[1] - ring[0], ring[2] - ring[1]) @ self.towards) > 0.0

    def disc(self, center: Floats, radius: float) -> Floats:
        """Return the outline (n, 3) of a ball: a circle perpendicular to the line of sight."""
        turn = np.linspace(0.0, 2.0 * np.pi, _BALL_CORNERS, endpoint=False)
        return center + radius * (np.outer(np.cos(turn), self.across) + np.outer(np.sin(turn), self.up))


def view(azimuth: float, elevation: float) -> View:
    """Return the view from `azimuth` [rad] about z, counter-clockwise from x, and from `elevation` above the floor."""
    (ca, ce), (sa, se) = np.cos((azimuth, elevation)), np.sin((azimuth, elevation))
    return View(np.array([-sa, ca, 0.0]), np.array([-ca * se, -sa * se, ce]), np.array([ca * ce, sa * ce, se]))


def links(scene: Mapping[str, Any], pose: Floats | None = None) -> Sequence[tuple[Floats, Floats]]:
    """Return lines (from, to) [m] from joint to joint, and to the shapes: the skeleton of each mechanism."""
    places, lines = body_placements(scene, pose), []
    for body in scene["bodies"]:
        if body["parent"] != WORLD:
            own = places[body["name"]]
            lines.append((places[body["parent"]].origin, own.origin))
            lines += [(own.origin, own.of(shape["center"])) for shape in body["shapes"]]
    return [(start, end) for start, end in lines if np.any(start != end)]

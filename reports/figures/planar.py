"""Where the outlines of a planar scene are, from its resolved file alone: no engine, no mechanism.

Angles are counter-clockwise about +z, in world axes; an outline is an (n, 2) array of corners [m].
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_CIRCLE_CORNERS = 72
WORLD = "world"


@dataclass(frozen=True)
class Pose:
    """Where a frame is: `rotation` (2, 2) and `origin` (2,) [m], both in world axes."""

    rotation: Floats
    origin: Floats

    def __matmul__(self, inner: Pose) -> Pose:
        return Pose(self.rotation @ inner.rotation, self.origin + self.rotation @ inner.origin)

    def of(self, points: Any) -> Floats:
        """Return points of this frame (..., 2) in world axes."""
        return self.origin + np.asarray(points, dtype=float) @ self.rotation.T


def pose(angle: float = 0.0, origin: Sequence[float] | Floats = (0.0, 0.0)) -> Pose:
    """Return the frame turned by `angle` at `origin`."""
    c, s = np.cos(angle), np.sin(angle)
    return Pose(np.array([[c, -s], [s, c]]), np.asarray(origin, dtype=float))


def body_poses(scene: Mapping[str, Any], coordinates: Sequence[float] | Floats | None = None) -> dict[str, Pose]:
    """Return the pose of every body, at `coordinates` (nq,) or where the scene starts."""
    poses, used = {WORLD: pose()}, 0
    for body in scene["bodies"]:
        count = len(body["position"])
        q = body["position"] if coordinates is None else coordinates[used : used + count]
        used += count
        poses[body["name"]] = poses[body["parent"]] @ pose(body["angle"], body["origin"]) @ _moved(body, q)
    del poses[WORLD]
    return poses


def _moved(body: Mapping[str, Any], q: Sequence[float] | Floats) -> Pose:
    """Return what the joint does to the body frame."""
    if body["joint"] == "revolute":
        return pose(q[0])
    if body["joint"] == "prismatic":
        axis = np.asarray(body["axis"], dtype=float)
        return pose(0.0, q[0] * axis / np.hypot(*axis))
    return pose(q[2], q[:2]) if body["joint"] == "planar" else pose()


def outline(shape: Mapping[str, Any]) -> Floats:
    """Return the corners of a box, circle or polygon in the frame that carries it."""
    frame = pose(shape.get("angle", 0.0), shape.get("center", (0.0, 0.0)))
    if shape["kind"] == "circle":
        turn = np.linspace(0.0, 2.0 * np.pi, _CIRCLE_CORNERS, endpoint=False)
        return frame.of(shape["radius"] * np.column_stack([np.cos(turn), np.sin(turn)]))
    if shape["kind"] == "box":
        half = np.asarray(shape["size"], dtype=float) / 2.0
        return frame.of(half * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]))
    return frame.of(shape["vertices"])


def half_plane(wall: Mapping[str, Any], reach: float) -> Floats:
    """Return a rectangle of size `reach` that stands for everything behind the wall's line."""
    normal = np.asarray(wall["normal"], dtype=float)
    normal = normal / np.hypot(*normal)
    along = np.array([-normal[1], normal[0]])
    point = np.asarray(wall["point"], dtype=float)
    return point + reach * np.array([along, along - 2 * normal, -along - 2 * normal, -along])


def body_outlines(
    scene: Mapping[str, Any], coordinates: Sequence[float] | Floats | None = None
) -> Iterator[tuple[str, Floats]]:
    """Yield (body, corners in world axes) for every shape of every body."""
    poses = body_poses(scene, coordinates)
    for body in scene["bodies"]:
        for shape in body["shapes"]:
            yield body["name"], poses[body["name"]].of(outline(shape))


def bounds(points: Sequence[Floats], margin: float) -> tuple[Floats, Floats]:
    """Return the lower and upper corner of the box around all points, widened by a share of its longer side."""
    every = np.vstack(points)
    low, high = every.min(axis=0), every.max(axis=0)
    return low - margin * max(high - low), high + margin * max(high - low)

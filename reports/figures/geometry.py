"""The outlines and solids of a scene, from its resolved file and the poses of a run: for pictures,
films, the browser.

A planar scene lies in the plane z = 0. Its outlines are (n, 2) arrays of corners; its solids are a
tenth of the scene's size thick. The view of pictures is axonometric: parallel lines stay parallel
and sizes do not depend on the distance. Quaternions of a run are x, y, z, w; rpy rotates about the
fixed x, y and z axes in this order.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from iapb.scene.mechanism import mechanism_of, start_of
from iapb.scene.model import scene_kind

Floats = NDArray[np.float64]
WORLD = "world"
_CIRCLE_CORNERS = 72
_THICKNESS = 0.1  # of planar shapes, as a share of the scene's size
_REACH = 3.0  # of walls without end, as a multiple of the scene's size
_RINGS = 12  # of a ball, from pole to pole
_SQUARE = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])


def is_spatial(scene: Mapping[str, Any]) -> bool:
    """Return whether a resolved scene is a scene in space."""
    return scene.get("dimensions") == 3


@dataclass(frozen=True)
class Placement:
    """The placement of a frame: `rotation` (3, 3) and `origin` (3,) [m], both in world axes."""

    rotation: Floats
    origin: Floats

    def of(self, points: Any) -> Floats:
        """Return points (..., 2 or 3) of this frame in world axes, in the same shape."""
        points = np.asarray(points, dtype=float)
        n = points.shape[-1]
        return self.origin[:n] + points @ self.rotation[:n, :n].T


def placement_of(shape: Mapping[str, Any]) -> Placement:
    """Return the frame of a shape of a resolved scene, from its `angle` (plane) or its `rpy`
    (space)."""
    turn = Rotation.from_euler("xyz", shape.get("rpy", (0.0, 0.0, shape.get("angle", 0.0))))
    return Placement(turn.as_matrix(), np.resize([*shape.get("center", (0.0, 0.0)), 0.0], 3))


def body_placements(scene: Mapping[str, Any], pose: Floats | None = None) -> dict[str, Placement]:
    """Return the placement of every body, at a pose (bodies, 3 or 7) of a run or at the start of
    the scene."""
    if pose is None:
        checked = scene_kind(scene).model_validate(scene)
        pose = mechanism_of(checked).poses(
            start_of(checked)[0][None], planar=not is_spatial(scene)
        )[0]
    turns = (
        Rotation.from_quat(pose[:, 3:])
        if is_spatial(scene)
        else Rotation.from_rotvec(pose[:, 2:] * [0, 0, 1])
    )
    origins = pose[:, :3] * [1.0, 1.0, is_spatial(scene)]
    return {
        body["name"]: Placement(turn, origin)
        for body, turn, origin in zip(scene["bodies"], turns.as_matrix(), origins, strict=True)
    }


# In the plane


def outline(shape: Mapping[str, Any]) -> Floats:
    """Return the corners of a box, circle or polygon in the frame of its body."""
    frame = placement_of(shape)
    if shape["kind"] == "circle":
        return frame.of(shape["radius"] * _circle())
    return frame.of(
        0.5 * np.asarray(shape["size"]) * _SQUARE if shape["kind"] == "box" else shape["vertices"]
    )


def _circle() -> Floats:
    turn = np.linspace(0.0, 2.0 * np.pi, _CIRCLE_CORNERS, endpoint=False)
    return np.column_stack([np.cos(turn), np.sin(turn)])


def half_plane(wall: Mapping[str, Any], reach: float) -> Floats:
    """Return a rectangle of size `reach` that represents the half-plane behind the wall's line."""
    normal = np.asarray(wall["normal"], dtype=float)
    normal = normal / np.hypot(*normal)
    along = np.array([-normal[1], normal[0]])
    point = np.asarray(wall["point"], dtype=float)
    return point + reach * np.array([along, along - 2 * normal, -along - 2 * normal, -along])


def body_outlines(scene: Mapping[str, Any], pose: Floats | None = None) -> list[Floats]:
    """Return the corners, in world axes, of every shape of every body."""
    places = body_placements(scene, pose)
    return [
        places[body["name"]].of(outline(shape))
        for body in scene["bodies"]
        for shape in body["shapes"]
    ]


def wall_outlines(scene: Mapping[str, Any], reach: float) -> list[Floats]:
    """Return the corners of the static world, of half-planes those of a piece of size `reach`."""
    return [
        half_plane(wall, reach) if wall["kind"] == "half_plane" else outline(wall)
        for wall in scene["walls"]
    ]


def is_turned(scene: Mapping[str, Any]) -> bool:
    """Return whether a scene uses the paper's frame, x to the left and y down: it is drawn turned
    by 180 degrees."""
    return str(scene["name"]).startswith("peg_")


def bounds(points: Sequence[Floats], margin: float) -> tuple[Floats, Floats]:
    """Return the lower and upper corner of the box around all points, widened by a share of its
    longer side."""
    every = np.vstack(points)
    low = every.min(axis=0)
    high = every.max(axis=0)
    return low - margin * max(high - low), high + margin * max(high - low)


def widened(low: Floats, high: Floats, proportion: float) -> tuple[Floats, Floats]:
    """Return the smallest rectangle with width / height = `proportion` around the given one, same
    centre."""
    width, height = high - low
    half = np.array([max(width, height * proportion), max(height, width / proportion)]) / 2
    return (low + high) / 2 - half, (low + high) / 2 + half


# Solids


@dataclass(frozen=True)
class Solid:
    """A shape in the frame of its body ("" is the world): corners (n, 3) [m], and its sides as
    rings of corners.

    Rings are counter-clockwise seen from outside.
    """

    body: str
    vertices: Floats
    rings: Sequence[Sequence[int]]

    @property
    def faces(self) -> NDArray[np.int64]:
        """Triangles (m, 3) of corners that fill the rings."""
        return np.array(
            [
                (ring[0], ring[k], ring[k + 1])
                for ring in self.rings
                for k in range(1, len(ring) - 1)
            ]
        )


def prism(
    body: str, corners: Floats, low: float, high: float, frame: Placement | None = None
) -> Solid:
    """Return the prism over a convex outline (n, 2), from height `low` to `high` of its frame."""
    turned = np.roll(corners, -1, axis=0)
    if np.sum(corners[:, 0] * turned[:, 1] - corners[:, 1] * turned[:, 0]) < 0.0:
        corners = corners[::-1]
    n = len(corners)
    vertices = np.vstack([np.column_stack([corners, np.full(n, height)]) for height in (low, high)])
    sides = [(k, (k + 1) % n, n + (k + 1) % n, n + k) for k in range(n)]
    rings = [tuple(range(n, 2 * n)), tuple(reversed(range(n))), *sides]
    return Solid(body, vertices if frame is None else frame.of(vertices), rings)


def cuboid(body: str, frame: Placement, size: Any) -> Solid:
    """Return a box around the origin of its frame."""
    half = np.asarray(size, dtype=float) / 2.0
    return prism(body, half[:2] * _SQUARE, -half[2], half[2], frame)


def plane_frame(wall: Mapping[str, Any]) -> Placement:
    """Return a frame on the plane of a half-space, with z along its normal."""
    normal = np.asarray(wall["normal"], dtype=float) / np.linalg.norm(wall["normal"])
    along = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    along = along / np.linalg.norm(along)
    return Placement(
        np.column_stack([along, np.cross(normal, along), normal]),
        np.asarray(wall["point"], dtype=float),
    )


def _ball(body: str, center: Any, radius: float) -> Solid:
    """Return a sphere with corners on circles of latitude and longitude."""
    n = 2 * _RINGS
    t, p = np.meshgrid(
        np.linspace(0.0, np.pi, _RINGS + 1),
        np.linspace(0.0, 2.0 * np.pi, n, endpoint=False),
        indexing="ij",
    )
    points = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], -1).reshape(-1, 3)
    rings = [
        (i * n + j, (i + 1) * n + j, (i + 1) * n + (j + 1) % n, i * n + (j + 1) % n)
        for i in range(_RINGS)
        for j in range(n)
    ]
    return Solid(body, np.asarray(center, dtype=float) + radius * points, rings)


def solids(scene: Mapping[str, Any], size: float | None = None) -> Iterator[Solid]:
    """Yield every shape of a resolved scene of the given size [m], by default that of its
    extent."""
    if size is None:
        size = float(np.linalg.norm(np.subtract(*extent(scene))))
    owned = [(body["name"], shape) for body in scene["bodies"] for shape in body["shapes"]]
    for name, shape in owned + [("", wall) for wall in scene["walls"]]:
        half = 0.5 * _THICKNESS * size
        if shape["kind"] == "half_plane":
            yield prism(name, half_plane(shape, _REACH * size), -0.9 * half, 0.9 * half)
        elif shape["kind"] == "half_space":
            reach = 0.5 * _REACH * size
            yield prism(name, reach * _SQUARE, -0.04 * reach, 0.0, plane_frame(shape))
        elif shape["kind"] == "sphere":
            yield _ball(name, shape["center"], shape["radius"])
        elif is_spatial(scene):
            yield cuboid(name, placement_of(shape), shape["size"])
        else:
            yield prism(name, outline(shape), -half, half)


def extent(scene: Mapping[str, Any]) -> tuple[Floats, Floats]:
    """Return the lower and upper corner (3,) [m] of all bounded shapes in the initial state."""
    places = {"": placement_of({}), **body_placements(scene)}
    bounded = solids(
        {**scene, "walls": [wall for wall in scene["walls"] if "normal" not in wall]}, 0.0
    )
    every = np.vstack(
        [place.origin for name, place in places.items() if name]
        + [places[solid.body].of(solid.vertices) for solid in bounded]
    )
    return every.min(axis=0), every.max(axis=0)

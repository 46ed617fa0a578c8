"""The shapes of a scene as meshes for the browser, from its resolved file.

A planar scene lies in the plane z = 0, and its shapes are a tenth of the scene's size thick.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]
Shape = Mapping[str, Any]

_THICKNESS = 0.1  # of planar shapes, as a share of the scene's size
_REACH = 3.0  # of walls without end, as a multiple of the scene's size
_CUBE = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T
_TURN = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
_CIRCLE = np.column_stack([np.cos(_TURN), np.sin(_TURN)])


class Solid(NamedTuple):
    """A shape in the frame of its body ("" is the world): corners (n, 3) [m] of a convex solid."""

    body: str
    corners: Floats

    def triangles(self) -> NDArray[np.uint32]:
        """Return the triangles (m, 3) of its surface, counter-clockwise seen from outside."""
        hull = ConvexHull(self.corners)
        a, b, c = self.corners[hull.simplices].swapaxes(0, 1)
        outward = hull.equations[:, :3]
        inside_out = np.sum(np.cross(b - a, c - a) * outward, axis=1) < 0.0
        faces = hull.simplices.astype(np.uint32)
        faces[inside_out] = faces[inside_out, ::-1]
        return faces


def solids(scene: Shape, size: float) -> Iterator[Solid]:
    """Yield every shape of a resolved scene of the given size [m]."""
    for body in scene["bodies"]:
        for shape in body["shapes"]:
            yield Solid(body["name"], _corners(shape, size))
    for wall in scene["walls"]:
        yield Solid("", _corners(wall, size))


def _corners(shape: Shape, size: float) -> Floats:
    thickness = _THICKNESS * size
    if shape["kind"] == "half_plane":
        return _slab(shape, [2.0 * _REACH * size, 2.0 * _REACH * size, 0.9 * thickness])
    if shape["kind"] == "half_space":
        return _slab(shape, [0.02 * _REACH * size, _REACH * size, _REACH * size])
    if shape["kind"] == "sphere":
        local = shape["radius"] * _ball()
    elif shape["kind"] == "box":
        local = _CUBE * _in_space(shape["size"], thickness)
    else:
        outline = shape["radius"] * _CIRCLE if shape["kind"] == "circle" else shape["vertices"]
        heights = np.full((len(outline), 1), 0.5 * thickness)
        local = np.vstack([np.hstack([outline, z]) for z in (-heights, heights)])
    turn = Rotation.from_euler("xyz", shape.get("rpy", (0.0, 0.0, shape.get("angle", 0.0))))
    return _in_space(shape["center"]) + turn.apply(local)


def _in_space(values: Any, z: float = 0.0) -> Floats:
    """Return two or three numbers as three."""
    return np.array([*values, z][:3], dtype=float)


def _ball() -> Floats:
    """Return points of the unit sphere: a circle in the plane, turned about the x axis."""
    ring = np.pad(_CIRCLE, ((0, 0), (0, 1)))
    return np.vstack([turn.apply(ring) for turn in Rotation.from_euler("x", _TURN[:24:2, None])])


def _slab(wall: Shape, size: list[float]) -> Floats:
    """Return a piece of a wall without end: its size along the normal, and along its surface."""
    normal = _in_space(wall["normal"])
    normal /= np.linalg.norm(normal)
    across = np.abs(normal[::-1]).argmin()  # z in the plane
    along = np.cross(normal, np.eye(3)[2 - across])
    along /= np.linalg.norm(along)
    axes = np.array([normal, along, np.cross(normal, along)])
    return _in_space(wall["point"]) + (_CUBE - [0.5, 0.0, 0.0]) * size @ axes


def extent(scene: Shape, poses: Floats) -> tuple[Floats, Floats]:
    """Return the lower and upper corner (3,) [m] of all bounded shapes, at the poses (bodies, 7) of
    the bodies."""
    points = [poses[:, :3]]
    for body, pose in zip(scene["bodies"], poses, strict=True):
        turn = Rotation.from_quat(pose[3:])
        points += [pose[:3] + turn.apply(_corners(shape, 0.0)) for shape in body["shapes"]]
    points += [_corners(wall, 0.0) for wall in scene["walls"] if "normal" not in wall]
    every = np.vstack(points)
    return every.min(axis=0), every.max(axis=0)

"""Spatial shapes: half-space, sphere and box, each in the frame of its body. All lengths in metres."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.contact.geometry import BOX, HALF_SPACE, SPHERE, WORLD, Shapes
from iapb.errors import ArgumentError

# Axes typed with nine digits still are a rotation.
ROTATION_TOLERANCE = 1e-8

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class HalfSpace:
    """All points x with (x - point)·normal <= 0: the solid lies behind the outward normal (length > 0)."""

    point: ArrayLike
    normal: ArrayLike
    body: int = WORLD


@dataclass(frozen=True)
class Sphere:
    """A ball: radius [m] and centre [m] in the frame of its body."""

    radius: float
    center: ArrayLike = (0.0, 0.0, 0.0)
    body: int = WORLD


@dataclass(frozen=True)
class SpatialBox:
    """A cuboid: full side lengths (3,) [m], centre [m] and axes (columns of `rotation`) in the frame of its body."""

    size: ArrayLike
    center: ArrayLike = (0.0, 0.0, 0.0)
    rotation: ArrayLike = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    body: int = WORLD


SpatialShape = HalfSpace | Sphere | SpatialBox
_KIND = {HalfSpace: HALF_SPACE, Sphere: SPHERE, SpatialBox: BOX}


def make_spatial_shapes(descriptions: Sequence[SpatialShape]) -> Shapes:
    """Return the arrays of the given shapes, in the given order.

    Raises
    ------
    ArgumentError
        A radius, side or normal of length 0, axes that are no rotation, values that are not finite.
    """
    n = len(descriptions)
    rows = [_row(f"shapes[{i}]", shape) for i, shape in enumerate(descriptions)]
    return Shapes(
        kind=np.array([_KIND[type(shape)] for shape in descriptions], np.int32),
        body=np.array([shape.body for shape in descriptions], np.int32),
        radius=np.array([row[0] for row in rows], np.float64),
        first=np.zeros(n, np.int32),
        count=np.zeros(n, np.int32),
        vertices=np.zeros((0, 2)),
        center=np.array([row[1] for row in rows], np.float64).reshape(n, 3),
        axes=np.ascontiguousarray(np.array([row[2] for row in rows], np.float64).reshape(n, 3, 3)),
        half_size=np.array([row[3] for row in rows], np.float64).reshape(n, 3),
    )


def _row(name: str, shape: SpatialShape) -> tuple[float, Floats, Floats, Floats]:
    """Return radius, centre, axes and half sizes."""
    if isinstance(shape, HalfSpace):
        point, normal = _vector(f"{name}.point", shape.point), _vector(f"{name}.normal", shape.normal)
        return 0.0, point, frame_along(f"{name}.normal", normal), np.zeros(3)
    center = _vector(f"{name}.center", shape.center)
    if isinstance(shape, Sphere):
        if not (math.isfinite(shape.radius) and shape.radius > 0.0):
            raise ArgumentError(f"{name}.radius", shape.radius, "a finite radius > 0")
        return float(shape.radius), center, np.eye(3), np.zeros(3)
    size = _vector(f"{name}.size", shape.size)
    if not (size > 0.0).all():
        raise ArgumentError(f"{name}.size", shape.size, "three side lengths > 0")
    rotation = np.asarray(shape.rotation, np.float64)
    proper = rotation.shape == (3, 3) and np.isfinite(rotation).all() and np.linalg.det(rotation) > 0.0
    if not proper or np.abs(rotation.T @ rotation - np.eye(3)).max() > ROTATION_TOLERANCE:
        raise ArgumentError(f"{name}.rotation", shape.rotation, "a rotation matrix (3, 3)")
    return 0.0, center, rotation, 0.5 * size


def frame_along(name: str, normal: Floats) -> Floats:
    """Return right-handed axes (columns) whose third is the direction of `normal`."""
    largest = float(np.abs(normal).max())
    if largest == 0.0:
        raise ArgumentError(name, normal.tolist(), "a vector longer than 0")
    z = normal / largest
    z = z / math.sqrt(sum(x * x for x in z.tolist()))
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x = x / math.sqrt(sum(y * y for y in x.tolist()))
    return np.column_stack([x, np.cross(z, x), z])


def _vector(name: str, value: ArrayLike) -> Floats:
    vector = np.asarray(value, np.float64)
    if vector.shape != (3,) or not np.all(np.isfinite(vector)):
        raise ArgumentError(name, value, "three finite numbers")
    return vector

"""Which pairs of shapes are near each other at all: the arrays of the broad phase, and when it pays."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.contact.geometry import CIRCLE, HALF_PLANE, HALF_SPACE, POLYGON, SPHERE, Integers, Shapes

# Below this number of candidate pairs testing them all is as fast: the narrow phase leaves far ones early.
WORTHWHILE_PAIRS = 150
# Pairs kept per shape: bounding spheres of equal shapes meet about a dozen neighbours when they lie closely packed.
PAIRS_PER_SHAPE = 40

Floats = NDArray[np.float64]


class BroadPhase(NamedTuple):
    """Bounding spheres of n shapes, k of them moving, and the scratch of the grid."""

    moving: Integers  # (k,) shapes on moving bodies
    static: Integers  # (n - k,)
    body: Integers  # (n,)
    allowed: NDArray[np.int8]  # (n, n) for i < j: 1 candidate pair (i, j), 2 candidate pair (j, i), 0 none
    local_center: Floats  # (n, 3) [m] of the bounding sphere in the body's frame
    radius: Floats  # (n,) [m], infinite for half-planes and half-spaces
    cell_size: float  # [m] largest diameter of a moving shape
    neighbours: int  # cells to look at: 9 in the plane, 27 in space
    center: Floats  # (n, 3) [m] world; static ones are there from the start
    cell: NDArray[np.int64]  # (k, 3)
    bucket: NDArray[np.int64]  # (k,)
    start: NDArray[np.int64]  # (buckets + 1,)
    sorted: NDArray[np.int64]  # (k,)
    key: NDArray[np.int64]  # (capacity,)
    pairs: Integers  # (capacity, 2) output


def make_broad_phase(shapes: Shapes, pairs: Integers) -> BroadPhase:
    """Return the broad phase of the candidate pairs (k, 2); switched off scenes pass no pairs and get a stub."""
    n = len(shapes.kind) if len(pairs) else 0
    allowed = np.zeros((n, n), np.int8)
    for a, b in pairs:
        allowed[min(a, b), max(a, b)] = 1 if a < b else 2
    bounds = [_bounding_sphere(shapes, i) for i in range(n)]
    local = np.array([center for center, _ in bounds]).reshape(n, 3)
    radius = np.array([extent for _, extent in bounds], np.float64)
    moving = np.flatnonzero(shapes.body[:n] >= 0).astype(np.int32)
    static = np.flatnonzero(shapes.body[:n] < 0).astype(np.int32)
    k = len(moving)
    capacity = max(1, min(len(pairs), PAIRS_PER_SHAPE * n))
    wholes = {name: np.zeros(size, np.int64) for name, size in (
        ("bucket", k), ("start", (1 << (2 * k).bit_length()) + 1), ("sorted", k), ("key", capacity))}
    return BroadPhase(
        moving=moving, static=static, body=shapes.body[:n].copy(), allowed=allowed, local_center=local,
        radius=radius, cell_size=float(2.0 * radius[moving].max(initial=0.0)) or 1.0, center=local.copy(),
        neighbours=27 if np.any(shapes.kind >= HALF_SPACE) else 9,
        cell=np.zeros((k, 3), np.int64), pairs=np.zeros((capacity, 2), np.int32), **wholes,
    )


def _bounding_sphere(shapes: Shapes, i: int) -> tuple[Floats, float]:
    """Centre in the body's frame and radius [m]: of the box around a polygon, exact for the other shapes."""
    kind = int(shapes.kind[i])
    if kind in (HALF_PLANE, HALF_SPACE):
        return np.zeros(3), np.inf
    if kind in (CIRCLE, POLYGON):
        corners = shapes.vertices[shapes.first[i] : shapes.first[i] + shapes.count[i]]
        middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
        reach = max(math.hypot(x, y) for x, y in (corners - middle).tolist())
        return np.array([*middle, 0.0]), reach + float(shapes.radius[i])
    extent = float(shapes.radius[i]) if kind == SPHERE else math.hypot(*shapes.half_size[i].tolist())
    return shapes.center[i].copy(), extent

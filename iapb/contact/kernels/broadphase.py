"""Broad phase: find the pairs of shapes whose bounding spheres overlap, at a cost linear in the
moving shapes.

Moving shapes are sorted into the cells of a uniform grid. A cell is as wide as the largest moving
shape, so two shapes can touch only in the same cell or in neighbouring cells. A hash table of
chains finds the cells. Every moving shape is compared with every static one, which is linear in the
moving shapes too.

The pairs keep the order of the candidate pairs, so a scene gives the same bits with and without the
broad phase.
"""

from __future__ import annotations

from math import floor, hypot, inf
from typing import Annotated, Any, NamedTuple

import numpy as np

from iapb.contact.geometry import ENDLESS, HALF_SPACE, POLYGON, Shapes
from iapb.numerics.compiled import kernel
from iapb.numerics.linalg import dot, load, placed, store, subtract
from iapb.numerics.schema import Floats, Indices, Integers, States, blank, quantities

# Below this number of candidate pairs testing all is as fast: the narrow phase rejects distant
# pairs early.
WORTHWHILE_PAIRS = 150
# Pairs kept per shape: bounding spheres of equal, closely packed shapes overlap about a dozen
# neighbours.
PAIRS_PER_SHAPE = 40


class BroadPhase(NamedTuple):
    """Bounding spheres of n shapes, k of them moving, and the scratch of the grid."""

    moving: Indices  # (k,) shapes on moving bodies
    static: Indices  # (n - k,)
    body: Indices  # (n,)
    # for i < j: 1 candidate pair (i, j), 2 candidate pair (j, i), 0 none
    allowed: Annotated[States, "shape shape"]
    local_center: Annotated[Floats, "shape 3"]  # [m] of the bounding sphere in the body's frame
    radius: Annotated[Floats, "shape"]  # [m], infinite for half-planes and half-spaces
    cell_size: float  # [m] largest diameter of a moving shape
    neighbours: int  # cells to look at: 9 in the plane, 27 in space
    center: Annotated[Floats, "shape 3"]  # [m] world; those of static shapes are constant
    cell: Annotated[Integers, "moving 3"]
    first: Annotated[Integers, "bucket"]  # a moving shape with its cell in this bucket, −1 = none
    next: Annotated[Integers, "moving"]  # another one in the same bucket, −1 = none
    key: Annotated[Integers, "pair"]
    pairs: Annotated[Indices, "pair 2"]  # output
    used: bool  # whether there are enough candidate pairs


def make_broad_phase(shapes: Shapes, pairs: Indices) -> BroadPhase:
    """Return the broad phase of the candidate pairs (k, 2); a stub if testing all of them is as
    fast."""
    pairs = pairs if len(pairs) > WORTHWHILE_PAIRS else pairs[:0]
    n = len(shapes.kind) if len(pairs) else 0
    moving, static = (
        np.flatnonzero(each).astype(np.int32)
        for each in (shapes.body[:n] >= 0, shapes.body[:n] < 0)
    )
    lengths = {
        "shape": n,
        "moving": len(moving),
        "bucket": 1 << (2 * len(moving)).bit_length(),
        "pair": max(1, min(len(pairs), PAIRS_PER_SHAPE * n)),
    }
    arrays = blank(quantities(BroadPhase), lengths)
    for a, b in pairs:
        arrays["allowed"][min(a, b), max(a, b)] = 1 if a < b else 2
    for i in range(n):
        arrays["local_center"][i], arrays["radius"][i] = bounding_sphere(shapes, i)
    arrays["center"][:] = arrays["local_center"]
    return BroadPhase(
        moving,
        static,
        shapes.body[:n].copy(),
        **arrays,
        used=len(pairs) > 0,
        cell_size=float(2.0 * arrays["radius"][moving].max(initial=0.0)) or 1.0,
        neighbours=27 if np.any(shapes.kind >= HALF_SPACE) else 9,
    )


def bounding_sphere(shapes: Shapes, i: int) -> tuple[Any, float]:
    """Return the centre in the body's frame and the radius [m]: of the box around a polygon, exact
    for others."""
    if shapes.kind[i] != POLYGON:
        endless = shapes.kind[i] in ENDLESS
        return shapes.center[i], inf if endless else float(shapes.radius[i]) + hypot(
            *shapes.half_size[i]
        )
    corners = shapes.vertices[shapes.first[i] : shapes.first[i] + shapes.count[i]]
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    return [*middle, 0.0], max(hypot(*corner) for corner in corners - middle)


LARGEST_CELL = 2**40  # cell number of distant coordinates; int64 holds this cell and its neighbours


@kernel
def near_pairs(broad, w, margin):
    """Write the pairs that may have gap <= margin to `broad.pairs`; return how many, -1 if they do
    not fit."""
    width = broad.cell_size + margin
    count = 0
    broad.first[:] = -1
    for m in range(len(broad.moving)):
        i = broad.moving[m]
        store(broad.center, i, placed(w, broad.body[i], load(broad.local_center, i)))
        for axis in range(3):
            number = floor(broad.center[i, axis] / width)  # may be infinite or not a number
            broad.cell[m, axis] = int(number) if abs(number) < LARGEST_CELL else LARGEST_CELL
        for neighbour in range(broad.neighbours):
            x = broad.cell[m, 0] + neighbour % 3 - 1
            y = broad.cell[m, 1] + neighbour // 3 % 3 - 1
            z = broad.cell[m, 2] + (neighbour // 9 + 1) % 3 - 1  # the cell's own layer first
            n = broad.first[bucket_of(broad, x, y, z)]
            while n >= 0:
                if broad.cell[n, 0] == x and broad.cell[n, 1] == y and broad.cell[n, 2] == z:
                    count = keep_pair(broad, i, broad.moving[n], margin, count)
                n = broad.next[n]
        bucket = bucket_of(broad, broad.cell[m, 0], broad.cell[m, 1], broad.cell[m, 2])
        broad.next[m] = broad.first[bucket]
        broad.first[bucket] = m
        for j in broad.static:
            count = keep_pair(broad, i, j, margin, count)
    sort_keys(broad.key, count)
    for k in range(count):
        i = broad.key[k] // len(broad.radius)
        j = broad.key[k] % len(broad.radius)
        first = 0 if broad.allowed[i, j] == 1 else 1
        broad.pairs[k, first] = i
        broad.pairs[k, 1 - first] = j
    return count


@kernel
def bucket_of(broad, x, y, z):
    """Return the bucket of a cell, of 2ⁿ buckets, by a hash with three primes (Teschner et al.,
    2003)."""
    return ((x * 73856093) ^ (y * 19349663) ^ (z * 83492791)) & (len(broad.first) - 1)


@kernel
def keep_pair(broad, i, j, margin, count):
    """Append the pair if it is a candidate and its bounding spheres overlap; return the new count,
    -1: no room."""
    if i > j:
        i, j = j, i
    if broad.allowed[i, j] == 0:
        return count
    reach = broad.radius[i] + broad.radius[j] + margin
    apart = subtract(load(broad.center, i), load(broad.center, j))
    if dot(apart, apart) > reach * reach:
        return count
    if not 0 <= count < len(broad.key):
        return -1
    broad.key[count] = i * len(broad.radius) + j
    return count + 1


@kernel
def sort_keys(keys, count):
    """Sort the first `count` keys by Shell's method: no recursion, no scratch, few steps for every
    input order."""
    gap = count
    while gap > 1:
        gap = max(1, 4 * gap // 9)
        for k in range(gap, count):
            key = keys[k]
            at = k
            while at >= gap and keys[at - gap] > key:
                keys[at] = keys[at - gap]
                at -= gap
            keys[at] = key

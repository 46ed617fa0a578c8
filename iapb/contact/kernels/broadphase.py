"""Broad phase: find the pairs of shapes whose bounding spheres overlap, at a cost linear in the moving shapes.

Moving shapes are sorted into the cells of a uniform grid. A cell is as wide as the largest moving shape, so two shapes
can touch only in the same cell or in neighbouring cells. A hash table with counted buckets finds the cells (no list,
no allocation). Every moving shape is compared with every static one, which is linear in the moving shapes too.

The pairs keep the order of the candidate pairs, so a scene gives the same bits with and without the broad phase.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np

from iapb.compiled import flag, kernel
from iapb.contact.geometry import ENDLESS, HALF_SPACE, POLYGON, Shapes
from iapb.linalg import add, dot, load, store, subtract, transform
from iapb.schema import Floats, Indices, Integers, States, blank, quantities

# Below this number of candidate pairs testing all is as fast: the narrow phase rejects distant pairs early.
WORTHWHILE_PAIRS = 150
# Pairs kept per shape: bounding spheres of equal, closely packed shapes overlap about a dozen neighbours.
PAIRS_PER_SHAPE = 40


class BroadPhase(NamedTuple):
    """Bounding spheres of n shapes, k of them moving, and the scratch of the grid."""

    moving: Indices  # (k,) shapes on moving bodies
    static: Indices  # (n - k,)
    body: Indices  # (n,)
    allowed: Annotated[States, "shape shape"]  # for i < j: 1 candidate pair (i, j), 2 candidate pair (j, i), 0 none
    local_center: Annotated[Floats, "shape 3"]  # [m] of the bounding sphere in the body's frame
    radius: Annotated[Floats, "shape"]  # [m], infinite for half-planes and half-spaces
    cell_size: float  # [m] largest diameter of a moving shape
    neighbours: int  # cells to look at: 9 in the plane, 27 in space
    center: Annotated[Floats, "shape 3"]  # [m] world; those of static shapes are constant
    cell: Annotated[Integers, "moving 3"]
    bucket: Annotated[Integers, "moving"]
    start: Annotated[Integers, "bucket"]  # one more than there are buckets
    sorted: Annotated[Integers, "moving"]
    key: Annotated[Integers, "pair"]
    pairs: Annotated[Indices, "pair 2"]  # output
    used: Any  # `iapb.compiled.flag`


def make_broad_phase(shapes: Shapes, pairs: Indices) -> BroadPhase:
    """Return the broad phase of the candidate pairs (k, 2); without pairs (broad phase off) it is a stub."""
    n = len(shapes.kind) if len(pairs) else 0
    moving, static = (np.flatnonzero(each).astype(np.int32) for each in (shapes.body[:n] >= 0, shapes.body[:n] < 0))
    lengths = {"shape": n, "moving": len(moving), "bucket": (1 << (2 * len(moving)).bit_length()) + 1,
               "pair": max(1, min(len(pairs), PAIRS_PER_SHAPE * n))}
    arrays = blank(quantities(BroadPhase), lengths)
    for a, b in pairs:
        arrays["allowed"][min(a, b), max(a, b)] = 1 if a < b else 2
    for i in range(n):
        arrays["local_center"][i], arrays["radius"][i] = _bounding_sphere(shapes, i)
    arrays["center"][:] = arrays["local_center"]
    return BroadPhase(
        moving, static, shapes.body[:n].copy(), **arrays, used=flag(len(pairs) > 0),
        cell_size=float(2.0 * arrays["radius"][moving].max(initial=0.0)) or 1.0,
        neighbours=27 if np.any(shapes.kind >= HALF_SPACE) else 9)


def _bounding_sphere(shapes: Shapes, i: int) -> tuple[Any, float]:
    """Return the centre in the body's frame and the radius [m]: of the box around a polygon, exact for others."""
    if shapes.kind[i] != POLYGON:
        endless = shapes.kind[i] in ENDLESS
        return shapes.center[i], math.inf if endless else float(shapes.radius[i]) + math.hypot(*shapes.half_size[i])
    corners = shapes.vertices[shapes.first[i] : shapes.first[i] + shapes.count[i]]
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    return [*middle, 0.0], max(math.hypot(*corner) for corner in corners - middle)


LARGEST_CELL = 2**40  # cell number of distant coordinates; int64 holds this cell and its neighbours


@kernel(needs="used", otherwise=0)
def near_pairs(broad, R, p, margin):
    """Write the pairs that may have gap <= margin to `broad.pairs`; return how many, -1 if they do not fit."""
    fill_buckets(broad, R, p, margin)
    count = moving_pairs(broad, margin)
    for i in broad.moving:
        for j in broad.static:
            count = keep_pair(broad, i, j, margin, count)
    sort_keys(broad.key, count)
    for k in range(count):
        i, j = broad.key[k] // broad.radius.shape[0], broad.key[k] % broad.radius.shape[0]
        first = 0 if broad.allowed[i, j] == 1 else 1
        broad.pairs[k, first], broad.pairs[k, 1 - first] = i, j
    return count


@kernel
def bucket_of(x, y, z, buckets):
    """Return the bucket of a cell by a hash with three primes (Teschner et al., 2003); `buckets`: a power of two."""
    return ((x * 73856093) ^ (y * 19349663) ^ (z * 83492791)) & (buckets - 1)


@kernel
def fill_buckets(broad, R, p, margin):
    """Place the bounding spheres of the moving shapes; sort them by the bucket of their cell (counting sort)."""
    buckets, width = broad.start.shape[0] - 1, broad.cell_size + margin
    broad.start[:] = 0
    for m in range(broad.moving.shape[0]):
        i = broad.moving[m]
        body = broad.body[i]
        store(broad.center, i, add(load(p, body), transform(R, body, load(broad.local_center, i))))
        for axis in range(3):
            number = math.floor(broad.center[i, axis] / width)  # may be infinite or not a number
            broad.cell[m, axis] = int(number) if abs(number) < LARGEST_CELL else LARGEST_CELL
        broad.bucket[m] = bucket_of(broad.cell[m, 0], broad.cell[m, 1], broad.cell[m, 2], buckets)
        broad.start[broad.bucket[m] + 1] += 1
    for k in range(buckets):
        broad.start[k + 1] += broad.start[k]
    for m in range(broad.moving.shape[0]):
        broad.sorted[broad.start[broad.bucket[m]]] = m
        broad.start[broad.bucket[m]] += 1
    for k in range(buckets, 0, -1):  # filling moved every start to the next one
        broad.start[k] = broad.start[k - 1]
    broad.start[0] = 0


@kernel
def moving_pairs(broad, margin):
    """Append the pairs of moving shapes from the 9 (plane) or 27 cells around each shape, each pair once."""
    buckets, count = broad.start.shape[0] - 1, 0
    for m in range(broad.moving.shape[0]):
        for neighbour in range(broad.neighbours):
            x = broad.cell[m, 0] + neighbour % 3 - 1
            y = broad.cell[m, 1] + neighbour // 3 % 3 - 1
            z = broad.cell[m, 2] + (neighbour // 9 + 1) % 3 - 1  # the cell's own layer first
            bucket = bucket_of(x, y, z, buckets)
            for k in range(broad.start[bucket], broad.start[bucket + 1]):
                n = broad.sorted[k]
                if n <= m or broad.cell[n, 0] != x or broad.cell[n, 1] != y or broad.cell[n, 2] != z:
                    continue
                count = keep_pair(broad, broad.moving[m], broad.moving[n], margin, count)
    return count


@kernel
def keep_pair(broad, i, j, margin, count):
    """Append the pair if it is a candidate and its bounding spheres overlap; return the new count, -1: no room."""
    if i > j:
        i, j = j, i
    if broad.allowed[i, j] == 0:
        return count
    reach, apart = broad.radius[i] + broad.radius[j] + margin, subtract(load(broad.center, i), load(broad.center, j))
    if dot(apart, apart) > reach * reach:
        return count
    if not 0 <= count < broad.key.shape[0]:
        return -1
    broad.key[count] = i * broad.radius.shape[0] + j
    return count + 1


@kernel
def sort_keys(keys, count):
    """Sort the first `count` keys by heapsort: no recursion, no scratch, n log n for every input order."""
    for root in range(count // 2 - 1, -1, -1):
        _sift(keys, root, count)
    for end in range(count - 1, 0, -1):
        keys[0], keys[end] = keys[end], keys[0]
        _sift(keys, 0, end)


@kernel
def _sift(keys, root, end):
    while True:
        child = 2 * root + 1
        if child >= end:
            return
        if child + 1 < end and keys[child + 1] > keys[child]:
            child += 1
        if keys[root] >= keys[child]:
            return
        keys[root], keys[child] = keys[child], keys[root]
        root = child

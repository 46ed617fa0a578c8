"""Shapes of a scene and the arrays that the narrow phase reads and writes.

The planar shapes are half-plane, circle and convex polygon (a planar box is a polygon); the spatial
shapes are half-space, sphere and box. Every shape belongs to a body and is given in the frame of
that body. Body -1 is the static world; its frame is the world frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, NamedTuple

import numpy as np

from iapb.numerics.schema import (
    FlagPerContact,
    FloatPerContact,
    Floats,
    IndexPerContact,
    Indices,
    NumberPerContact,
    States,
    VectorPerContact,
)

HALF_PLANE = 0
CIRCLE = 1
POLYGON = 2
HALF_SPACE = 3
SPHERE = 4
BOX = 5
ENDLESS = (HALF_PLANE, HALF_SPACE)  # always of the static world
WORLD = -1  # the body index of the static world

# Largest number of contacts of one pair: a face on a face keeps four, a box on a half-space has
# eight corners.
BOX_PAIR_CONTACTS = 4
BOX_CORNERS = 8
# Extra rows of the buffer: clipping a face writes all corners of the overlap before it keeps four.
CLIPPING_ROOM = 24
# In a scene with many shapes not all pairs can touch at once: `CONTACTS_PER_SHAPE` is six
# neighbours with four contacts each. Up to `SMALL_CAPACITY` contacts the buffer has room for the
# contacts of every pair.
CONTACTS_PER_SHAPE = 24
SMALL_CAPACITY = 4096


class Shapes(NamedTuple):
    """All shapes of a scene, n of them with m vertices in total, as contiguous arrays for the
    kernels."""

    kind: Indices  # (n,) HALF_PLANE, CIRCLE, POLYGON, HALF_SPACE, SPHERE or BOX
    body: Indices  # (n,) body that carries the shape, -1 = the static world
    radius: Floats  # (n,) [m] of a circle or sphere, else 0
    first: Indices  # (n,) row of `vertices` where the shape begins
    count: Indices  # type: ignore[assignment]  # (n,) rows: half-plane 2, circle 1, polygon >= 3, in space 0
    # (m, 2) [m]; half-plane: point, unit outward normal; circle: centre; polygon: CCW
    vertices: Floats
    center: Floats  # (n, 3) [m] of a circle, sphere or box, point of a half-space; else 0
    # (n, 3, 3) box: its axes as columns; half-space: column 2 is the unit outward normal
    axes: Floats
    half_size: Floats  # (n, 3) [m] of a box, along its axes


class ContactBuffer(NamedTuple):
    """Contacts of one step in arrays of a fixed capacity; the caller keeps the number of rows in
    use.

    `detect` writes the geometry, up to `gap`. Later kernels of the step write the fields after
    `gap`.
    """

    shape_a: IndexPerContact
    shape_b: IndexPerContact
    body_a: IndexPerContact  # moving body that the normal points into
    body_b: IndexPerContact  # other body, -1 = the static world
    feature: NumberPerContact  # which vertex and edge touch; stable while they do
    # [m] world, midway between the two surfaces along the normal
    point: VectorPerContact
    normal: VectorPerContact  # unit, from b into a
    gap: FloatPerContact  # [m] negative = overlap
    # found beside the geometry (`present_contacts`)
    is_new: FlagPerContact  # not a contact of the previous step
    normal_velocity: FloatPerContact  # [m/s] positive separates
    # [m/s] of a relative to b, orthogonal to the normal
    tangential_velocity: VectorPerContact
    idle: FlagPerContact  # takes no part in the present part of a step
    moved: FlagPerContact  # it has moved on in the step since it struck
    lift: FloatPerContact  # [m] that it would bend off its support in this part
    # what the next step needs to know
    normal_force: FloatPerContact  # [N] on a along the normal
    expected: FloatPerContact  # [m] gap after the step if it were linear
    span: FloatPerContact  # [s] of the part of a step that `expected` is about
    sticks: FlagPerContact  # its points move together, by friction
    point_a: VectorPerContact  # [m] the point in the axes of body a
    point_b: VectorPerContact  # [m] the point in the axes of body b
    slid: VectorPerContact  # [m] Δt J v of the step
    rolled: VectorPerContact  # angle of a relative to b in the step, times the normal
    drift: VectorPerContact  # [m] a relative to b since they stick
    # the rest of the step
    collides: FlagPerContact  # enters the impact of this step
    friction_force: VectorPerContact  # [N] on a
    mark: Annotated[States, "contact"]  # scratch of the clustering
    struck_point: VectorPerContact  # [m] where it struck, if it has moved on
    struck_normal: VectorPerContact  # the normal then


class Shape(NamedTuple):
    """A shape as its rows of `Shapes`."""

    kind: int
    body: int = WORLD
    radius: float = 0.0
    vertices: Any = np.zeros((0, 2))
    center: Any = (0.0, 0.0, 0.0)
    axes: Any = np.eye(3)
    half_size: Any = (0.0, 0.0, 0.0)


def make_shapes(given: Sequence[Shape]) -> Shapes:
    """Return the arrays of the given shapes in their order."""
    kind, body, radius, vertices, center, axes, half_size = (
        zip(*given, strict=True) if given else [()] * 7
    )
    count = np.array([len(rows) for rows in vertices], np.int32)
    n = len(given)
    return Shapes(
        np.array(kind, np.int32),
        np.array(body, np.int32),
        np.array(radius, float),
        (np.cumsum(count) - count).astype(np.int32),
        count,
        np.concatenate([np.zeros((0, 2)), *vertices]),
        np.array(center, float).reshape(n, 3),
        np.array(axes, float).reshape(n, 3, 3),
        np.array(half_size, float).reshape(n, 3),
    )


def candidate_pairs(shapes: Shapes) -> Indices:
    """Return the pairs (k, 2) of shape indices (a, b) to test.

    The bodies of a pair differ and shape a moves. Of two moving bodies the one with the smaller
    index is a, so that all contacts of two bodies have normals of equal sense.
    """
    i, j = np.triu_indices(len(shapes.kind), 1)
    one = shapes.body[i]
    other = shapes.body[j]
    swapped = (one < 0) | (0 <= other) & (other < one)
    pairs = np.column_stack([np.where(swapped, j, i), np.where(swapped, i, j)])
    return pairs[one != other].astype(np.int32)


def contact_capacity(shapes: Shapes, pairs: Indices) -> int:
    """Return a capacity that `detect` does not exceed for these pairs (at least 1).

    Up to SMALL_CAPACITY contacts this is certain. Above, the capacity is CONTACTS_PER_SHAPE
    contacts per shape, which is enough unless many shapes overlap one another.
    """
    a, b = shapes.kind[pairs].T
    alike = a == b
    total = int(
        np.select(
            [
                b == HALF_PLANE,
                (b == HALF_SPACE) & (a == BOX),
                alike & (a == BOX),
                alike & (a == POLYGON),
            ],
            [shapes.count[pairs[:, 0]], BOX_CORNERS, BOX_PAIR_CONTACTS, 2],
            1,
        ).sum()
    )
    if total > SMALL_CAPACITY:
        total = min(total, max(SMALL_CAPACITY, CONTACTS_PER_SHAPE * len(shapes.kind)))
    return max(total + CLIPPING_ROOM * bool(np.any(shapes.kind == BOX)), 1)

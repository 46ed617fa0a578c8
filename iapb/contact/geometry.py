"""Shapes of a scene and the arrays that the narrow phase reads and writes.

The planar shapes are half-plane, circle and convex polygon (a planar box is a polygon); the spatial shapes are
half-space, sphere and box. Every shape belongs to a body and is given in the frame of that body. Body -1 is the
static world; its frame is the world frame.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.compiled import flag
from iapb.elementary import sine_cosine
from iapb.errors import ArgumentError
from iapb.linalg import product

HALF_PLANE, CIRCLE, POLYGON = 0, 1, 2
HALF_SPACE, SPHERE, BOX = 3, 4, 5
ENDLESS = (HALF_PLANE, HALF_SPACE)
WORLD = -1  # the body index of the static world

# Largest number of contacts of one pair: a face on a face keeps four, a box on a half-space has eight corners.
BOX_PAIR_CONTACTS, BOX_CORNERS = 4, 8
# Extra rows of the buffer: clipping a face writes all corners of the overlap before it keeps four.
CLIPPING_ROOM = 24
# In a scene with many shapes not all pairs can touch at once: `CONTACTS_PER_SHAPE` is six neighbours with four
# contacts each. Up to `SMALL_CAPACITY` contacts the buffer has room for the contacts of every pair.
CONTACTS_PER_SHAPE, SMALL_CAPACITY = 24, 4096

# A polygon counts as convex if no corner turns inwards by more than this [rad]. Vertices given with six digits describe
# straight edges to about 1e-6, and the effect of so small a turn on the surface is negligible.
CONVEXITY_TOLERANCE = 1e-6

Floats = NDArray[np.float64]
Integers = NDArray[np.int32]


class Shapes(NamedTuple):
    """All shapes of a scene, n of them with m vertices in total, as contiguous arrays for the kernels."""

    kind: Integers  # (n,) HALF_PLANE, CIRCLE, POLYGON, HALF_SPACE, SPHERE or BOX
    body: Integers  # (n,) body that carries the shape, -1 = the static world
    radius: Floats  # (n,) [m] of a circle or sphere, else 0
    first: Integers  # (n,) row of `vertices` where the shape begins
    count: Integers  # type: ignore[assignment]  # (n,) rows: half-plane 2, circle 1, polygon >= 3
    vertices: Floats  # (m, 2) [m]; half-plane: point, unit outward normal; circle: centre; polygon: CCW
    center: Floats  # (n, 3) [m] of a sphere or box, point of a half-space; planar shapes: 0
    axes: Floats  # (n, 3, 3) box: its axes as columns; half-space: column 2 is the unit outward normal
    half_size: Floats  # (n, 3) [m] of a box, along its axes
    space: Any  # whether they are shapes in space (`iapb.compiled.flag`)


class ContactBuffer(NamedTuple):
    """Contacts of one step in arrays of a fixed capacity c; the caller keeps the number of rows in use.

    `detect` writes the geometry, up to `gap`. Later kernels of the step write the fields after `gap`.
    """

    shape_a: Integers  # (c,)
    shape_b: Integers  # (c,)
    body_a: Integers  # (c,) moving body that the normal points into
    body_b: Integers  # (c,) other body, -1 = the static world
    feature: NDArray[np.int64]  # (c,) which vertex and edge touch; stable while they do
    point: Floats  # (c, 3) [m] world, midway between the two surfaces along the normal
    normal: Floats  # (c, 3) unit, from b into a
    gap: Floats  # (c,) [m] negative = overlap
    is_new: NDArray[np.bool_]  # (c,) not a contact of the previous step
    collides: NDArray[np.bool_]  # (c,) enters the impact of this step
    normal_velocity: Floats  # (c,) [m/s] positive separates
    tangential_velocity: Floats  # (c, 3) [m/s] of a relative to b, orthogonal to the normal
    normal_force: Floats  # (c,) [N] on a along the normal
    friction_force: Floats  # (c, 3) [N] on a
    mark: NDArray[np.int8]  # (c,) scratch of the clustering


@dataclass(frozen=True)
class HalfPlane:
    """All points x with (x - point)·normal <= 0: the solid lies behind the outward normal (length > 0)."""

    point: ArrayLike
    normal: ArrayLike
    body: int = WORLD


@dataclass(frozen=True)
class Circle:
    """A disc: radius [m] and centre [m] in the frame of its body."""

    radius: float
    center: ArrayLike = (0.0, 0.0)
    body: int = WORLD


@dataclass(frozen=True)
class Polygon:
    """A convex polygon: vertices (k, 2) [m] in the frame of its body, either orientation (stored CCW)."""

    vertices: ArrayLike
    body: int = WORLD


Shape = HalfPlane | Circle | Polygon


def box(size: ArrayLike, center: ArrayLike = (0.0, 0.0), angle: float = 0.0, body: int = WORLD) -> Polygon:
    """Return the rectangle of full side lengths `size` [m] about `center`, turned by `angle` [rad]."""
    width, height = _plane_vector("size", size)
    if not (width > 0.0 and height > 0.0):
        raise ArgumentError("size", size, "two side lengths > 0")
    corners = 0.5 * np.array([[-width, -height], [width, -height], [width, height], [-width, height]])
    sin, cos = sine_cosine(float(angle))
    return Polygon(product(corners, [[cos, sin], [-sin, cos]]) + _plane_vector("center", center), body)


def make_shapes(descriptions: Sequence[Shape]) -> Shapes:
    """Return the arrays of the given shapes, in the given order.

    Raises
    ------
    ArgumentError
        A radius or a normal of length 0, a polygon that is not strictly convex, values that are not finite.
    """
    blocks = [_vertex_block(f"shapes[{i}]", shape) for i, shape in enumerate(descriptions)]
    count = np.array([len(block) for block in blocks], np.int32)
    first = (np.cumsum(count) - count).astype(np.int32)
    kinds = {HalfPlane: HALF_PLANE, Circle: CIRCLE, Polygon: POLYGON}
    n = len(descriptions)
    return Shapes(
        kind=np.array([kinds[type(shape)] for shape in descriptions], np.int32),
        body=np.array([shape.body for shape in descriptions], np.int32),
        radius=np.array([getattr(shape, "radius", 0.0) for shape in descriptions], np.float64),
        first=first,
        count=count,
        vertices=np.concatenate(blocks) if blocks else np.zeros((0, 2)),
        center=np.zeros((n, 3)),
        axes=np.tile(np.eye(3), (n, 1, 1)),
        half_size=np.zeros((n, 3)),
        space=flag(False),
    )


def candidate_pairs(shapes: Shapes, may_touch: Callable[[int, int], bool] | None = None) -> Integers:
    """Return the pairs (k, 2) of shape indices (a, b) to test.

    The bodies of a pair differ, shape a moves, and a half-plane or half-space is always b. Pairs of bodies for which
    `may_touch(body_a, body_b)` is False are left out (for instance links joined to each other). Otherwise, of two
    moving bodies the one with the smaller index is a, so that all contacts of two bodies have normals of equal sense.
    """
    pairs = []
    for i in range(len(shapes.kind)):
        for j in range(i + 1, len(shapes.kind)):
            pair = _ordered_pair(shapes, i, j)
            if pair is None:
                continue
            body_a, body_b = (int(shapes.body[k]) for k in pair)
            if may_touch is None or may_touch(body_a, body_b):
                pairs.append(pair)
    return np.array(pairs, np.int32).reshape(-1, 2)


def make_contact_buffer(capacity: int) -> ContactBuffer:
    """Return an empty buffer for `capacity` contacts (>= 1)."""
    if capacity < 1:
        raise ArgumentError("capacity", capacity, "at least one contact")
    vectors = {"point", "normal", "tangential_velocity", "friction_force"}
    dtypes: dict[str, Any] = dict.fromkeys(("shape_a", "shape_b", "body_a", "body_b"), np.int32)
    dtypes |= {"feature": np.int64, "is_new": np.bool_, "collides": np.bool_, "mark": np.int8}
    arrays = {
        name: np.zeros((capacity, 3) if name in vectors else capacity, dtypes.get(name, np.float64))
        for name in ContactBuffer._fields
    }
    return ContactBuffer(**arrays)


def contact_capacity(shapes: Shapes, pairs: Integers) -> int:
    """Return a capacity that `detect` does not exceed for these pairs (at least 1).

    Up to SMALL_CAPACITY contacts this is certain. Above, the capacity is CONTACTS_PER_SHAPE contacts per shape, which
    is enough unless many shapes overlap one another.
    """
    total = sum(_most_contacts(shapes, int(a), int(b)) for a, b in pairs)
    if total > SMALL_CAPACITY:
        total = min(total, max(SMALL_CAPACITY, CONTACTS_PER_SHAPE * len(shapes.kind)))
    clipped = CLIPPING_ROOM if np.any(shapes.kind == BOX) else 0
    return max(total + clipped, 1)


def _most_contacts(shapes: Shapes, a: int, b: int) -> int:
    """Return the largest number of contacts of one pair."""
    kinds = (int(shapes.kind[a]), int(shapes.kind[b]))
    if kinds[1] == HALF_PLANE:
        return int(shapes.count[a])  # one contact per vertex
    if kinds[1] == HALF_SPACE:
        return BOX_CORNERS if kinds[0] == BOX else 1
    return {(POLYGON, POLYGON): 2, (BOX, BOX): BOX_PAIR_CONTACTS}.get(kinds, 1)


def _ordered_pair(shapes: Shapes, i: int, j: int) -> tuple[int, int] | None:
    body_i, body_j = int(shapes.body[i]), int(shapes.body[j])
    if body_i == body_j:
        return None
    swap = body_i == WORLD or (body_j != WORLD and body_j < body_i)
    a, b = (j, i) if swap else (i, j)
    if shapes.kind[a] in ENDLESS:
        if shapes.body[b] == WORLD or shapes.kind[b] in ENDLESS:
            return None  # a moving half-plane against the world, or two half-planes: no contact is defined
        a, b = b, a
    return a, b


def _vertex_block(name: str, shape: Shape) -> Floats:
    """Return the rows of `Shapes.vertices` for one shape."""
    if isinstance(shape, HalfPlane):
        point = _plane_vector(f"{name}.point", shape.point)
        normal = _plane_vector(f"{name}.normal", shape.normal)
        length = math.hypot(*normal)
        if length == 0.0:
            raise ArgumentError(f"{name}.normal", shape.normal, "a vector longer than 0")
        return np.array([point, normal / length])
    if isinstance(shape, Circle):
        if not (math.isfinite(shape.radius) and shape.radius > 0.0):
            raise ArgumentError(f"{name}.radius", shape.radius, "a finite radius > 0")
        return _plane_vector(f"{name}.center", shape.center)[None, :]
    return _convex_vertices(f"{name}.vertices", shape.vertices)


def _convex_vertices(name: str, vertices: ArrayLike) -> Floats:
    """Return the vertices counterclockwise, or raise if they do not form a convex polygon."""
    corners = np.asarray(vertices, np.float64)
    if corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3 or not np.all(np.isfinite(corners)):
        raise ArgumentError(name, vertices, "an array (k, 2) of finite numbers, k >= 3")
    edges = np.roll(corners, -1, axis=0) - corners
    following = np.roll(edges, -1, axis=0)
    turns = np.arctan2(
        edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0], np.sum(edges * following, axis=1)
    )
    orientation = math.copysign(1.0, turns.sum())
    lengths = np.hypot(edges[:, 0], edges[:, 1])
    once_around = abs(abs(turns.sum()) - 2.0 * math.pi) < CONVEXITY_TOLERANCE
    if lengths.min() == 0.0 or not once_around or (orientation * turns).min() < -CONVEXITY_TOLERANCE:
        expected = "the corners of a convex polygon in order, no two neighbours equal"
        raise ArgumentError(name, vertices, expected)
    return np.ascontiguousarray(corners if orientation > 0.0 else corners[::-1])


def _plane_vector(name: str, value: ArrayLike) -> Floats:
    vector = np.asarray(value, np.float64)
    if vector.shape != (2,) or not np.all(np.isfinite(vector)):
        raise ArgumentError(name, value, "two finite numbers")
    return vector


# Spatial shapes: half-space, sphere and box, each in the frame of its body. All lengths in metres.

# Axes given with nine digits count as a rotation.
ROTATION_TOLERANCE = 1e-8

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
        A radius, side or normal of length 0, axes that do not form a rotation, values that are not finite.
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
        space=flag(True),
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
    """Return right-handed axes (columns); the third axis points along `normal`."""
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

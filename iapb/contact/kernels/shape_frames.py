"""Helpers of the pair kernels: placements of shapes, feature numbers, storing a contact."""

from __future__ import annotations

from iapb.compiled import kernel
from iapb.linalg import add, column, load, store, transform

# A feature number is (kind << 40) | (vertex << 20) | edge: vertex i of one shape against edge j of the other.
# 20 bits hold a million vertices; shapes with more would need a different narrow phase anyway.
_VERTEX_SHIFT, _KIND_SHIFT = 20, 40


@kernel
def vertex_feature(kind, vertex, edge):
    """Return the feature number. kind 0: vertex of a, edge of b; 1: vertex of b, edge of a; 2: two corners."""
    return (kind << _KIND_SHIFT) | (vertex << _VERTEX_SHIFT) | edge


@kernel
def placement(body, R, p):
    """Return the planar part of a body's placement: R row by row, then p; body < 0 is the world."""
    if body < 0:
        return 1.0, 0.0, 0.0, 1.0, 0.0, 0.0
    return R[body, 0, 0], R[body, 0, 1], R[body, 1, 0], R[body, 1, 1], p[body, 0], p[body, 1]


@kernel
def to_world(x, y, body, R, p):
    """Return the world coordinates of a point given in a body's frame; body < 0 is the world."""
    if body < 0:
        return x, y
    return (
        R[body, 0, 0] * x + R[body, 0, 1] * y + p[body, 0],
        R[body, 1, 0] * x + R[body, 1, 1] * y + p[body, 1],
    )


@kernel
def turn_to_world(x, y, body, R):
    """Return the world components of a direction given in a body's frame."""
    if body < 0:
        return x, y
    return R[body, 0, 0] * x + R[body, 0, 1] * y, R[body, 1, 0] * x + R[body, 1, 1] * y


@kernel
def world_point(shapes, row, shape, R, p):
    """Return the world coordinates of row `row` of `shapes.vertices`, which belongs to `shape`."""
    return to_world(shapes.vertices[row, 0], shapes.vertices[row, 1], shapes.body[shape], R, p)


@kernel
def relative_frame(shapes, onto, other, R, p):
    """Return rotation Q (4 numbers) and translation t of `other` relative to `onto`: x_onto = Q x_other + t."""
    ixx, ixy, iyx, iyy, ix, iy = placement(shapes.body[onto], R, p)
    jxx, jxy, jyx, jyy, jx, jy = placement(shapes.body[other], R, p)
    dx, dy = jx - ix, jy - iy
    return (
        ixx * jxx + iyx * jyx,
        ixx * jxy + iyx * jyy,
        ixy * jxx + iyy * jyx,
        ixy * jxy + iyy * jyy,
        ixx * dx + iyx * dy,
        ixy * dx + iyy * dy,
    )


@kernel
def store_in_plane(buffer, count, shapes, a, b, feature, x, y, nx, ny, gap):
    """Do `store_in_space` for a contact in the plane."""
    return store_in_space(buffer, count, shapes, a, b, feature, (x, y, 0.0), (nx, ny, 0.0), gap)


# The same helpers in space, where vectors are tuples (see `iapb.linalg`).


@kernel
def world_center(shapes, shape, R, p):
    """Return, in the world, the centre of a sphere or box, or the point of a half-space."""
    body, local = shapes.body[shape], load(shapes.center, shape)
    if body < 0:
        return local
    return add(load(p, body), transform(R, body, local))


@kernel
def world_axis(shapes, shape, k, R):
    """Return axis k of a shape in the world; axis 2 of a half-space is its outward normal."""
    body, local = shapes.body[shape], column(shapes.axes, shape, k)
    return local if body < 0 else transform(R, body, local)


@kernel
def store_in_space(buffer, count, shapes, a, b, feature, point, normal, gap):
    """Write one contact at row `count`; return the next row, or -1 when the buffer is full."""
    if count >= buffer.gap.shape[0]:
        return -1
    buffer.shape_a[count] = a
    buffer.shape_b[count] = b
    buffer.body_a[count] = shapes.body[a]
    buffer.body_b[count] = shapes.body[b]
    buffer.feature[count] = feature
    store(buffer.point, count, point)
    store(buffer.normal, count, normal)
    buffer.gap[count] = gap
    return count + 1


@kernel
def copy_contact(to, i, contacts, j):
    """Copy the geometry of contact j to row i of the buffer `to`."""
    to.shape_a[i], to.shape_b[i], to.feature[i] = contacts.shape_a[j], contacts.shape_b[j], contacts.feature[j]
    to.body_a[i], to.body_b[i], to.gap[i] = contacts.body_a[j], contacts.body_b[j], contacts.gap[j]
    store(to.point, i, load(contacts.point, j))
    store(to.normal, i, load(contacts.normal, j))

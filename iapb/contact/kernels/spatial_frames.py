"""Small steps shared by the spatial pair kernels: shapes in world axes, storing a contact.

Vectors are tuples (see `iapb.mechanics.kernels.vectors`). Body -1 is the world: its frame is the identity.
"""

from __future__ import annotations

from iapb.compiled import kernel
from iapb.mechanics.kernels.vectors import add, column, load, store, transform


@kernel
def world_center(shapes, shape, R, p):
    """Centre of a sphere or box, point of a half-space, in the world."""
    body, local = shapes.body[shape], load(shapes.center, shape)
    if body < 0:
        return local
    return add(load(p, body), transform(R, body, local))


@kernel
def world_axis(shapes, shape, k, R):
    """Axis k of a shape in the world; axis 2 of a half-space is its outward normal."""
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
def copy_contact(buffer, target, source):
    """Row `target` <- row `source`, geometry only."""
    buffer.shape_a[target], buffer.shape_b[target] = buffer.shape_a[source], buffer.shape_b[source]
    buffer.body_a[target], buffer.body_b[target] = buffer.body_a[source], buffer.body_b[source]
    buffer.feature[target], buffer.gap[target] = buffer.feature[source], buffer.gap[source]
    store(buffer.point, target, load(buffer.point, source))
    store(buffer.normal, target, load(buffer.normal, source))

"""What the narrow phases of plane and space share: placements of shapes, feature numbers, balls,
storing a contact."""

from __future__ import annotations

from iapb.contact.geometry import CIRCLE, HALF_SPACE, ContactBuffer
from iapb.numerics.compiled import kernel
from iapb.numerics.copying import line_copier
from iapb.numerics.elementary import hypotenuse
from iapb.numerics.linalg import (
    add,
    column,
    divide,
    load,
    norm,
    placed,
    scale,
    store,
    subtract,
    transform,
)
from iapb.numerics.schema import quantities


@kernel
def vertex_feature(kind, vertex, edge):
    """Return the number of a feature: its kind, and vertex and edge with 20 bits each.

    kind 0: vertex of a, edge of b; 1: vertex of b, edge of a; 2: two corners; 3 to 5: faces and
    edges of boxes
    """
    return (kind << 40) | (vertex << 20) | edge


@kernel
def placement(body, w):
    """Return the planar part of a body's placement: R row by row, then p; body < 0 is the world."""
    if body < 0:
        return 1.0, 0.0, 0.0, 1.0, 0.0, 0.0
    return (
        w.rotation[body, 0, 0],
        w.rotation[body, 0, 1],
        w.rotation[body, 1, 0],
        w.rotation[body, 1, 1],
        w.position[body, 0],
        w.position[body, 1],
    )


@kernel
def relative_frame(shapes, onto, other, w):
    """Return the planar placement (see `placement`) of the body of `other` in that of `onto`."""
    ixx, ixy, iyx, iyy, ix, iy = placement(shapes.body[onto], w)
    jxx, jxy, jyx, jyy, jx, jy = placement(shapes.body[other], w)
    dx = jx - ix
    dy = jy - iy
    return (
        ixx * jxx + iyx * jyx,
        ixx * jxy + iyx * jyy,
        ixy * jxx + iyy * jyx,
        ixy * jxy + iyy * jyy,
        ixx * dx + iyx * dy,
        ixy * dx + iyy * dy,
    )


@kernel
def place(frame, x, y):
    """Return a point of the plane, given in a frame, where this frame is placed."""
    return frame[0] * x + frame[1] * y + frame[4], frame[2] * x + frame[3] * y + frame[5]


@kernel
def turn_to_world(x, y, body, w):
    """Return the world components of a direction of the plane given in a body's frame."""
    if body < 0:
        return x, y
    return w.rotation[body, 0, 0] * x + w.rotation[body, 0, 1] * y, w.rotation[
        body, 1, 0
    ] * x + w.rotation[body, 1, 1] * y


@kernel
def world_center(shapes, shape, w):
    """Return, in the world, the centre of a circle, sphere or box, or the point of a half-space."""
    return placed(w, shapes.body[shape], load(shapes.center, shape))


@kernel
def world_axis(shapes, shape, k, w):
    """Return axis k of a shape in the world; axis 2 of a half-space is its outward normal."""
    body = shapes.body[shape]
    local = column(shapes.axes, shape, k)
    return local if body < 0 else transform(w.rotation, body, local)


@kernel
def world_axes(shapes, shape, w):
    """Return the three axes of a shape in the world."""
    return (
        world_axis(shapes, shape, 0, w),
        world_axis(shapes, shape, 1, w),
        world_axis(shapes, shape, 2, w),
    )


@kernel
def balls(shapes, a, b, w, margin, buffer, count):
    """Write the contact of two circles or two spheres: gap = distance of centres - both radii.

    Coincident centres have no line for the normal. It is then along the last axis, antisymmetric in
    the two shapes.
    """
    center = world_center(shapes, b, w)
    apart = subtract(world_center(shapes, a, w), center)
    radius_a = shapes.radius[a]
    radius_b = shapes.radius[b]
    flat = shapes.kind[a] == CIRCLE
    if max(abs(apart[0]), abs(apart[1])) > radius_a + radius_b + margin:
        return count
    distance = hypotenuse(apart[0], apart[1]) if flat else norm(apart)
    gap = distance - (radius_a + radius_b)
    if gap > margin:
        return count
    sign = 1.0 if a < b else -1.0
    normal = (0.0, sign, 0.0) if flat else (0.0, 0.0, sign)
    if distance > 0.0:
        normal = divide(apart, distance)
    point = add(center, scale(0.5 * (distance + radius_b - radius_a), normal))
    return store_contact(shapes, a, b, True, 0, point, normal, gap, buffer, count)


@kernel
def ball_on_surface(
    shapes, ball, other, ball_is_a, center, normal, distance, feature, margin, buffer, count
):
    """Write the contact of a circle or sphere with the surface at a signed distance from its
    centre."""
    gap = distance - shapes.radius[ball]
    if gap > margin:
        return count
    point = subtract(center, scale(shapes.radius[ball] + 0.5 * gap, normal))
    return store_contact(shapes, ball, other, ball_is_a, feature, point, normal, gap, buffer, count)


@kernel
def store_contact(shapes, one, other, one_is_a, feature, point, normal, gap, buffer, count):
    """Write a contact at row `count`, its normal given out of shape `other`; return the next row,
    or -1: no room."""
    if not 0 <= count < len(buffer.gap):
        return -1
    a, b = (one, other) if one_is_a else (other, one)
    if not one_is_a:
        normal = (-normal[0], -normal[1], -normal[2] if shapes.kind[a] >= HALF_SPACE else 0.0)
    buffer.shape_a[count] = a
    buffer.shape_b[count] = b
    buffer.feature[count] = feature
    buffer.body_a[count] = shapes.body[a]
    buffer.body_b[count] = shapes.body[b]
    buffer.gap[count] = gap
    store(buffer.point, count, point)
    store(buffer.normal, count, normal)
    return count + 1


# the fields of a contact, and where each group of them begins
_FIELDS = quantities(ContactBuffer)
_FOUND, _PAST, _SLIP, _REST = (
    ContactBuffer._fields.index(name) for name in ("is_new", "normal_force", "point_a", "collides")
)
copy_contact = line_copier(_FIELDS)
copy_geometry = line_copier(_FIELDS[:_FOUND])
copy_found = line_copier(_FIELDS[:_PAST])
copy_past = line_copier(_FIELDS[:_FOUND] + _FIELDS[_PAST:_SLIP])  # for the next step
copy_slip = line_copier(_FIELDS[_SLIP:_REST])  # and for its friction


@kernel
def copy_contacts(to, contacts, count):
    """Copy the first `count` contacts to the buffer `to`."""
    for i in range(count):
        copy_contact(to, i, contacts, i)

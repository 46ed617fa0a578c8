"""What the narrow phases of plane and space share: placements of shapes, feature numbers, balls,
storing a contact."""

from __future__ import annotations

import math

from iapb.contact.geometry import CIRCLE, HALF_SPACE
from iapb.numerics.compiled import kernel
from iapb.numerics.elementary import hypotenuse
from iapb.numerics.linalg import add, column, dot, load, scale, store, subtract, transform


@kernel
def vertex_feature(kind, vertex, edge):
    """Return the number of a feature: its kind, and vertex and edge with 20 bits each.

    kind 0: vertex of a, edge of b; 1: vertex of b, edge of a; 2: two corners; 3 to 5: faces and
    edges of boxes
    """
    return (kind << 40) | (vertex << 20) | edge


@kernel
def placement(body, R, p):
    """Return the planar part of a body's placement: R row by row, then p; body < 0 is the world."""
    if body < 0:
        return 1.0, 0.0, 0.0, 1.0, 0.0, 0.0
    return R[body, 0, 0], R[body, 0, 1], R[body, 1, 0], R[body, 1, 1], p[body, 0], p[body, 1]


@kernel
def relative_frame(shapes, onto, other, R, p):
    """Return the planar placement (see `placement`) of the body of `other` in that of `onto`."""
    ixx, ixy, iyx, iyy, ix, iy = placement(shapes.body[onto], R, p)
    jxx, jxy, jyx, jyy, jx, jy = placement(shapes.body[other], R, p)
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
def turn_to_world(x, y, body, R):
    """Return the world components of a direction of the plane given in a body's frame."""
    if body < 0:
        return x, y
    return R[body, 0, 0] * x + R[body, 0, 1] * y, R[body, 1, 0] * x + R[body, 1, 1] * y


@kernel
def world_center(shapes, shape, R, p):
    """Return, in the world, the centre of a circle, sphere or box, or the point of a half-space."""
    body = shapes.body[shape]
    local = load(shapes.center, shape)
    return local if body < 0 else add(load(p, body), transform(R, body, local))


@kernel
def world_axis(shapes, shape, k, R):
    """Return axis k of a shape in the world; axis 2 of a half-space is its outward normal."""
    body = shapes.body[shape]
    local = column(shapes.axes, shape, k)
    return local if body < 0 else transform(R, body, local)


@kernel
def world_axes(shapes, shape, R):
    """Return the three axes of a shape in the world."""
    return (
        world_axis(shapes, shape, 0, R),
        world_axis(shapes, shape, 1, R),
        world_axis(shapes, shape, 2, R),
    )


@kernel
def balls(shapes, a, b, R, p, margin, buffer, count):
    """Write the contact of two circles or two spheres: gap = distance of centres - both radii.

    Coincident centres have no line for the normal. It is then along the last axis, antisymmetric in
    the two shapes.
    """
    center = world_center(shapes, b, R, p)
    apart = subtract(world_center(shapes, a, R, p), center)
    radius_a = shapes.radius[a]
    radius_b = shapes.radius[b]
    flat = shapes.kind[a] == CIRCLE
    if max(abs(apart[0]), abs(apart[1])) > radius_a + radius_b + margin:
        return count
    distance = hypotenuse(apart[0], apart[1]) if flat else math.sqrt(dot(apart, apart))
    gap = distance - (radius_a + radius_b)
    if gap > margin:
        return count
    sign = 1.0 if a < b else -1.0
    normal = (0.0, sign, 0.0) if flat else (0.0, 0.0, sign)
    if distance > 0.0:
        normal = (apart[0] / distance, apart[1] / distance, apart[2] / distance)
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
    if not 0 <= count < buffer.gap.shape[0]:
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


@kernel
def copy_contact(to, i, contacts, j):
    """Copy the geometry of contact j to row i of the buffer `to`."""
    to.shape_a[i] = contacts.shape_a[j]
    to.shape_b[i] = contacts.shape_b[j]
    to.feature[i] = contacts.feature[j]
    to.body_a[i] = contacts.body_a[j]
    to.body_b[i] = contacts.body_b[j]
    to.gap[i] = contacts.gap[j]
    store(to.point, i, load(contacts.point, j))
    store(to.normal, i, load(contacts.normal, j))


@kernel
def copy_found(to, i, contacts, j):
    """Copy contact j, its velocities and whether it is new to row i of the buffer `to`."""
    copy_contact(to, i, contacts, j)
    to.is_new[i] = contacts.is_new[j]
    to.idle[i] = contacts.idle[j]
    to.moved[i] = False
    to.normal_velocity[i] = contacts.normal_velocity[j]
    to.lift[i] = 0.0
    store(to.tangential_velocity, i, load(contacts.tangential_velocity, j))


@kernel
def copy_all(to, i, contacts, j):
    """Copy contact j with all that a step computes of it to row i of the buffer `to`."""
    copy_found(to, i, contacts, j)
    to.collides[i] = contacts.collides[j]
    to.mark[i] = contacts.mark[j]
    to.sticks[i] = contacts.sticks[j]
    to.normal_force[i] = contacts.normal_force[j]
    to.expected[i] = contacts.expected[j]
    to.span[i] = contacts.span[j]
    to.lift[i] = contacts.lift[j]
    to.moved[i] = contacts.moved[j]
    store(to.struck_point, i, load(contacts.struck_point, j))
    store(to.struck_normal, i, load(contacts.struck_normal, j))
    store(to.friction_force, i, load(contacts.friction_force, j))
    store(to.point_a, i, load(contacts.point_a, j))
    store(to.point_b, i, load(contacts.point_b, j))
    store(to.slid, i, load(contacts.slid, j))
    store(to.rolled, i, load(contacts.rolled, j))
    store(to.drift, i, load(contacts.drift, j))

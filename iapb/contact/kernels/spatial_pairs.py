"""Contacts of spatial shapes: spheres, half-spaces and boxes.

Conventions are those of the plane: the normal points from b into a, gap < 0 is overlap, the point
lies midway between the surfaces, and a contact is kept if gap <= margin. Every normal has unit
length, also where centres coincide.
"""

from __future__ import annotations

from math import inf

from iapb.contact.geometry import BOX, BOX_PAIR_CONTACTS
from iapb.contact.kernels.shape_frames import (
    ball_on_surface,
    copy_geometry,
    store_contact,
    vertex_feature,
    world_axes,
    world_axis,
    world_center,
)
from iapb.numerics.compiled import kernel
from iapb.numerics.linalg import ZERO, add, cross, divide, dot, load, norm, scale, subtract


@kernel
def corners_half_space(shapes, a, b, w, margin, buffer, count):
    """Write one contact per corner of box a, or one for sphere a: gap = (corner - point)·normal -
    radius."""
    normal = world_axis(shapes, b, 2, w)
    center = world_center(shapes, a, w)
    radius = shapes.radius[a]
    height = dot(subtract(center, world_center(shapes, b, w)), normal)
    x, y, z = world_axes(shapes, a, w)
    x = scale(shapes.half_size[a, 0], x)
    y = scale(shapes.half_size[a, 1], y)
    z = scale(shapes.half_size[a, 2], z)
    over_x = dot(x, normal)
    over_y = dot(y, normal)
    over_z = dot(z, normal)
    for corner in range(8 if shapes.kind[a] == BOX else 1):
        sx = 1.0 - 2.0 * (corner & 1)
        sy = 1.0 - (corner & 2)
        sz = 1.0 - 0.5 * (corner & 4)
        gap = height + (sx * over_x + (sy * over_y + sz * over_z)) - radius
        if gap <= margin:
            arm = add(scale(sx, x), add(scale(sy, y), scale(sz, z)))
            point = subtract(add(center, arm), scale(radius + 0.5 * gap, normal))
            count = store_contact(
                shapes, a, b, True, vertex_feature(0, corner, 0), point, normal, gap, buffer, count
            )
    return count


@kernel
def sphere_box(shapes, sphere, box, sphere_is_a, w, margin, buffer, count):
    """Write the contact of a sphere and a box, at the box's nearest point, or nearest face for a
    centre inside."""
    center = world_center(shapes, sphere, w)
    apart = subtract(center, world_center(shapes, box, w))
    half = load(shapes.half_size, box)
    reach = half[0] + half[1] + half[2] + shapes.radius[sphere] + margin
    if dot(apart, apart) > reach * reach:
        return count
    axes = world_axes(shapes, box, w)
    region = 0
    outward = ZERO
    exit_distance = inf
    exit_region = 0
    exit_normal = (0.0, 0.0, 1.0)
    for k in range(3):
        x = dot(apart, axes[k])
        beyond = abs(x) - half[k]
        sign = 1.0 if x >= 0.0 else -1.0
        if beyond > 0.0:
            region += (1 if x > 0.0 else 2) * 3**k
            outward = add(outward, scale(sign * beyond, axes[k]))
        if -beyond < exit_distance:
            exit_distance = -beyond
            exit_region = (1 if x >= 0.0 else 2) * 3**k
            exit_normal = scale(sign, axes[k])
    distance = norm(outward)
    if distance == 0.0:  # the centre is inside
        distance = -exit_distance
        region = exit_region
        normal = exit_normal
    else:
        normal = divide(outward, distance)
    return ball_on_surface(
        shapes,
        sphere,
        box,
        sphere_is_a,
        center,
        normal,
        distance,
        vertex_feature(1, region, 0),
        margin,
        buffer,
        count,
    )


# Contacts of two boxes: separating axes (15), then faces against each other or edge against edge.
#
# The axis of largest separation decides. A face of one box (the reference) meets the most opposed
# face of the other (incident). Seen along the normal they are a rectangle and a parallelogram.
# Their intersection has three kinds of corners: incident corners in the rectangle, reference
# corners in the parallelogram, crossings of edges. Of more than four points four are kept, so that
# the stiffness under a face does not depend on the orientation of the faces. Source: Gottschalk,
# Lin and Manocha, SIGGRAPH 1996 (the 15 axes).
#
# The gap of separated boxes is the largest separation over the axes: exact where a face or two
# edges face each other, elsewhere a lower bound of the distance.

# Two edges give no axis if the sine of their angle is below this. A face's axis is then as good to
# 1e-12 of the size, and the normalized cross product would carry rounding of 1e-16 / 1e-6.
PARALLEL_SINE = 1e-6
# Two edges decide only if they overlap less than the faces by this share: a face that rests on a
# face with a small tilt keeps its whole patch. The gap reported is then at most this share deeper
# than the true one.
EDGE_SHARE = 0.05
# They must also overlap less by this share of the boxes' size, the rounding of the separations.
ROUNDING_SHARE = 1e-12
# A face of b that is parallel to a's decides only if it overlaps less by this share of the boxes'
# size: two faces that rest on each other keep one normal, and the same points, while the boxes
# settle.
FACE_SHARE = 1e-4
FACES_COSINE = 0.9999


@kernel
def placed_box(shapes, shape, w):
    """Return centre, axes and half sizes of a box in the world."""
    return (
        world_center(shapes, shape, w),
        world_axes(shapes, shape, w),
        load(shapes.half_size, shape),
    )


@kernel
def boxes(shapes, a, b, w, margin, buffer, count):
    """Write the contacts (four at most) of two boxes."""
    A = placed_box(shapes, a, w)
    B = placed_box(shapes, b, w)
    apart = subtract(A[0], B[0])
    half_a = A[2]
    half_b = B[2]
    size = half_a[0] + half_a[1] + half_a[2] + half_b[0] + half_b[1] + half_b[2]
    if dot(apart, apart) > (size + margin) * (size + margin):
        return count
    face, of_a, best, most = _best_face(apart, A, B, FACE_SHARE * size)
    if most > margin:
        return count
    i, j, edge = _best_edges(apart, A, B)
    if edge > margin:
        return count
    if edge > most + EDGE_SHARE * abs(most) + ROUNDING_SHARE * size:
        return _edges(shapes, a, b, i, j, edge, A, B, buffer, count)
    if of_a:
        return clip_faces(shapes, a, b, True, face, best, A, B, margin, buffer, count)
    return clip_faces(shapes, b, a, False, face, best, B, A, margin, buffer, count)


@kernel
def _reach(box, n):
    """Return half the extent of a box along n."""
    _, axes, half = box
    return (
        half[0] * abs(dot(axes[0], n))
        + half[1] * abs(dot(axes[1], n))
        + half[2] * abs(dot(axes[2], n))
    )


@kernel
def _separation(apart, box, k, other):
    """Return the separation of two boxes along axis k of the first one."""
    axis = box[1][k]
    return abs(dot(apart, axis)) - box[2][k] - _reach(other, axis)


@kernel
def _best_face(apart, A, B, bias):
    """Return the face axis that decides, whether it is a's, its separation, and the largest
    separation of all faces.

    Along a face of b that is parallel to a's, the separation must exceed that along a's by the bias
    [m].
    """
    face = 0
    of_a = True
    best = -inf
    for k in range(3):
        separation = _separation(apart, A, k, B)
        if separation > best:
            face = k
            of_a = True
            best = separation
    most = best
    first = face
    for k in range(3):
        separation = _separation(apart, B, k, A)
        most = max(most, separation)
        lead = bias if of_a and abs(dot(A[1][first], B[1][k])) > FACES_COSINE else 0.0
        if separation > best + lead:
            face = k
            of_a = False
            best = separation
    return face, of_a, best, most


@kernel
def _best_edges(apart, A, B):
    """Return the edge directions i of a and j of b of largest separation on their common normal,
    and the separation."""
    best_i = best_j = 0
    best = -inf
    for i in range(3):
        for j in range(3):
            n = cross(A[1][i], B[1][j])
            length = norm(n)
            if length < PARALLEL_SINE:
                continue
            n = scale(1.0 / length, n)
            separation = abs(dot(apart, n)) - _reach(A, n) - _reach(B, n)
            if separation > best:
                best_i = i
                best_j = j
                best = separation
    return best_i, best_j, best


@kernel
def _edge_middle(box, k, n):
    """Return the middle of the edge along axis k that lies farthest in direction n, and its feature
    number."""
    point, axes, half = box
    number = 0
    for other in range(3):
        if other != k:
            positive = dot(axes[other], n) > 0.0
            point = add(point, scale(half[other] if positive else -half[other], axes[other]))
            number = 2 * number + (1 if positive else 0)
    return point, 4 * k + number


@kernel
def _edges(shapes, a, b, i, j, gap, A, B, buffer, count):
    """Write one contact midway between the closest points of two edges."""
    along = A[1][i]
    across = B[1][j]
    n = cross(along, across)
    n = scale(1.0 / norm(n), n)
    if dot(n, subtract(A[0], B[0])) < 0.0:
        n = scale(-1.0, n)
    x, edge_a = _edge_middle(A, i, scale(-1.0, n))
    y, edge_b = _edge_middle(B, j, n)
    # closest points x + s a_i, y + t b_j of two lines: (x - y + s a_i - t b_j) is orthogonal to a_i
    # and b_j
    cosine = dot(along, across)
    between = subtract(x, y)
    along_a = dot(between, along)
    along_b = dot(between, across)
    sine_square = 1.0 - cosine * cosine
    s = (cosine * along_b - along_a) / sine_square
    t = (along_b - cosine * along_a) / sine_square
    s = min(max(s, -A[2][i]), A[2][i])
    t = min(max(t, -B[2][j]), B[2][j])
    point = scale(0.5, add(add(x, scale(s, along)), add(y, scale(t, across))))
    return store_contact(
        shapes, a, b, True, vertex_feature(5, edge_a, edge_b), point, n, gap, buffer, count
    )


# Face against face of two boxes: the corners of their overlap as contacts. In the frame of the
# reference face (x, y along its sides, h the height over it) the incident face is c + α e1 + β e2
# with α, β in [-1, 1].
# of the faces' sizes: points closer than this are one corner; far above rounding, far below any sag
ALIGNED = 1e-9


@kernel
def clip_faces(
    shapes, ref, other, ref_is_a, face, separation, box, box_other, margin, buffer, count
):
    """Write the contacts over the reference face `face` of box `ref`; its outward normal m points
    to the other box."""
    center, axes, half = box
    center_other, axes_other, half_other = box_other
    apart = subtract(center_other, center)
    sign = 1.0 if dot(apart, axes[face]) >= 0.0 else -1.0
    u = axes[(face + 1) % 3]
    v = axes[(face + 2) % 3]
    m = scale(sign, axes[face])
    sides = (half[(face + 1) % 3], half[(face + 2) % 3])
    incident = 0
    opposed = 0.0
    for k in range(3):
        if abs(dot(axes_other[k], m)) > abs(opposed):
            incident = k
            opposed = dot(axes_other[k], m)
    side = -1.0 if opposed > 0.0 else 1.0
    k1 = (incident + 1) % 3
    k2 = (incident + 2) % 3
    middle = add(apart, scale(side * half_other[incident], axes_other[incident]))
    first = scale(half_other[k1], axes_other[k1])
    second = scale(half_other[k2], axes_other[k2])
    c = subtract(_along(middle, u, v, m), (0.0, 0.0, half[face]))
    e1 = _along(first, u, v, m)
    e2 = _along(second, u, v, m)
    faces = (2 * face + (1 if sign > 0.0 else 0)) * 6 + 2 * incident + (1 if side > 0.0 else 0)
    origin = add(center, scale(half[face], m))
    kind = 3 if ref_is_a else 4
    start = count
    deepest = (0.0, 0.0, 1e300)
    near = ALIGNED * (sides[0] + sides[1] + _extent(e1) + _extent(e2))
    for number in range(25):
        inside, corner = _corner_of_overlap(number, c, e1, e2, sides, near)
        if number < 4 and corner[2] < deepest[2]:
            deepest = corner
        # no overlap seen along the normal, or rounding at a corner: take the deepest corner
        if number == 24:
            inside = count == start
            x = deepest[0]
            y = deepest[1]
            corner = (
                min(max(x, -sides[0]), sides[0]),
                min(max(y, -sides[1]), sides[1]),
                separation,
            )
        x, y, h = corner
        if inside and h <= margin:
            point = add(add(origin, scale(0.5 * h, m)), add(scale(x, u), scale(y, v)))
            count = store_contact(
                shapes,
                other,
                ref,
                not ref_is_a,
                vertex_feature(kind, faces, number),
                point,
                m,
                h,
                buffer,
                count,
            )
    return keep_widest(buffer, start, count, m) if count - start > BOX_PAIR_CONTACTS else count


@kernel
def _along(a, x, y, z):
    """Return the components of a along three axes."""
    return (dot(a, x), dot(a, y), dot(a, z))


@kernel
def _corner_of_overlap(number, c, e1, e2, sides, near):
    """Return whether candidate `number` is a corner of the overlap, and its (x, y, h).

    0-3 incident corners in the rectangle, 4-7 reference corners in the parallelogram, 8-23
    crossings of two edges. What lies within a multiple of `near` [m] of a border, as rounding has
    it where edges are aligned, is a corner once: an incident one if it can be, else a reference
    one. Faces that coincide thus give four points.
    """
    first = 1.0 - 2.0 * (number & 1)
    second = 1.0 - (number & 2)
    if number < 4:
        corner = add(add(c, scale(first, e1)), scale(second, e2))
        return abs(corner[0]) <= sides[0] + 4.0 * near and abs(corner[1]) <= sides[
            1
        ] + 4.0 * near, corner
    if number < 8:
        x = first * sides[0]
        y = second * sides[1]
        area = e1[0] * e2[1] - e1[1] * e2[0]
        if area == 0.0:
            return False, c
        alpha = ((x - c[0]) * e2[1] - (y - c[1]) * e2[0]) / area
        beta = (e1[0] * (y - c[1]) - e1[1] * (x - c[0])) / area
        beyond = (abs(alpha) - 1.0) * _extent(e1)
        over = (abs(beta) - 1.0) * _extent(e2)
        inside = max(beyond, over) <= 2.0 * near and min(beyond, over) < -2.0 * near
        return inside, (x, y, c[2] + alpha * e1[2] + beta * e2[2])
    # the edge c + first·e1 + β e2, β in (-1, 1), or c + first·e2 + α e1
    start, e = (add(c, scale(first, e1)), e2) if number & 4 else (add(c, scale(first, e2)), e1)
    k = 0 if number & 8 else 1  # with the side x = ± sides[0] of the rectangle, or y = ± sides[1]
    if abs(e[k]) <= near:
        return False, c
    t = (second * sides[k] - start[k]) / e[k]
    along = second * sides[k]
    across = start[1 - k] + t * e[1 - k]
    h = start[2] + t * e[2]
    crosses = (abs(t) - 1.0) * _extent(e) < -near and abs(across) < sides[1 - k] - near
    return crosses, (along, across, h) if k == 0 else (across, along, h)


@kernel
def _extent(e):
    """Return the larger coordinate of an edge in the face."""
    return max(abs(e[0]), abs(e[1]))


@kernel
def keep_widest(buffer, start, count, m):
    """Keep four of the contacts from row `start` on; return the new count.

    They are the deepest, the one farthest from it, and the two that span the largest triangles with
    both, one on each side.
    """
    if count == len(buffer.gap):
        return -1
    chosen = start
    for i in range(start + 1, count):
        if buffer.gap[i] < buffer.gap[chosen]:
            chosen = i
    _swap(buffer, start, chosen, count)
    x = load(buffer.point, start)
    chosen = start + 1
    best = -1.0
    for i in range(start + 1, count):
        arm = subtract(load(buffer.point, i), x)
        if dot(arm, arm) > best:
            chosen = i
            best = dot(arm, arm)
    _swap(buffer, start + 1, chosen, count)
    line = cross(m, subtract(load(buffer.point, start + 1), x))
    for rank, side in ((start + 2, 1.0), (start + 3, -1.0)):
        chosen = rank
        best = -1.0e300
        for i in range(rank, count):
            reach = side * dot(line, subtract(load(buffer.point, i), x))
            if reach > best:
                chosen = i
                best = reach
        _swap(buffer, rank, chosen, count)
    return start + BOX_PAIR_CONTACTS


@kernel
def _swap(buffer, i, j, spare):
    """Exchange the geometry of rows i and j, with a row to spare."""
    copy_geometry(buffer, spare, buffer, i)
    copy_geometry(buffer, i, buffer, j)
    copy_geometry(buffer, j, buffer, spare)

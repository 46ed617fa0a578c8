"""Contacts of spatial shapes: spheres, half-spaces and boxes.

Conventions are those of the plane: the normal points from b into a, gap < 0 is overlap, the point lies midway between
the surfaces, and a contact is kept if gap <= margin. Every normal has unit length, also where centres coincide.
"""

from __future__ import annotations

import math

from iapb.compiled import kernel
from iapb.contact.geometry import BOX, HALF_SPACE, SPHERE
from iapb.contact.kernels.shape_frames import (
    copy_contact,
    store_in_space,
    vertex_feature,
    world_axis,
    world_center,
)
from iapb.linalg import add, cross, dot, load, scale, subtract


@kernel(needs="space", otherwise=0)
def spatial_pair(shapes, a, b, R, p, margin, buffer, count):
    """Write the contacts of two spatial shapes; a half-space is always b."""
    kind_a, kind_b = shapes.kind[a], shapes.kind[b]
    if kind_b == HALF_SPACE:
        if kind_a == SPHERE:
            return sphere_half_space(shapes, a, b, R, p, margin, buffer, count)
        return box_half_space(shapes, a, b, R, p, margin, buffer, count)
    if kind_a == BOX and kind_b == BOX:
        return boxes(shapes, a, b, R, p, margin, buffer, count)
    if kind_a == SPHERE and kind_b == SPHERE:
        return spheres(shapes, a, b, R, p, margin, buffer, count)
    if kind_a == SPHERE:
        return sphere_box(shapes, a, b, True, R, p, margin, buffer, count)
    return sphere_box(shapes, b, a, False, R, p, margin, buffer, count)


@kernel
def spheres(shapes, a, b, R, p, margin, buffer, count):
    """Write the contact of two spheres: gap = distance of centres - both radii; normal ±z if the centres coincide."""
    center_b = world_center(shapes, b, R, p)
    apart = subtract(world_center(shapes, a, R, p), center_b)
    radius_a, radius_b = shapes.radius[a], shapes.radius[b]
    distance = math.sqrt(dot(apart, apart))
    gap = distance - (radius_a + radius_b)
    if gap > margin:
        return count
    normal = (0.0, 0.0, 1.0 if a < b else -1.0)
    if distance > 0.0:
        normal = (apart[0] / distance, apart[1] / distance, apart[2] / distance)
    point = add(center_b, scale(0.5 * (distance + radius_b - radius_a), normal))
    return store_in_space(buffer, count, shapes, a, b, 0, point, normal, gap)


@kernel
def sphere_half_space(shapes, a, b, R, p, margin, buffer, count):
    """Write the contact of a sphere and a half-space: gap = (centre - point)·normal - radius."""
    normal, center = world_axis(shapes, b, 2, R), world_center(shapes, a, R, p)
    radius = shapes.radius[a]
    gap = dot(subtract(center, world_center(shapes, b, R, p)), normal) - radius
    if gap > margin:
        return count
    point = subtract(center, scale(radius + 0.5 * gap, normal))
    return store_in_space(buffer, count, shapes, a, b, 0, point, normal, gap)


@kernel
def box_half_space(shapes, a, b, R, p, margin, buffer, count):
    """Write one contact per corner of the box: gap = (corner - point)·normal."""
    normal, center = world_axis(shapes, b, 2, R), world_center(shapes, a, R, p)
    height = dot(subtract(center, world_center(shapes, b, R, p)), normal)
    x = scale(shapes.half_size[a, 0], world_axis(shapes, a, 0, R))
    y = scale(shapes.half_size[a, 1], world_axis(shapes, a, 1, R))
    z = scale(shapes.half_size[a, 2], world_axis(shapes, a, 2, R))
    over_x, over_y, over_z = dot(x, normal), dot(y, normal), dot(z, normal)
    for corner in range(8):
        sx, sy, sz = 1.0 - 2.0 * (corner & 1), 1.0 - (corner & 2), 1.0 - 0.5 * (corner & 4)
        gap = height + (sx * over_x + (sy * over_y + sz * over_z))
        if gap <= margin:
            arm = add(scale(sx, x), add(scale(sy, y), scale(sz, z)))
            point = subtract(add(center, arm), scale(0.5 * gap, normal))
            count = store_in_space(buffer, count, shapes, a, b, vertex_feature(0, corner, 0), point, normal, gap)
            if count < 0:
                return -1
    return count


@kernel
def sphere_box(shapes, sphere, box, sphere_is_a, R, p, margin, buffer, count):
    """Write the contact of a sphere and a box, at the box's nearest point, or nearest face for a centre inside."""
    center = world_center(shapes, sphere, R, p)
    apart = subtract(center, world_center(shapes, box, R, p))
    half, radius = load(shapes.half_size, box), shapes.radius[sphere]
    reach = half[0] + half[1] + half[2] + radius + margin
    if dot(apart, apart) > reach * reach:
        return count
    axes = (world_axis(shapes, box, 0, R), world_axis(shapes, box, 1, R), world_axis(shapes, box, 2, R))
    region, outward = 0, (0.0, 0.0, 0.0)
    exit_distance, exit_region, exit_normal = math.inf, 0, (0.0, 0.0, 1.0)
    for k in range(3):
        x = dot(apart, axes[k])
        beyond = abs(x) - half[k]
        sign = 1.0 if x >= 0.0 else -1.0
        if beyond > 0.0:
            region += (1 if x > 0.0 else 2) * 3**k
            outward = add(outward, scale(sign * beyond, axes[k]))
        if -beyond < exit_distance:
            exit_distance, exit_region = -beyond, (1 if x >= 0.0 else 2) * 3**k
            exit_normal = scale(sign, axes[k])
    distance = math.sqrt(dot(outward, outward))
    if distance == 0.0:  # the centre is inside
        distance, region, normal = -exit_distance, exit_region, exit_normal
    else:
        normal = (outward[0] / distance, outward[1] / distance, outward[2] / distance)
    gap = distance - radius
    if gap > margin:
        return count
    point = subtract(center, scale(radius + 0.5 * gap, normal))
    feature = vertex_feature(1, region, 0)
    if sphere_is_a:
        return store_in_space(buffer, count, shapes, sphere, box, feature, point, normal, gap)
    return store_in_space(buffer, count, shapes, box, sphere, feature, point, scale(-1.0, normal), gap)


# Contacts of two boxes: separating axes (15), then faces against each other or edge against edge.
#
# The axis of largest separation decides. A face of one box (the reference) meets the most opposed face of the other
# (incident). Seen along the normal they are a rectangle and a parallelogram. Their intersection has three kinds of
# corners: incident corners in the rectangle, reference corners in the parallelogram, crossings of edges. Of more than
# four points four are kept, so that the stiffness under a face does not depend on the orientation of the faces. Source:
# Gottschalk, Lin and Manocha, SIGGRAPH 1996 (the 15 axes).
#
# The gap of separated boxes is the largest separation over the axes: exact where a face or two edges face each other,
# elsewhere a lower bound of the distance.

# Two edges give no axis if the sine of their angle is below this. A face's axis is then as good to 1e-12 of the size,
# and the normalized cross product would carry rounding of 1e-16 / 1e-6.
PARALLEL_SINE = 1e-6
# Two edges decide only if they overlap less than the faces by this share: a face that rests on a face with a small tilt
# keeps its whole patch. The gap reported is then at most this share deeper than the true one.
EDGE_SHARE = 0.05
# They must also overlap less by this share of the boxes' size, the rounding of the separations.
ROUNDING_SHARE = 1e-12
# A face of b that is parallel to a's decides only if it overlaps less by this share of the boxes' size: two faces that
# rest on each other keep one normal, and the same points, while the boxes settle.
FACE_SHARE, FACES_COSINE = 1e-4, 0.9999


@kernel
def boxes(shapes, a, b, R, p, margin, buffer, count):
    """Write the contacts (four at most) of two boxes."""
    center_a, center_b = world_center(shapes, a, R, p), world_center(shapes, b, R, p)
    apart = subtract(center_a, center_b)
    A = (world_axis(shapes, a, 0, R), world_axis(shapes, a, 1, R), world_axis(shapes, a, 2, R))
    B = (world_axis(shapes, b, 0, R), world_axis(shapes, b, 1, R), world_axis(shapes, b, 2, R))
    half_a = (shapes.half_size[a, 0], shapes.half_size[a, 1], shapes.half_size[a, 2])
    half_b = (shapes.half_size[b, 0], shapes.half_size[b, 1], shapes.half_size[b, 2])
    size = half_a[0] + half_a[1] + half_a[2] + half_b[0] + half_b[1] + half_b[2]
    if dot(apart, apart) > (size + margin) * (size + margin):
        return count
    face, of_a, best, most = _best_face(apart, A, B, half_a, half_b, FACE_SHARE * size)
    if most > margin:
        return count
    i, j, edge = _best_edges(apart, A, B, half_a, half_b)
    if edge > margin:
        return count
    if edge > most + EDGE_SHARE * abs(most) + ROUNDING_SHARE * size:
        return _edges(shapes, a, b, i, j, edge, center_a, center_b, A, B, half_a, half_b, buffer, count)
    if of_a:
        return clip_faces(shapes, a, b, True, face, best, center_a, center_b, A, B, half_a, half_b, margin, buffer,
                          count)
    return clip_faces(shapes, b, a, False, face, best, center_b, center_a, B, A, half_b, half_a, margin, buffer,
                      count)


@kernel
def _reach(axes, half, n):
    """Return half the extent of a box along n."""
    return half[0] * abs(dot(axes[0], n)) + half[1] * abs(dot(axes[1], n)) + half[2] * abs(dot(axes[2], n))


@kernel
def _best_face(apart, A, B, half_a, half_b, bias):
    """Return the face axis that decides, whether it is a's, its separation, and the largest separation of all faces.

    Along a face of b that is parallel to a's, the separation must exceed that along a's by the bias [m].
    """
    face, of_a, best = 0, True, -math.inf
    for k in range(3):
        separation = abs(dot(apart, A[k])) - half_a[k] - _reach(B, half_b, A[k])
        if separation > best:
            face, of_a, best = k, True, separation
    most, first = best, face
    for k in range(3):
        separation = abs(dot(apart, B[k])) - half_b[k] - _reach(A, half_a, B[k])
        most = max(most, separation)
        lead = bias if of_a and abs(dot(A[first], B[k])) > FACES_COSINE else 0.0
        if separation > best + lead:
            face, of_a, best = k, False, separation
    return face, of_a, best, most


@kernel
def _best_edges(apart, A, B, half_a, half_b):
    """Return the edge directions i of a and j of b of largest separation on their common normal, and the separation."""
    best_i, best_j, best = 0, 0, -math.inf
    for i in range(3):
        for j in range(3):
            n = cross(A[i], B[j])
            length = math.sqrt(dot(n, n))
            if length < PARALLEL_SINE:
                continue
            n = scale(1.0 / length, n)
            separation = abs(dot(apart, n)) - _reach(A, half_a, n) - _reach(B, half_b, n)
            if separation > best:
                best_i, best_j, best = i, j, separation
    return best_i, best_j, best


@kernel
def _edge_middle(center, axes, half, k, n):
    """Return the middle of the edge along axis k that lies farthest in direction n, and its feature number."""
    point, number = center, 0
    for other in range(3):
        if other != k:
            positive = dot(axes[other], n) > 0.0
            point = add(point, scale(half[other] if positive else -half[other], axes[other]))
            number = 2 * number + (1 if positive else 0)
    return point, 4 * k + number


@kernel
def _edges(shapes, a, b, i, j, gap, center_a, center_b, A, B, half_a, half_b, buffer, count):
    """Write one contact midway between the closest points of two edges."""
    n = cross(A[i], B[j])
    n = scale(1.0 / math.sqrt(dot(n, n)), n)
    if dot(n, subtract(center_a, center_b)) < 0.0:
        n = scale(-1.0, n)
    x, edge_a = _edge_middle(center_a, A, half_a, i, scale(-1.0, n))
    y, edge_b = _edge_middle(center_b, B, half_b, j, n)
    # closest points x + s a_i, y + t b_j of two lines: (x - y + s a_i - t b_j) is orthogonal to a_i and b_j
    cosine, between = dot(A[i], B[j]), subtract(x, y)
    along_a, along_b = dot(between, A[i]), dot(between, B[j])
    sine_square = 1.0 - cosine * cosine
    s = (cosine * along_b - along_a) / sine_square
    t = (along_b - cosine * along_a) / sine_square
    s, t = min(max(s, -half_a[i]), half_a[i]), min(max(t, -half_b[j]), half_b[j])
    point = scale(0.5, add(add(x, scale(s, A[i])), add(y, scale(t, B[j]))))
    return store_in_space(buffer, count, shapes, a, b, vertex_feature(5, edge_a, edge_b), point, n, gap)


# Face against face of two boxes: the corners of their overlap as contacts, four at most.
#
# In the frame of the reference face (x, y along its sides, h the height over it) the incident face is
# c + α e1 + β e2 with α, β in [-1, 1].


MOST_POINTS = 4  # of a face on a face: the corners of a large quadrilateral carry any load between them


@kernel
def clip_faces(shapes, ref, other, ref_is_a, face, separation, center, center_other, axes, axes_other, half,
               half_other, margin, buffer, count):
    """Write the contacts over the reference face `face` of box `ref`; its outward normal m points to the other box."""
    apart = subtract(center_other, center)
    sign = 1.0 if dot(apart, axes[face]) >= 0.0 else -1.0
    m = scale(sign, axes[face])
    u, v = axes[(face + 1) % 3], axes[(face + 2) % 3]
    hu, hv = half[(face + 1) % 3], half[(face + 2) % 3]
    incident, opposed = 0, 0.0
    for k in range(3):
        if abs(dot(axes_other[k], m)) > abs(opposed):
            incident, opposed = k, dot(axes_other[k], m)
    side = -1.0 if opposed > 0.0 else 1.0
    k1, k2 = (incident + 1) % 3, (incident + 2) % 3
    middle = add(apart, scale(side * half_other[incident], axes_other[incident]))
    first, second = scale(half_other[k1], axes_other[k1]), scale(half_other[k2], axes_other[k2])
    cx, cy, ch = dot(middle, u), dot(middle, v), dot(middle, m) - half[face]
    ax, ay, ah = dot(first, u), dot(first, v), dot(first, m)
    bx, by, bh = dot(second, u), dot(second, v), dot(second, m)
    faces = (2 * face + (1 if sign > 0.0 else 0)) * 6 + 2 * incident + (1 if side > 0.0 else 0)
    origin = add(center, scale(half[face], m))
    normal, a, b = (scale(-1.0, m), ref, other) if ref_is_a else (m, other, ref)
    kind, start = 3 if ref_is_a else 4, count
    deepest_x, deepest_y, deepest = 0.0, 0.0, 1e300
    for number in range(24):
        inside, x, y, h = _corner_of_overlap(number, cx, cy, ch, ax, ay, ah, bx, by, bh, hu, hv)
        if number < 4 and h < deepest:
            deepest_x, deepest_y, deepest = x, y, h
        if inside and h <= margin:
            point = add(add(origin, scale(0.5 * h, m)), add(scale(x, u), scale(y, v)))
            count = store_in_space(buffer, count, shapes, a, b, vertex_feature(kind, faces, number), point, normal, h)
            if count < 0:
                return -1
    if count == start:  # no overlap seen along the normal, or rounding at a corner: take the deepest corner
        x, y = min(max(deepest_x, -hu), hu), min(max(deepest_y, -hv), hv)
        point = add(add(origin, scale(0.5 * separation, m)), add(scale(x, u), scale(y, v)))
        return store_in_space(buffer, count, shapes, a, b, vertex_feature(kind, faces, 24), point, normal, separation)
    return keep_widest(buffer, start, count, m) if count - start > MOST_POINTS else count


@kernel
def _corner_of_overlap(number, cx, cy, ch, ax, ay, ah, bx, by, bh, hu, hv):
    """Return candidate corner `number` of the overlap: (whether it is a corner, x, y, h).

    0-3 incident corners in the rectangle (its border included), 4-7 reference corners strictly inside the
    parallelogram, 8-23 crossings strictly inside both edges. Faces that coincide thus give four points.
    """
    first, second = 1.0 - 2.0 * (number & 1), 1.0 - (number & 2)
    if number < 4:
        x, y = cx + first * ax + second * bx, cy + first * ay + second * by
        return abs(x) <= hu and abs(y) <= hv, x, y, ch + first * ah + second * bh
    if number < 8:
        x, y = first * hu, second * hv
        area = ax * by - ay * bx
        if area == 0.0:
            return False, x, y, 0.0
        alpha = ((x - cx) * by - (y - cy) * bx) / area
        beta = (ax * (y - cy) - ay * (x - cx)) / area
        return abs(alpha) < 1.0 and abs(beta) < 1.0, x, y, ch + alpha * ah + beta * bh
    if number & 4:  # the edge c + first·e1 + β e2, β in (-1, 1); else c + first·e2 + α e1
        px, py, ph, ex, ey, eh = cx + first * ax, cy + first * ay, ch + first * ah, bx, by, bh
    else:
        px, py, ph, ex, ey, eh = cx + first * bx, cy + first * by, ch + first * bh, ax, ay, ah
    if number & 8:  # with the side x = second·hu of the rectangle; else y = second·hv
        if ex == 0.0:
            return False, px, py, ph
        t = (second * hu - px) / ex
        return abs(t) < 1.0 and abs(py + t * ey) < hv, second * hu, py + t * ey, ph + t * eh
    if ey == 0.0:
        return False, px, py, ph
    t = (second * hv - py) / ey
    return abs(t) < 1.0 and abs(px + t * ex) < hu, px + t * ex, second * hv, ph + t * eh


@kernel
def keep_widest(buffer, start, count, m):
    """Keep four of the contacts from row `start` on: the deepest, the one farthest from it, and the two that
    span the largest triangles with both, one on each side. Return the new count."""
    _swap_in(buffer, start, _extreme_gap(buffer, start, count))
    x = load(buffer.point, start)
    farthest, best = start + 1, -1.0
    for i in range(start + 1, count):
        arm = subtract(load(buffer.point, i), x)
        if dot(arm, arm) > best:
            farthest, best = i, dot(arm, arm)
    _swap_in(buffer, start + 1, farthest)
    line = cross(m, subtract(load(buffer.point, start + 1), x))
    for rank, side in ((start + 2, 1.0), (start + 3, -1.0)):
        chosen, best = rank, -1.0e300
        for i in range(rank, count):
            reach = side * dot(line, subtract(load(buffer.point, i), x))
            if reach > best:
                chosen, best = i, reach
        _swap_in(buffer, rank, chosen)
    return start + MOST_POINTS


@kernel
def _extreme_gap(buffer, start, count):
    deepest = start
    for i in range(start + 1, count):
        if buffer.gap[i] < buffer.gap[deepest]:
            deepest = i
    return deepest


@kernel
def _swap_in(buffer, target, source):
    """Exchange the geometry of two rows."""
    if target == source:
        return
    a, b, feature, gap = buffer.shape_a[target], buffer.shape_b[target], buffer.feature[target], buffer.gap[target]
    body_a, body_b = buffer.body_a[target], buffer.body_b[target]
    point, normal = load(buffer.point, target), load(buffer.normal, target)
    copy_contact(buffer, target, buffer, source)
    buffer.shape_a[source], buffer.shape_b[source] = a, b
    buffer.body_a[source], buffer.body_b[source] = body_a, body_b
    buffer.feature[source], buffer.gap[source] = feature, gap
    for axis in range(3):
        buffer.point[source, axis], buffer.normal[source, axis] = point[axis], normal[axis]

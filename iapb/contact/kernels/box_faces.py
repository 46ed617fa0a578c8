"""Face against face of two boxes: the corners of their overlap as contacts, four at most.

In the frame of the reference face (x, y along its sides, h the height over it) the incident face is
c + α e1 + β e2 with α, β in [-1, 1].
"""

from __future__ import annotations

from iapb.compiled import kernel
from iapb.contact.kernels.shape_frames import vertex_feature
from iapb.contact.kernels.spatial_frames import copy_contact, store_in_space
from iapb.mechanics.kernels.vectors import add, cross, dot, load, scale, subtract

MOST_POINTS = 4  # of a face on a face: the corners of the largest quadrilateral carry any load in between


@kernel
def clip_faces(shapes, ref, other, ref_is_a, face, separation, center, center_other, axes, axes_other, half,
               half_other, margin, buffer, count):
    """Contacts over the reference face `face` of box `ref`; its outward normal m points towards the other box."""
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
    if count == start:  # apart sideways, or rounding at a corner: the deepest corner, at the axes' separation
        x, y = min(max(deepest_x, -hu), hu), min(max(deepest_y, -hv), hv)
        point = add(add(origin, scale(0.5 * separation, m)), add(scale(x, u), scale(y, v)))
        return store_in_space(buffer, count, shapes, a, b, vertex_feature(kind, faces, 24), point, normal, separation)
    return keep_widest(buffer, start, count, m) if count - start > MOST_POINTS else count


@kernel
def _corner_of_overlap(number, cx, cy, ch, ax, ay, ah, bx, by, bh, hu, hv):
    """Candidate corner `number` of the overlap: (is it one?, x, y, h).

    0-3 incident corners in the rectangle (its border included), 4-7 reference corners strictly inside the
    parallelogram, 8-23 crossings strictly inside both edges: so that faces that coincide give four points.
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
    """Exchange two rows; a row that is not kept may be lost, so the last row of the buffer is not needed."""
    if target == source:
        return
    a, b, feature, gap = buffer.shape_a[target], buffer.shape_b[target], buffer.feature[target], buffer.gap[target]
    body_a, body_b = buffer.body_a[target], buffer.body_b[target]
    point, normal = load(buffer.point, target), load(buffer.normal, target)
    copy_contact(buffer, target, source)
    buffer.shape_a[source], buffer.shape_b[source] = a, b
    buffer.body_a[source], buffer.body_b[source] = body_a, body_b
    buffer.feature[source], buffer.gap[source] = feature, gap
    for axis in range(3):
        buffer.point[source, axis], buffer.normal[source, axis] = point[axis], normal[axis]

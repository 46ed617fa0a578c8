"""Contacts of two boxes: separating axes (15), then faces against each other or edge against edge.

The axis of largest separation decides. A face of one box (the reference) meets the most opposed face of the
other (incident): seen along the normal a rectangle and a parallelogram, whose intersection has three kinds of
corners, each found without a list: incident corners in the rectangle, reference corners in the parallelogram,
crossings of edges. Of more than four points four stay, so that the stiffness under a face does not depend on
how the faces are turned. Source: Gottschalk, Lin and Manocha, SIGGRAPH 1996 (the 15 axes).

The gap of boxes apart is the largest separation over the axes: exact where a face or two edges face each other,
elsewhere a lower bound of the distance.
"""

from __future__ import annotations

import math

from iapb.compiled import kernel
from iapb.contact.kernels.box_faces import clip_faces
from iapb.contact.kernels.shape_frames import vertex_feature
from iapb.contact.kernels.spatial_frames import store_in_space, world_axis, world_center
from iapb.mechanics.kernels.vectors import add, cross, dot, scale, subtract

# Edges whose directions differ by a sine below this have no axis of their own: a face's axis is as good to 1e-12
# of the size, and the normalized cross product would carry rounding of 1e-16 / 1e-6.
PARALLEL_SINE = 1e-6
# Two edges decide only where they overlap less than faces do by this share: a face that rests on a face, tilted by
# a hair, keeps its whole patch. The gap reported is then at most this share deeper than the true one.
EDGE_SHARE = 0.05
# ... and by this share of the boxes' size, the rounding of the separations.
ROUNDING_SHARE = 1e-12


@kernel
def boxes(shapes, a, b, R, p, margin, buffer, count):
    """Contacts (four at most) of two boxes."""
    center_a, center_b = world_center(shapes, a, R, p), world_center(shapes, b, R, p)
    apart = subtract(center_a, center_b)
    A = (world_axis(shapes, a, 0, R), world_axis(shapes, a, 1, R), world_axis(shapes, a, 2, R))
    B = (world_axis(shapes, b, 0, R), world_axis(shapes, b, 1, R), world_axis(shapes, b, 2, R))
    half_a = (shapes.half_size[a, 0], shapes.half_size[a, 1], shapes.half_size[a, 2])
    half_b = (shapes.half_size[b, 0], shapes.half_size[b, 1], shapes.half_size[b, 2])
    size = half_a[0] + half_a[1] + half_a[2] + half_b[0] + half_b[1] + half_b[2]
    if dot(apart, apart) > (size + margin) * (size + margin):
        return count
    face, of_a, best = _best_face(apart, A, B, half_a, half_b)
    if best > margin:
        return count
    i, j, edge = _best_edges(apart, A, B, half_a, half_b)
    if edge > margin:
        return count
    if edge > best + EDGE_SHARE * abs(best) + ROUNDING_SHARE * size:
        return _edges(shapes, a, b, i, j, edge, center_a, center_b, A, B, half_a, half_b, buffer, count)
    if of_a:
        return clip_faces(shapes, a, b, True, face, best, center_a, center_b, A, B, half_a, half_b, margin, buffer,
                          count)
    return clip_faces(shapes, b, a, False, face, best, center_b, center_a, B, A, half_b, half_a, margin, buffer,
                      count)


@kernel
def _reach(axes, half, n):
    """Half the extent of a box along n."""
    return half[0] * abs(dot(axes[0], n)) + half[1] * abs(dot(axes[1], n)) + half[2] * abs(dot(axes[2], n))


@kernel
def _best_face(apart, A, B, half_a, half_b):
    """Face axis of largest separation, whether it is a's, and the separation. Ties go to a, then to the first."""
    face, of_a, best = 0, True, -math.inf
    for k in range(3):
        separation = abs(dot(apart, A[k])) - half_a[k] - _reach(B, half_b, A[k])
        if separation > best:
            face, of_a, best = k, True, separation
    for k in range(3):
        separation = abs(dot(apart, B[k])) - half_b[k] - _reach(A, half_a, B[k])
        if separation > best:
            face, of_a, best = k, False, separation
    return face, of_a, best


@kernel
def _best_edges(apart, A, B, half_a, half_b):
    """Edge directions i of a and j of b with the largest separation along their common normal."""
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
    """Middle of the edge along axis k that lies farthest in direction n, and its number among the four."""
    point, number = center, 0
    for other in range(3):
        if other != k:
            positive = dot(axes[other], n) > 0.0
            point = add(point, scale(half[other] if positive else -half[other], axes[other]))
            number = 2 * number + (1 if positive else 0)
    return point, 4 * k + number


@kernel
def _edges(shapes, a, b, i, j, gap, center_a, center_b, A, B, half_a, half_b, buffer, count):
    """One contact midway between the closest points of two edges."""
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

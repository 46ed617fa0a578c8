"""Contacts of two convex polygons: separating axes, clipping, and closest corners when they are apart.

The axis of largest separation s picks a reference edge; the other polygon's most opposed edge is clipped to
the strip over it, which leaves at most two points. Overlapping polygons always have the deepest vertex inside
that strip: the point of a Minkowski difference's boundary nearest to an interior point lies within an edge.
Polygons apart may be closest at two corners instead; then the contact is that one pair of points.
"""

from __future__ import annotations

import math

from iapb.compiled import kernel
from iapb.contact.kernels.shape_frames import relative_frame, store, to_world, turn_to_world, vertex_feature

# The lowest point over the reference edge may lie above the separation s by this share of the size of the
# numbers it was computed from before the polygons count as closest elsewhere: two dozen operations round to
# below 1e-14, and 1e-12 of the shapes' size is far below any geometry's accuracy.
ROUNDING_SHARE = 1e-12


@kernel
def polygons(shapes, a, b, R, p, margin, buffer, count):
    """Contacts (two at most) of convex polygons a and b; see the module for the method."""
    separation_a, edge_a = best_edge(shapes, a, b, R, p, margin)
    if separation_a > margin:
        return count
    separation_b, edge_b = best_edge(shapes, b, a, R, p, margin)
    if separation_b > margin:
        return count
    if separation_b >= separation_a:
        return _against_reference(shapes, b, a, edge_b, separation_b, True, R, p, margin, buffer, count)
    return _against_reference(shapes, a, b, edge_a, separation_a, False, R, p, margin, buffer, count)


@kernel
def best_edge(shapes, onto, other, R, p, margin):
    """Largest separation over the edge normals of `onto`, and its edge; early out above the margin.

    separation of an edge = min over the vertices w of `other` of n·(w - v), n its outward normal, v its start
    """
    Qxx, Qxy, Qyx, Qyy, tx, ty = relative_frame(shapes, onto, other, R, p)
    first, count = shapes.first[onto], shapes.count[onto]
    first_other, count_other = shapes.first[other], shapes.count[other]
    best, edge = -math.inf, 0
    for i in range(count):
        ux, uy, nx, ny, _ = edge_frame(shapes, first, count, i)
        mx, my = Qxx * nx + Qyx * ny, Qxy * nx + Qyy * ny  # the normal in the other's frame
        lowest = math.inf
        for k in range(first_other, first_other + count_other):
            lowest = min(lowest, mx * shapes.vertices[k, 0] + my * shapes.vertices[k, 1])
        separation = lowest + nx * (tx - ux) + ny * (ty - uy)
        if separation > best:
            best, edge = separation, i
            if best > margin:
                return best, edge
    return best, edge


@kernel
def edge_frame(shapes, first, count, edge):
    """Start (x, y), outward unit normal (x, y) and length of an edge, in the polygon's frame."""
    following = edge + 1 if edge + 1 < count else 0
    ux, uy = shapes.vertices[first + edge, 0], shapes.vertices[first + edge, 1]
    ex, ey = shapes.vertices[first + following, 0] - ux, shapes.vertices[first + following, 1] - uy
    length = math.sqrt(ex * ex + ey * ey)
    return ux, uy, ey / length, -ex / length, length


@kernel
def opposed_edge(shapes, other, mx, my):
    """Edge of `other` whose outward normal is most opposed to (mx, my), given in its frame."""
    first, count = shapes.first[other], shapes.count[other]
    best, edge = math.inf, 0
    for i in range(count):
        _, _, nx, ny, _ = edge_frame(shapes, first, count, i)
        if nx * mx + ny * my < best:
            best, edge = nx * mx + ny * my, i
    return edge


@kernel
def _against_reference(shapes, ref, other, edge, separation, ref_is_b, R, p, margin, buffer, count):
    """Contacts over the reference edge, or between two corners when the polygons are closest there."""
    Qxx, Qxy, Qyx, Qyy, tx, ty = relative_frame(shapes, ref, other, R, p)
    ux, uy, nx, ny, length = edge_frame(shapes, shapes.first[ref], shapes.count[ref], edge)
    incident = opposed_edge(shapes, other, Qxx * nx + Qyx * ny, Qxy * nx + Qyy * ny)
    following = incident + 1 if incident + 1 < shapes.count[other] else 0
    s0, h0 = over_edge(shapes, shapes.first[other] + incident, Qxx, Qxy, Qyx, Qyy, tx - ux, ty - uy, nx, ny)
    s1, h1 = over_edge(shapes, shapes.first[other] + following, Qxx, Qxy, Qyx, Qyy, tx - ux, ty - uy, nx, ny)

    size = length + abs(tx) + abs(ty) + abs(ux) + abs(uy)
    missed = s0 < 0.0 or s1 > length  # s0 >= s1: the incident edge runs against the reference edge
    start_s, start_h = (s0, h0) if s0 <= length else (length, height_at(length, s0, h0, s1, h1))
    end_s, end_h = (s1, h1) if s1 >= 0.0 else (0.0, height_at(0.0, s0, h0, s1, h1))
    if missed or min(start_h, end_h) - separation > ROUNDING_SHARE * size:
        if separation > 0.0:
            return _corners(shapes, ref, other, ref_is_b, R, p, margin, buffer, count)
        # Overlapping: only rounding can put the deepest vertex outside the strip. Take it as it is.
        start_s, start_h = (s0, separation) if h0 < h1 else (s1, separation)
        end_h = math.inf

    side, opposite = (0, 1) if ref_is_b else (1, 0)  # whose vertex touches: the incident or the reference one
    for s, h, vertex, corner, cut in (
        (start_s, start_h, incident, edge + 1, s0 > length),
        (end_s, end_h, following, edge, s1 < 0.0),
    ):
        if h > margin:
            continue
        feature = vertex_feature(side, vertex, edge)
        if cut:
            corner = corner if corner < shapes.count[ref] else 0
            feature = vertex_feature(opposite, corner, incident)
        x, y = ux - ny * s + 0.5 * h * nx, uy + nx * s + 0.5 * h * ny
        count = _store_from(shapes, ref, other, ref_is_b, feature, x, y, nx, ny, h, R, p, buffer, count)
        if count < 0:
            return -1
    return count


@kernel
def over_edge(shapes, row, Qxx, Qxy, Qyx, Qyy, tx, ty, nx, ny):
    """Coordinates of a vertex over the reference edge: s along it from its start, h along its normal."""
    x, y = shapes.vertices[row, 0], shapes.vertices[row, 1]
    x, y = Qxx * x + Qxy * y + tx, Qyx * x + Qyy * y + ty
    return -ny * x + nx * y, nx * x + ny * y


@kernel
def height_at(s, s0, h0, s1, h1):
    """Height over the point s of the line through (s0, h0) and (s1, h1); h0 if that line is upright."""
    return h0 if s0 == s1 else h0 + (h1 - h0) * (s - s0) / (s1 - s0)


@kernel
def _store_from(shapes, ref, other, ref_is_b, feature, x, y, nx, ny, gap, R, p, buffer, count):
    """Store a contact given in the frame of shape `ref`, with its normal pointing out of it."""
    body = shapes.body[ref]
    x, y = to_world(x, y, body, R, p)
    nx, ny = turn_to_world(nx, ny, body, R)
    if ref_is_b:
        return store(buffer, count, shapes, other, ref, feature, x, y, nx, ny, gap)
    return store(buffer, count, shapes, ref, other, feature, x, y, -nx, -ny, gap)


@kernel
def _corners(shapes, ref, other, ref_is_b, R, p, margin, buffer, count):
    """One contact between the closest points of two polygons that are apart (both are corners)."""
    distance, vx, vy, wx, wy, feature = closest_points(shapes, ref, other, R, p)
    if distance > margin:
        return count
    nx, ny = (wx - vx) / distance, (wy - vy) / distance
    x, y = 0.5 * (vx + wx), 0.5 * (vy + wy)
    return _store_from(shapes, ref, other, ref_is_b, feature, x, y, nx, ny, distance, R, p, buffer, count)


@kernel
def closest_points(shapes, ref, other, R, p):
    """Distance of two separated polygons' corners, the corners v of `ref` and w of `other`, the feature.

    Only pairs of corners are looked at: whenever a corner is closest to the inside of an edge, the best axis
    is that edge's normal and its separation is the distance already. All in the frame of `ref`.
    """
    Qxx, Qxy, Qyx, Qyy, tx, ty = relative_frame(shapes, ref, other, R, p)
    best, feature = math.inf, 0
    vx, vy, wx, wy = 0.0, 0.0, 0.0, 0.0
    for j in range(shapes.count[other]):
        row = shapes.first[other] + j
        x, y = shapes.vertices[row, 0], shapes.vertices[row, 1]
        x, y = Qxx * x + Qxy * y + tx, Qyx * x + Qyy * y + ty
        for i in range(shapes.count[ref]):
            row = shapes.first[ref] + i
            dx, dy = x - shapes.vertices[row, 0], y - shapes.vertices[row, 1]
            square = dx * dx + dy * dy
            if square < best:
                best, wx, wy = square, x, y
                vx, vy = shapes.vertices[row, 0], shapes.vertices[row, 1]
                feature = vertex_feature(2, i, j) if ref < other else vertex_feature(2, j, i)
    return math.sqrt(best), vx, vy, wx, wy, feature

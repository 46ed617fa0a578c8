"""Narrow phase: contacts of candidate pairs of shapes from the poses of their bodies; this module has planar pairs.

Every contact has a unit normal from b into a, a gap (negative = overlap) along it, and a point midway between
the two surfaces, so that swapping the two shapes negates the normal and changes nothing else. A contact is
kept when gap <= margin. Nothing is allocated.
"""

from __future__ import annotations

import math

from iapb.compiled import kernel
from iapb.contact.geometry import CIRCLE, HALF_PLANE, HALF_SPACE
from iapb.contact.kernels.shape_frames import (
    placement,
    relative_frame,
    store_in_plane,
    to_world,
    turn_to_world,
    vertex_feature,
    world_point,
)
from iapb.contact.kernels.spatial_pairs import spatial_pair
from iapb.elementary import hypotenuse


@kernel
def detect(shapes, pairs, R, p, margin, buffer):
    """Write the contacts of all pairs into `buffer`; return how many, or -1 if its capacity is exceeded.

    shapes : Shapes; pairs : (k, 2); R (nb, 3, 3), p (nb, 3) : world placements of the bodies
    margin : float [m], contacts with gap <= margin are kept; 0 keeps overlaps and exact contact only
    buffer : ContactBuffer; only its geometric fields are written
    """
    count = 0
    for k in range(pairs.shape[0]):
        a, b = pairs[k, 0], pairs[k, 1]
        kind_a, kind_b = shapes.kind[a], shapes.kind[b]
        if kind_a >= HALF_SPACE:
            count = spatial_pair(shapes, a, b, R, p, margin, buffer, count)
        elif kind_b == HALF_PLANE:
            count = vertices_half_plane(shapes, a, b, R, p, margin, buffer, count)
        elif kind_a == CIRCLE and kind_b == CIRCLE:
            count = circles(shapes, a, b, R, p, margin, buffer, count)
        elif kind_a == CIRCLE:
            count = circle_polygon(shapes, a, b, True, R, p, margin, buffer, count)
        elif kind_b == CIRCLE:
            count = circle_polygon(shapes, b, a, False, R, p, margin, buffer, count)
        else:
            count = polygons(shapes, a, b, R, p, margin, buffer, count)
        if count < 0:
            return -1
    return count


@kernel
def vertices_half_plane(shapes, a, b, R, p, margin, buffer, count):
    """Write one contact per vertex of polygon a, or one for circle a: gap = (vertex - point)·normal - radius."""
    vertices, plane, first = shapes.vertices, shapes.first[b], shapes.first[a]
    x0, y0 = to_world(vertices[plane, 0], vertices[plane, 1], shapes.body[b], R, p)
    nx, ny = turn_to_world(vertices[plane + 1, 0], vertices[plane + 1, 1], shapes.body[b], R)
    radius = shapes.radius[a]
    Rxx, Rxy, Ryx, Ryy, px, py = placement(shapes.body[a], R, p)
    mx, my = Rxx * nx + Ryx * ny, Rxy * nx + Ryy * ny  # the normal in a's frame
    offset = (px - x0) * nx + (py - y0) * ny - radius
    for i in range(shapes.count[a]):
        x, y = vertices[first + i, 0], vertices[first + i, 1]
        gap = mx * x + my * y + offset
        if gap <= margin:
            depth = radius + 0.5 * gap  # from the vertex (or centre) back to midway between the surfaces
            x, y = Rxx * x + Rxy * y + px - depth * nx, Ryx * x + Ryy * y + py - depth * ny
            count = store_in_plane(buffer, count, shapes, a, b, vertex_feature(0, i, 0), x, y, nx, ny, gap)
            if count < 0:
                return -1
    return count


@kernel
def circles(shapes, a, b, R, p, margin, buffer, count):
    """Write the contact of two circles: gap = distance of centres - both radii, normal along the line of centres.

    Coincident centres have no such line. The normal is then +y if a has the smaller shape index and -y for the
    swapped pair, so that it is finite and still antisymmetric.
    """
    xa, ya = world_point(shapes, shapes.first[a], a, R, p)
    xb, yb = world_point(shapes, shapes.first[b], b, R, p)
    dx, dy = xa - xb, ya - yb
    radius_a, radius_b = shapes.radius[a], shapes.radius[b]
    reach = radius_a + radius_b + margin
    if abs(dx) > reach or abs(dy) > reach:
        return count
    distance = hypotenuse(dx, dy)
    gap = distance - (radius_a + radius_b)
    if gap > margin:
        return count
    if distance > 0.0:
        nx, ny = dx / distance, dy / distance
    else:
        nx, ny = 0.0, 1.0 if a < b else -1.0
    middle = 0.5 * (distance + radius_b - radius_a)  # from b's centre along the normal
    return store_in_plane(buffer, count, shapes, a, b, 0, xb + middle * nx, yb + middle * ny, nx, ny, gap)


@kernel
def circle_polygon(shapes, circle, polygon, circle_is_a, R, p, margin, buffer, count):
    """Write the contact of a circle and a convex polygon, at the polygon's nearest edge or vertex.

    For a centre inside the polygon, the contact is at the nearest edge.
    """
    nx, ny, distance, feature = nearest_on_polygon(shapes, circle, polygon, margin, R, p)
    radius = shapes.radius[circle]
    gap = distance - radius
    if gap > margin:
        return count
    nx, ny = turn_to_world(nx, ny, shapes.body[polygon], R)
    x, y = world_point(shapes, shapes.first[circle], circle, R, p)
    depth = radius + 0.5 * gap
    x, y = x - depth * nx, y - depth * ny
    if circle_is_a:
        return store_in_plane(buffer, count, shapes, circle, polygon, feature, x, y, nx, ny, gap)
    return store_in_plane(buffer, count, shapes, polygon, circle, feature, x, y, -nx, -ny, gap)


@kernel
def nearest_on_polygon(shapes, circle, polygon, margin, R, p):
    """Return direction (polygon frame) and signed distance from the polygon to a circle's centre, and the feature.

    It returns early, with a lower bound of the distance, if an edge shows that the gap exceeds the margin.
    """
    Qxx, Qxy, Qyx, Qyy, tx, ty = relative_frame(shapes, polygon, circle, R, p)
    row = shapes.first[circle]
    cx, cy = shapes.vertices[row, 0], shapes.vertices[row, 1]
    x, y = Qxx * cx + Qxy * cy + tx, Qyx * cx + Qyy * cy + ty
    first, count = shapes.first[polygon], shapes.count[polygon]
    best, edge, nx, ny = -math.inf, 0, 0.0, 1.0
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        ux, uy = shapes.vertices[first + i, 0], shapes.vertices[first + i, 1]
        ex, ey = shapes.vertices[first + j, 0] - ux, shapes.vertices[first + j, 1] - uy
        length = hypotenuse(ex, ey)
        distance = ((x - ux) * ey - (y - uy) * ex) / length
        if distance > best:
            best, edge, nx, ny = distance, i, ey / length, -ex / length
            if best - shapes.radius[circle] > margin:
                return nx, ny, best, 0
    following = edge + 1 if edge + 1 < count else 0
    return _edge_or_corner(shapes, first, edge, following, x, y, best, nx, ny)


@kernel
def _edge_or_corner(shapes, first, edge, following, x, y, best, nx, ny):
    """Return direction, distance and feature of the edge, or of its end if this is nearer to the point (x, y)."""
    if best <= 0.0:
        return nx, ny, best, vertex_feature(1, 0, edge)
    ux, uy = shapes.vertices[first + edge, 0], shapes.vertices[first + edge, 1]
    wx, wy = shapes.vertices[first + following, 0], shapes.vertices[first + following, 1]
    ex, ey = wx - ux, wy - uy
    if (x - ux) * ex + (y - uy) * ey < 0.0:
        corner, dx, dy = edge, x - ux, y - uy
    elif (x - wx) * ex + (y - wy) * ey > 0.0:
        corner, dx, dy = following, x - wx, y - wy
    else:
        return nx, ny, best, vertex_feature(1, 0, edge)
    distance = hypotenuse(dx, dy)
    return dx / distance, dy / distance, distance, vertex_feature(2, corner, 0)


# Contacts of two convex polygons: separating axes, clipping, and closest corners if they are separated.
#
# The axis of largest separation s picks a reference edge; the other polygon's most opposed edge is clipped to
# the strip over it, which leaves at most two points. Overlapping polygons always have the deepest vertex inside
# that strip: the point of a Minkowski difference's boundary nearest to an interior point lies within an edge.
# Separated polygons may be closest at two corners instead; then the contact is this pair of points.

# If the lowest point over the reference edge lies above the separation s by more than this share of the size of the
# numbers it was computed from, the polygons are closest elsewhere. Two dozen operations round to below 1e-14, and
# 1e-12 of the shapes' size is far below the accuracy of any geometry.
ROUNDING_SHARE = 1e-12


@kernel
def polygons(shapes, a, b, R, p, margin, buffer, count):
    """Write the contacts (two at most) of convex polygons a and b; comments above describe the method."""
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
    """Return the largest separation over the edge normals of `onto`, and its edge; return early above the margin.

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
    """Return start (x, y), outward unit normal (x, y) and length of an edge, in the polygon's frame."""
    following = edge + 1 if edge + 1 < count else 0
    ux, uy = shapes.vertices[first + edge, 0], shapes.vertices[first + edge, 1]
    ex, ey = shapes.vertices[first + following, 0] - ux, shapes.vertices[first + following, 1] - uy
    length = math.sqrt(ex * ex + ey * ey)
    return ux, uy, ey / length, -ex / length, length


@kernel
def opposed_edge(shapes, other, mx, my):
    """Return the edge of `other` whose outward normal is most opposed to (mx, my), given in the frame of `other`."""
    first, count = shapes.first[other], shapes.count[other]
    best, edge = math.inf, 0
    for i in range(count):
        _, _, nx, ny, _ = edge_frame(shapes, first, count, i)
        if nx * mx + ny * my < best:
            best, edge = nx * mx + ny * my, i
    return edge


@kernel
def _against_reference(shapes, ref, other, edge, separation, ref_is_b, R, p, margin, buffer, count):
    """Write the contacts over the reference edge, or between two corners if the polygons are closest there."""
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

    side, opposite = (0, 1) if ref_is_b else (1, 0)  # vertex of the incident or of the reference edge
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
    """Return the coordinates of a vertex over the reference edge: s along it from its start, h along its normal."""
    x, y = shapes.vertices[row, 0], shapes.vertices[row, 1]
    x, y = Qxx * x + Qxy * y + tx, Qyx * x + Qyy * y + ty
    return -ny * x + nx * y, nx * x + ny * y


@kernel
def height_at(s, s0, h0, s1, h1):
    """Return the height at s of the line through (s0, h0) and (s1, h1); h0 if s0 = s1."""
    return h0 if s0 == s1 else h0 + (h1 - h0) * (s - s0) / (s1 - s0)


@kernel
def _store_from(shapes, ref, other, ref_is_b, feature, x, y, nx, ny, gap, R, p, buffer, count):
    """Store a contact given in the frame of shape `ref`, with its normal pointing out of it."""
    body = shapes.body[ref]
    x, y = to_world(x, y, body, R, p)
    nx, ny = turn_to_world(nx, ny, body, R)
    if ref_is_b:
        return store_in_plane(buffer, count, shapes, other, ref, feature, x, y, nx, ny, gap)
    return store_in_plane(buffer, count, shapes, ref, other, feature, x, y, -nx, -ny, gap)


@kernel
def _corners(shapes, ref, other, ref_is_b, R, p, margin, buffer, count):
    """Write one contact between the closest points of two separated polygons (both points are corners)."""
    distance, vx, vy, wx, wy, feature = closest_points(shapes, ref, other, R, p)
    if distance > margin:
        return count
    nx, ny = (wx - vx) / distance, (wy - vy) / distance
    x, y = 0.5 * (vx + wx), 0.5 * (vy + wy)
    return _store_from(shapes, ref, other, ref_is_b, feature, x, y, nx, ny, distance, R, p, buffer, count)


@kernel
def closest_points(shapes, ref, other, R, p):
    """Return the smallest distance of two polygons' corners, the corners v of `ref` and w of `other`, and the feature.

    Pairs of corners are enough: if a corner is closest to the inside of an edge, the best axis is the normal of this
    edge and its separation is already the distance. All values are in the frame of `ref`.
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

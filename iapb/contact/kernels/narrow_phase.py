"""Narrow phase: contacts of candidate pairs of shapes from the poses of their bodies; this module
has planar pairs.

Every contact has a unit normal from b into a, a gap (negative = overlap) along it, and a point
midway between the two surfaces, so that swapping the two shapes negates the normal and changes
nothing else. A contact is kept when gap <= margin. Nothing is allocated.
"""

from __future__ import annotations

from math import inf, sqrt

from iapb.contact.geometry import BOX, CIRCLE, HALF_PLANE, HALF_SPACE, SPHERE
from iapb.contact.kernels.shape_frames import (
    ball_on_surface,
    balls,
    place,
    placement,
    relative_frame,
    store_contact,
    turn_to_world,
    vertex_feature,
    world_center,
)
from iapb.contact.kernels.spatial_pairs import boxes, corners_half_space, sphere_box
from iapb.numerics.compiled import kernel
from iapb.numerics.elementary import hypotenuse


@kernel
def detect(shapes, pairs, w, margin, buffer):
    """Write the contacts of all pairs into `buffer`; return how many, or -1 if its capacity is
    exceeded.

    shapes : Shapes; pairs : (k, 2)
    w : world placements of the bodies, `rotation` (nb, 3, 3) and `position` (nb, 3)
    margin : float [m], contacts with gap <= margin are kept; 0 keeps overlaps and exact contact
        only
    buffer : ContactBuffer; only its geometric fields are written
    """
    count = 0
    for k in range(len(pairs)):
        a = pairs[k, 0]
        b = pairs[k, 1]
        kind_a = shapes.kind[a]
        kind_b = shapes.kind[b]
        if kind_a == kind_b and kind_a in (CIRCLE, SPHERE):
            count = balls(shapes, a, b, w, margin, buffer, count)
        elif kind_b == HALF_SPACE:
            count = corners_half_space(shapes, a, b, w, margin, buffer, count)
        elif kind_a == SPHERE:
            count = sphere_box(shapes, a, b, True, w, margin, buffer, count)
        elif kind_b == SPHERE:
            count = sphere_box(shapes, b, a, False, w, margin, buffer, count)
        elif kind_a == BOX:
            count = boxes(shapes, a, b, w, margin, buffer, count)
        elif kind_b == HALF_PLANE:
            count = vertices_half_plane(shapes, a, b, w, margin, buffer, count)
        elif kind_a == CIRCLE:
            count = circle_polygon(shapes, a, b, True, w, margin, buffer, count)
        elif kind_b == CIRCLE:
            count = circle_polygon(shapes, b, a, False, w, margin, buffer, count)
        else:
            count = polygons(shapes, a, b, w, margin, buffer, count)
    return count


@kernel
def corner(shapes, shape, i):
    """Return corner i of a polygon, in its frame."""
    return shapes.vertices[shapes.first[shape] + i, 0], shapes.vertices[shapes.first[shape] + i, 1]


@kernel
def following(shapes, shape, i):
    """Return the number of the corner, or edge, after number i."""
    return i + 1 if i + 1 < shapes.count[shape] else 0


@kernel
def edge_from(shapes, shape, i):
    """Return where edge i of a polygon begins, and the vector along it, in its frame."""
    x, y = corner(shapes, shape, i)
    end_x, end_y = corner(shapes, shape, following(shapes, shape, i))
    return x, y, end_x - x, end_y - y


@kernel
def vertices_half_plane(shapes, a, b, w, margin, buffer, count):
    """Write one contact per vertex of polygon a, or one for circle a: gap = (vertex - point)·normal
    - radius."""
    x0, y0 = corner(shapes, b, 0)
    nx, ny = corner(shapes, b, 1)
    radius = shapes.radius[a]
    frame = placement(shapes.body[a], w)
    # the normal in a's frame
    mx = frame[0] * nx + frame[2] * ny
    my = frame[1] * nx + frame[3] * ny
    offset = (frame[4] - x0) * nx + (frame[5] - y0) * ny - radius
    for i in range(shapes.count[a]):
        x, y = corner(shapes, a, i)
        gap = mx * x + my * y + offset
        if gap <= margin:
            # from the vertex (or centre) back to midway between the surfaces
            depth = radius + 0.5 * gap
            x, y = place(frame, x, y)
            count = store_contact(
                shapes,
                a,
                b,
                True,
                vertex_feature(0, i, 0),
                (x - depth * nx, y - depth * ny, 0.0),
                (nx, ny, 0.0),
                gap,
                buffer,
                count,
            )
    return count


@kernel
def circle_polygon(shapes, circle, polygon, circle_is_a, w, margin, buffer, count):
    """Write the contact of a circle and a convex polygon, at the polygon's nearest edge or vertex.

    For a centre inside the polygon, the contact is at the nearest edge.
    """
    x, y = corner(shapes, circle, 0)
    x, y = place(relative_frame(shapes, polygon, circle, w), x, y)
    best = -inf
    edge = 0
    nx = 0.0
    ny = 1.0
    for i in range(shapes.count[polygon]):
        ux, uy, ex, ey = edge_from(shapes, polygon, i)
        length = hypotenuse(ex, ey)
        distance = ((x - ux) * ey - (y - uy) * ex) / length
        if distance > best:
            best = distance
            edge = i
            nx = ey / length
            ny = -ex / length
            if best - shapes.radius[circle] > margin:
                return count
    feature = vertex_feature(1, 0, edge)
    ux, uy, ex, ey = edge_from(shapes, polygon, edge)
    wx, wy = corner(shapes, polygon, following(shapes, polygon, edge))
    before = (x - ux) * ex + (y - uy) * ey < 0.0
    beyond = (x - wx) * ex + (y - wy) * ey > 0.0
    if best > 0.0 and (before or beyond):  # an end of the edge is nearer
        end = edge if before else following(shapes, polygon, edge)
        ux, uy = corner(shapes, polygon, end)
        best = hypotenuse(x - ux, y - uy)
        nx = (x - ux) / best
        ny = (y - uy) / best
        feature = vertex_feature(2, end, 0)
    nx, ny = turn_to_world(nx, ny, shapes.body[polygon], w)
    return ball_on_surface(
        shapes,
        circle,
        polygon,
        circle_is_a,
        world_center(shapes, circle, w),
        (nx, ny, 0.0),
        best,
        feature,
        margin,
        buffer,
        count,
    )


# Contacts of two convex polygons: separating axes, clipping, and closest corners if they are
# separated.
#
# The axis of largest separation s picks a reference edge; the other polygon's most opposed edge is
# clipped to the strip over it, which leaves at most two points. Overlapping polygons always have
# the deepest vertex inside that strip: the point of a Minkowski difference's boundary nearest to an
# interior point lies within an edge. Separated polygons may be closest at two corners instead; then
# the contact is this pair of points.

# If the lowest point over the reference edge lies above the separation s by more than this share of
# the size of the numbers it was computed from, the polygons are closest elsewhere. Two dozen
# operations round to below 1e-14, and 1e-12 of the shapes' size is far below the accuracy of any
# geometry.
ROUNDING_SHARE = 1e-12


@kernel
def polygons(shapes, a, b, w, margin, buffer, count):
    """Write the contacts (two at most) of convex polygons a and b; comments above describe the
    method."""
    separation_a, edge_a = best_edge(shapes, a, b, w, margin)
    if separation_a > margin:
        return count
    separation_b, edge_b = best_edge(shapes, b, a, w, margin)
    if separation_b > margin:
        return count
    if separation_b >= separation_a:
        return _against_reference(
            shapes, b, a, edge_b, separation_b, True, w, margin, buffer, count
        )
    return _against_reference(shapes, a, b, edge_a, separation_a, False, w, margin, buffer, count)


@kernel
def best_edge(shapes, onto, other, w, margin):
    """Return the largest separation over the edge normals of `onto`, and its edge; return early
    above the margin.

    separation of an edge = min over the vertices w of `other` of n·(w - v), n its outward normal, v
    its start
    """
    frame = relative_frame(shapes, onto, other, w)
    best = -inf
    edge = 0
    for i in range(shapes.count[onto]):
        ux, uy, nx, ny, _ = edge_frame(shapes, onto, i)
        # the normal in the other's frame
        mx = frame[0] * nx + frame[2] * ny
        my = frame[1] * nx + frame[3] * ny
        lowest = inf
        for k in range(shapes.count[other]):
            x, y = corner(shapes, other, k)
            lowest = min(lowest, mx * x + my * y)
        separation = lowest + nx * (frame[4] - ux) + ny * (frame[5] - uy)
        if separation > best:
            best = separation
            edge = i
            if best > margin:
                return best, edge
    return best, edge


@kernel
def edge_frame(shapes, shape, edge):
    """Return start (x, y), outward unit normal (x, y) and length of an edge, in the polygon's
    frame."""
    ux, uy, ex, ey = edge_from(shapes, shape, edge)
    length = sqrt(ex * ex + ey * ey)
    return ux, uy, ey / length, -ex / length, length


@kernel
def _against_reference(shapes, ref, other, edge, separation, ref_is_b, w, margin, buffer, count):
    """Write the contacts over the reference edge, or between two corners if the polygons are
    closest there."""
    xx, xy, yx, yy, tx, ty = relative_frame(shapes, ref, other, w)
    ux, uy, nx, ny, length = edge_frame(shapes, ref, edge)
    mx = xx * nx + yx * ny
    my = xy * nx + yy * ny
    incident = 0
    opposed = inf
    # the incident edge: its outward normal is most opposed to this one's
    for i in range(shapes.count[other]):
        _, _, ox, oy, _ = edge_frame(shapes, other, i)
        if ox * mx + oy * my < opposed:
            incident = i
            opposed = ox * mx + oy * my
    from_start = (xx, xy, yx, yy, tx - ux, ty - uy)
    s0, h0 = over_edge(shapes, other, incident, from_start, nx, ny)
    next_incident = following(shapes, other, incident)
    s1, h1 = over_edge(shapes, other, next_incident, from_start, nx, ny)

    size = length + abs(tx) + abs(ty) + abs(ux) + abs(uy)
    missed = s0 < 0.0 or s1 > length  # s0 >= s1: the incident edge runs against the reference edge
    start_s, start_h = (s0, h0) if s0 <= length else (length, height_at(length, s0, h0, s1, h1))
    end_s, end_h = (s1, h1) if s1 >= 0.0 else (0.0, height_at(0.0, s0, h0, s1, h1))
    if missed or min(start_h, end_h) - separation > ROUNDING_SHARE * size:
        if separation > 0.0:
            return _corners(shapes, ref, other, ref_is_b, w, margin, buffer, count)
        # Overlapping: only rounding can put the deepest vertex outside the strip. Take it as it is.
        start_s, start_h = (s0, separation) if h0 < h1 else (s1, separation)
        end_h = inf

    # vertex of the incident or of the reference edge
    side, opposite = (0, 1) if ref_is_b else (1, 0)
    for s, h, vertex, end, cut in (
        (start_s, start_h, incident, following(shapes, ref, edge), s0 > length),
        (end_s, end_h, next_incident, edge, s1 < 0.0),
    ):
        if h <= margin:
            feature = (
                vertex_feature(opposite, end, incident)
                if cut
                else vertex_feature(side, vertex, edge)
            )
            x = ux - ny * s + 0.5 * h * nx
            y = uy + nx * s + 0.5 * h * ny
            count = _store_from(
                shapes, ref, other, ref_is_b, feature, x, y, nx, ny, h, w, buffer, count
            )
    return count


@kernel
def over_edge(shapes, other, vertex, from_start, nx, ny):
    """Return the coordinates of a vertex over the reference edge: s along it from its start, h
    along its normal."""
    x, y = corner(shapes, other, vertex)
    x, y = place(from_start, x, y)
    return -ny * x + nx * y, nx * x + ny * y


@kernel
def height_at(s, s0, h0, s1, h1):
    """Return the height at s of the line through (s0, h0) and (s1, h1); h0 if s0 = s1."""
    return h0 if s0 == s1 else h0 + (h1 - h0) * (s - s0) / (s1 - s0)


@kernel
def _store_from(shapes, ref, other, ref_is_b, feature, x, y, nx, ny, gap, w, buffer, count):
    """Store a contact given in the frame of shape `ref`, with its normal pointing out of it."""
    body = shapes.body[ref]
    nx, ny = turn_to_world(nx, ny, body, w)
    if body >= 0:
        x, y = place(placement(body, w), x, y)
    return store_contact(
        shapes, other, ref, ref_is_b, feature, (x, y, 0.0), (nx, ny, 0.0), gap, buffer, count
    )


@kernel
def _corners(shapes, ref, other, ref_is_b, w, margin, buffer, count):
    """Write one contact between the closest corners v of `ref` and w of `other`, two separated
    polygons.

    Pairs of corners are enough: if a corner is closest to the inside of an edge, the best axis is
    the normal of this edge and its separation is already the distance.
    """
    frame = relative_frame(shapes, ref, other, w)
    best = inf
    feature = 0
    vx = vy = wx = wy = 0.0
    for j in range(shapes.count[other]):
        x, y = corner(shapes, other, j)
        x, y = place(frame, x, y)
        for i in range(shapes.count[ref]):
            ux, uy = corner(shapes, ref, i)
            square = (x - ux) * (x - ux) + (y - uy) * (y - uy)
            if square < best:
                best = square
                vx = ux
                vy = uy
                wx = x
                wy = y
                feature = vertex_feature(2, i, j) if ref < other else vertex_feature(2, j, i)
    distance = sqrt(best)
    if distance > margin:
        return count
    return _store_from(
        shapes,
        ref,
        other,
        ref_is_b,
        feature,
        0.5 * (vx + wx),
        0.5 * (vy + wy),
        (wx - vx) / distance,
        (wy - vy) / distance,
        distance,
        w,
        buffer,
        count,
    )

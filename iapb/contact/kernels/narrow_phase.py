"""Narrow phase: contacts of candidate pairs of shapes, from the placements of their bodies; planar pairs are here.

Every contact has a unit normal from b into a, a gap (negative = overlap) along it, and a point midway between
the two surfaces, so that swapping the two shapes negates the normal and changes nothing else. A contact is
kept when gap <= margin. Nothing is allocated.
"""

from __future__ import annotations

import math

from iapb.compiled import kernel
from iapb.contact.geometry import CIRCLE, HALF_PLANE, HALF_SPACE
from iapb.contact.kernels.polygon_pair import polygons
from iapb.contact.kernels.shape_frames import (
    placement,
    relative_frame,
    store,
    to_world,
    turn_to_world,
    vertex_feature,
    world_point,
)
from iapb.contact.kernels.spatial_pairs import spatial_pair
from iapb.elementary import hypotenuse


@kernel
def detect(shapes, pairs, R, p, margin, buffer):
    """Write the contacts of all pairs into `buffer`; return how many, or -1 when its capacity is exceeded.

    shapes : Shapes; pairs : (k, 2); R (nb, 3, 3), p (nb, 3) : world placements of the bodies
    margin : float [m], contacts with gap <= margin are kept; 0 keeps overlap and exact touch only
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
    """One contact per vertex of polygon a (or for circle a): gap = (vertex - point)·normal - radius."""
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
            count = store(buffer, count, shapes, a, b, vertex_feature(0, i, 0), x, y, nx, ny, gap)
            if count < 0:
                return -1
    return count


@kernel
def circles(shapes, a, b, R, p, margin, buffer, count):
    """Two circles: gap = distance of the centres - both radii, normal along the line of centres.

    Coincident centres have no such line; the normal is then +y for the pair with the smaller shape index
    first and -y for the swapped pair: finite, and still antisymmetric.
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
    return store(buffer, count, shapes, a, b, 0, xb + middle * nx, yb + middle * ny, nx, ny, gap)


@kernel
def circle_polygon(shapes, circle, polygon, circle_is_a, R, p, margin, buffer, count):
    """A circle and a convex polygon: one contact at the polygon's nearest edge or vertex.

    A centre inside the polygon is pushed out through the nearest edge.
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
        return store(buffer, count, shapes, circle, polygon, feature, x, y, nx, ny, gap)
    return store(buffer, count, shapes, polygon, circle, feature, x, y, -nx, -ny, gap)


@kernel
def nearest_on_polygon(shapes, circle, polygon, margin, R, p):
    """Direction (polygon frame) and signed distance from the polygon to a circle's centre, and the feature.

    Returns early, with a lower bound of the distance, once an edge shows the gap to exceed the margin.
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
    """Decide whether the point (x, y) outside edge `edge` is nearest to the edge or to one of its ends."""
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

"""Contacts of the rigid worlds in closed form: circles, convex polygons and half-planes; balls,
boxes and half-spaces.

This module has the engine's conventions (unit normal from b into a, gap along it, point midway,
same choice of points for face on face) but shares no code with it. It computes everything in the
world frame, searches all edges for a polygon's nearest point, and clips faces of boxes by
Sutherland and Hodgman. Sums thus have a different order, and a fault in one implementation shows as
a difference (`verification.mechanics.against_pinocchio.scene_difference`).

The normal of two polygons or boxes is the axis of largest separation. For flush pairs, separations
agree up to rounding, so differences below TIE of the size count as equal. Then b's edge, or a's
face, has priority.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from iapb.contact.geometry import BOX, CIRCLE, HALF_PLANE, HALF_SPACE, SPHERE, Shapes
from reference import Floats

Integers = NDArray[np.int32]

ROUNDING = 1e-12  # share of the size within which points coincide
# share of the size within which separations count as equal; a tilt of 1e-6 already exceeds it
TIE = 1e-14
# The engine's conventions for boxes: two edges give the normal only if they overlap by this share
# less than faces do; edges with a smaller sine between them count as parallel; at most four points
# of a patch are kept.
EDGE_SHARE, PARALLEL, MOST_POINTS = 0.05, 1e-6, 4
# Shapes that are apart graze if they just reach a face's plane, up to this share of the size: they
# slide or roll past each other, as over a seam of two tiles. Far above rounding.
GRAZE = 1e-9
FACE_SHARE, FACES_COSINE = (
    1e-4,
    0.9999,
)  # the second box's parallel face must overlap less by this share to decide


class Contacts(NamedTuple):
    """c contacts: shapes, bodies (-1 = the world), feature (c,); point, normal (c, 3); gap (c,)
    [m]."""

    shape_a: Integers
    shape_b: Integers
    body_a: Integers
    body_b: Integers
    feature: NDArray[np.int64]
    point: Floats
    normal: Floats
    gap: Floats


def find_contacts(
    shapes: Shapes, pairs: NDArray[np.int32], axes: Floats, origins: Floats, margin: float
) -> Contacts:
    """Return the contacts with gap <= margin [m], for axes (n + 1, 3, 3), origins (n + 1, 3) of
    bodies and world."""
    first = pairs[:, 0]
    room = 16 + int(
        np.where(shapes.kind[first] == BOX, 8, np.maximum(shapes.count[first], 2)).sum()
    )
    ids, values = np.empty((room, 3), np.int64), np.empty((room, 7))
    corners, center, frames = _placed(
        shapes.kind,
        shapes.first,
        shapes.count,
        shapes.body,
        shapes.vertices,
        shapes.center,
        shapes.axes,
        axes,
        origins,
    )
    count = _find(
        shapes.kind,
        shapes.radius,
        shapes.first,
        shapes.count,
        corners,
        center,
        frames,
        shapes.half_size,
        pairs,
        float(margin),
        ids,
        values,
    )
    a, b = ids[:count, 0].astype(np.int32), ids[:count, 1].astype(np.int32)
    return Contacts(
        a,
        b,
        shapes.body[a],
        shapes.body[b],
        ids[:count, 2],
        values[:count, :3],
        values[:count, 3:6],
        values[:count, 6],
    )


@numba.njit(cache=True, fastmath=False)
def _placed(kind, first, count, body, vertices, center, frames, axes, origins):  # type: ignore[no-untyped-def]
    """Return corners, centres and axes of all shapes in the world; the second row of a half-plane
    is a direction."""
    corners, centers, turned = (
        np.zeros((len(vertices), 3)),
        np.zeros((len(kind), 3)),
        np.zeros((len(kind), 3, 3)),
    )
    for s in range(len(kind)):
        own, origin = axes[body[s]], origins[body[s]]
        for i in range(3):
            for k in range(3):
                centers[s, i] += own[i, k] * center[s, k]
                for j in range(3):
                    turned[s, i, j] += own[i, k] * frames[s, k, j]
            centers[s, i] += origin[i]
            for c in range(first[s], first[s] + count[s]):
                corners[c, i] = own[i, 0] * vertices[c, 0] + own[i, 1] * vertices[c, 1]
                if kind[s] != HALF_PLANE or c == first[s]:
                    corners[c, i] += origin[i]
    return corners, centers, turned


@numba.njit(cache=True, fastmath=False)
def _find(  # type: ignore[no-untyped-def]
    kind, radius, first, count, corners, center, axes, half, pairs, margin, ids, values
):
    """Write the contacts of all pairs; return their number."""
    n = np.int64(
        0
    )  # numba would compile every function that takes n twice: for the literal 0, and for a variable
    for k in range(len(pairs)):
        a, b, start = pairs[k, 0], pairs[k, 1], n
        ka, kb = kind[a], kind[b]
        pa, pb = corners[first[a] : first[a] + count[a]], corners[first[b] : first[b] + count[b]]
        round_a, round_b = ka in (CIRCLE, SPHERE), kb in (CIRCLE, SPHERE)
        x, y = pa[0] if ka == CIRCLE else center[a], pb[0] if kb == CIRCLE else center[b]
        if kb == HALF_PLANE:
            n = _points_on_plane(pa, radius[a], pb[0], pb[1], margin, ids, values, n)
        elif kb == HALF_SPACE:
            spread = np.zeros((1, 3)) if ka == SPHERE else _box_corners(axes[a], half[a])
            n = _points_on_plane(
                x + spread, radius[a], y, axes[b, :, 2].copy(), margin, ids, values, n
            )
        elif round_a and round_b:
            otherwise = np.zeros(3)
            otherwise[1 if ka == CIRCLE else 2] = 1.0 if a < b else -1.0
            n = _balls(x, radius[a], y, radius[b], otherwise, margin, ids, values, n)
        elif round_a:
            nearest = (
                _nearest_on_polygon(pb, x)
                if ka == CIRCLE
                else _nearest_on_box(y, axes[b], half[b], x)
            )
            n = _ball_on(nearest, x, radius[a], 1.0, margin, ids, values, n)
        elif round_b:
            nearest = (
                _nearest_on_polygon(pa, y)
                if kb == CIRCLE
                else _nearest_on_box(x, axes[a], half[a], y)
            )
            n = _ball_on(nearest, y, radius[b], -1.0, margin, ids, values, n)
        elif ka == BOX:
            n = _boxes(
                center[a], axes[a], half[a], center[b], axes[b], half[b], margin, ids, values, n
            )
        else:
            n = _polygons(pa, pb, margin, ids, values, n)
        ids[start:n, 0], ids[start:n, 1] = a, b
    return n


@numba.njit(cache=True, fastmath=False)
def _store(ids, values, n, feature, point, normal, gap):  # type: ignore[no-untyped-def]
    """Write a contact without its shapes, which `_find` adds; return the new number of contacts."""
    ids[n, 2], values[n, :3], values[n, 3:6], values[n, 6] = feature, point, normal, gap
    return n + 1


@numba.njit(cache=True, fastmath=False)
def _feature(kind, one, other):  # type: ignore[no-untyped-def]
    """Return the number of two features; kind 0: corner of a on face of b, 1: reverse, 2: two
    corners or edges."""
    return (kind * 100_000 + one) * 100_000 + other


@numba.njit(cache=True, fastmath=False)
def _points_on_plane(points, radius, origin, normal, margin, ids, values, n):  # type: ignore[no-untyped-def]
    """Write contacts of corners (or the centre of a ball) with a half-plane or half-space."""
    for i in range(len(points)):
        gap = np.sum((points[i] - origin) * normal) - radius
        if gap <= margin:
            n = _store(
                ids,
                values,
                n,
                _feature(0, i, 0),
                points[i] - (radius + 0.5 * gap) * normal,
                normal,
                gap,
            )
    return n


@numba.njit(cache=True, fastmath=False)
def _balls(x, radius_x, y, radius_y, otherwise, margin, ids, values, n):  # type: ignore[no-untyped-def]
    """Write the contact of two circles or balls; `otherwise` is the normal if the centres
    coincide."""
    apart = x - y
    distance = np.sqrt(np.sum(apart * apart))
    gap = distance - (radius_x + radius_y)
    if gap > margin:
        return n
    normal = apart / distance if distance > 0.0 else otherwise
    return _store(
        ids, values, n, 0, y + 0.5 * (distance + radius_y - radius_x) * normal, normal, gap
    )


@numba.njit(cache=True, fastmath=False)
def _ball_on(nearest, middle, radius, sign, margin, ids, values, n):  # type: ignore[no-untyped-def]
    """Write the contact of a circle or ball with a polygon or box; sign −1 if the ball is b."""
    normal, distance, feature, heights = nearest
    gap = distance - radius
    grazes = np.abs(heights - radius).min() <= GRAZE * radius
    if gap > margin or (grazes and gap > GRAZE * radius):
        return n
    return _store(
        ids, values, n, feature, middle - (radius + 0.5 * gap) * normal, sign * normal, gap
    )


@numba.njit(cache=True, fastmath=False)
def _edges(polygon):  # type: ignore[no-untyped-def]
    """Return outward unit normals (k, 3) and lengths (k,) of a counterclockwise polygon's edges."""
    normals, lengths = np.zeros((len(polygon), 3)), np.empty(len(polygon))
    for i in range(len(polygon)):
        edge = polygon[(i + 1) % len(polygon)] - polygon[i]
        lengths[i] = np.sqrt(np.sum(edge * edge))
        normals[i, 0], normals[i, 1] = edge[1] / lengths[i], -edge[0] / lengths[i]
    return normals, lengths


@numba.njit(cache=True, fastmath=False)
def _nearest_on_polygon(polygon, x):  # type: ignore[no-untyped-def]
    """Return direction from the polygon to a point, signed distance, feature, and heights over all
    edges; inside, those of the nearest edge."""
    normals, lengths = _edges(polygon)
    heights = np.empty(len(polygon))
    for i in range(len(polygon)):
        heights[i] = np.sum((x - polygon[i]) * normals[i])
    edge = np.argmax(heights)
    if heights[edge] <= 0.0:
        return normals[edge], heights[edge], _feature(1, 0, edge), heights
    best, normal, feature = np.inf, normals[edge], 0
    for i in range(len(polygon)):
        from_start, height = x - polygon[i], heights[i]
        along = -normals[i, 1] * from_start[0] + normals[i, 0] * from_start[1]
        if 0.0 <= along <= lengths[i]:
            if 0.0 < height < best:
                best, normal, feature = height, normals[i], _feature(1, 0, i)
        elif along < 0.0:
            distance = np.sqrt(np.sum(from_start * from_start))
            if distance < best:
                best, normal, feature = distance, from_start / distance, _feature(2, i, 0)
    return normal, best, feature, heights


@numba.njit(cache=True, fastmath=False)
def _along(axes, x):  # type: ignore[no-untyped-def]
    """Return the components (3,) of x along the axes, without BLAS."""
    found = np.empty(3)
    for k in range(3):
        found[k] = axes[0, k] * x[0] + axes[1, k] * x[1] + axes[2, k] * x[2]
    return found


@numba.njit(cache=True, fastmath=False)
def _nearest_on_box(center, axes, half, x):  # type: ignore[no-untyped-def]
    """Return direction from the box to a point, signed distance, feature, and heights over the
    faces; inside, those of the nearest face."""
    local = _along(axes, x - center)
    beyond = np.abs(local) - half
    if beyond.max() <= 0.0:
        face = int(np.argmax(beyond))
        sign = 1.0 if local[face] >= 0.0 else -1.0
        feature = _feature(1, face, int(sign > 0.0))
        return sign * axes[:, face].copy(), beyond[face], feature, beyond
    out, region = np.zeros(3), 0
    for k in range(3):
        if beyond[k] > 0.0:
            out += np.sign(local[k]) * beyond[k] * axes[:, k]
            region += (1 if local[k] > 0.0 else 2) * 3**k
    distance = np.sqrt(np.sum(out * out))
    return out / distance, distance, _feature(2, region, 0), beyond


@numba.njit(cache=True, fastmath=False)
def _box_corners(axes, half):  # type: ignore[no-untyped-def]
    """Return the corners (8, 3) relative to the centre."""
    corners = np.empty((8, 3))
    for i in range(8):
        along, up, out = (
            (1 - 2 * (i & 1)) * half[0],
            (1 - (i & 2)) * half[1],
            (1 - (i & 4) // 2) * half[2],
        )
        for x in range(3):
            corners[i, x] = along * axes[x, 0] + up * axes[x, 1] + out * axes[x, 2]
    return corners


@numba.njit(cache=True, fastmath=False)
def _best_edge(onto, normals, other):  # type: ignore[no-untyped-def]
    """Return the largest separation of `other` over the edges of `onto`, and the edge."""
    best, edge = -np.inf, 0
    for i in range(len(onto)):
        lowest = np.inf
        for x in other:
            lowest = min(lowest, np.sum((x - onto[i]) * normals[i]))
        if lowest > best:
            best, edge = lowest, i
    return best, edge


@numba.njit(cache=True, fastmath=False)
def _polygons(a, b, margin, ids, values, n):  # type: ignore[no-untyped-def]
    """Write contacts of two convex polygons: the incident edge over the reference edge, or two
    corners."""
    (normals_a, lengths_a), (normals_b, lengths_b) = _edges(a), _edges(b)
    size = lengths_a.max() + lengths_b.max()
    (over_a, edge_a), (over_b, edge_b) = _best_edge(a, normals_a, b), _best_edge(b, normals_b, a)
    if max(over_a, over_b) > margin:
        return n
    if max(over_a, over_b) > GRAZE * size and (
        _grazes(a, normals_a, b, size) or _grazes(b, normals_b, a, size)
    ):
        return n
    if over_a > over_b + TIE * size:
        return _over_edge(
            a,
            normals_a,
            lengths_a,
            edge_a,
            over_a,
            b,
            normals_b,
            -1.0,
            size,
            margin,
            ids,
            values,
            n,
        )
    return _over_edge(
        b, normals_b, lengths_b, edge_b, over_b, a, normals_a, 1.0, size, margin, ids, values, n
    )


@numba.njit(cache=True, fastmath=False)
def _grazes(ref, normals, other, size):  # type: ignore[no-untyped-def]
    """Return whether the other polygon just reaches one of the edges' lines."""
    for k in range(len(ref)):
        lowest = np.inf
        for i in range(len(other)):
            lowest = min(lowest, np.sum((other[i] - ref[k]) * normals[k]))
        if abs(lowest) <= GRAZE * size:
            return True
    return False


@numba.njit(cache=True, fastmath=False)
def _over_edge(  # type: ignore[no-untyped-def]
    ref,
    normals,
    lengths,
    edge,
    separation,
    other,
    normals_other,
    sign,
    size,
    margin,
    ids,
    values,
    n,
):
    """Write the contacts over the reference edge; sign 1 if the edge belongs to b."""
    m, length, k = normals[edge], lengths[edge], len(other)
    t = np.array([-m[1], m[0], 0.0])
    incident = 0
    for i in range(1, k):
        if np.sum(normals_other[i] * m) < np.sum(normals_other[incident] * m):
            incident = i
    vertex = np.array([incident, (incident + 1) % k])
    s, h, cut = np.empty(2), np.empty(2), np.zeros(2, np.bool_)
    for e in range(2):  # the incident edge runs against the reference edge: s[0] >= s[1]
        s[e], h[e] = (
            np.sum((other[vertex[e]] - ref[edge]) * t),
            np.sum((other[vertex[e]] - ref[edge]) * m),
        )
    missed, lowest = s[0] < 0.0 or s[1] > length, 0 if h[0] < h[1] else 1
    slope = (h[1] - h[0]) / (s[1] - s[0]) if s[0] != s[1] else 0.0
    low_s = s[lowest]
    for e, end in ((0, length), (1, 0.0)):
        cut[e] = s[e] > length if e == 0 else s[e] < 0.0
        if cut[e]:
            s[e], h[e] = end, h[e] + slope * (end - s[e])
    if missed or min(h[0], h[1]) - separation > ROUNDING * size:
        if separation > 0.0:
            return _corners(ref, other, sign, margin, ids, values, n)
        s[lowest], h[lowest], h[1 - lowest], cut[lowest] = low_s, separation, np.inf, False
    for e in range(2):
        if h[e] <= margin:
            feature = _feature(0 if sign > 0.0 else 1, vertex[e], edge)
            if cut[e]:
                corner = (edge + 1) % len(ref) if e == 0 else edge
                feature = _feature(1 if sign > 0.0 else 0, corner, incident)
            n = _store(
                ids, values, n, feature, ref[edge] + s[e] * t + 0.5 * h[e] * m, sign * m, h[e]
            )
    return n


@numba.njit(cache=True, fastmath=False)
def _corners(ref, other, sign, margin, ids, values, n):  # type: ignore[no-untyped-def]
    """Write one contact between the closest corners of separate polygons."""
    best, i, j = np.inf, 0, 0
    for k in range(len(ref)):
        for m in range(len(other)):
            apart = other[m] - ref[k]
            distance = np.sqrt(np.sum(apart * apart))
            if distance < best:
                best, i, j = distance, k, m
    if best > margin:
        return n
    feature = _feature(2, j, i) if sign > 0.0 else _feature(2, i, j)
    return _store(
        ids, values, n, feature, 0.5 * (ref[i] + other[j]), sign * (other[j] - ref[i]) / best, best
    )


@numba.njit(cache=True, fastmath=False)
def _boxes(center_a, A, half_a, center_b, B, half_b, margin, ids, values, n):  # type: ignore[no-untyped-def]
    """Write contacts of two boxes: by the axis of largest separation among 15, a clipped face or
    two edges."""
    apart, size, grazes = center_a - center_b, half_a.sum() + half_b.sum(), False
    face, edge_i, edge_j, best, most, edge_best = (
        np.int64(-1),
        np.int64(0),
        np.int64(0),
        -np.inf,
        -np.inf,
        -np.inf,
    )
    for k in range(6):
        m = A[:, k].copy() if k < 3 else B[:, k - 3].copy()
        separation = abs(np.sum(apart * m)) - _reach(A, half_a, m) - _reach(B, half_b, m)
        most, grazes = max(most, separation), grazes or abs(separation) <= GRAZE * size
        parallel = 0 <= face < 3 <= k and abs(np.sum(A[:, face] * m)) > FACES_COSINE
        lead = FACE_SHARE if parallel else TIE
        if face < 0 or separation > best + lead * size:
            face, best = k, separation
    for i in range(3):
        for j in range(3):
            m = np.cross(A[:, i].copy(), B[:, j].copy())
            length = np.sqrt(np.sum(m * m))
            if length >= PARALLEL:
                m = m / length
                separation = abs(np.sum(apart * m)) - _reach(A, half_a, m) - _reach(B, half_b, m)
                if separation > edge_best:
                    edge_i, edge_j, edge_best = i, j, separation
    if max(most, edge_best) > margin or (grazes and most > GRAZE * size):
        return n
    if edge_best > most + EDGE_SHARE * abs(most) + ROUNDING * size:
        return _two_edges(
            center_a, A, half_a, edge_i, center_b, B, half_b, edge_j, edge_best, ids, values, n
        )
    if face < 3:
        return _clipped_face(
            center_a, A, half_a, face, center_b, B, half_b, -1.0, best, margin, ids, values, n
        )
    return _clipped_face(
        center_b, B, half_b, face - 3, center_a, A, half_a, 1.0, best, margin, ids, values, n
    )


@numba.njit(cache=True, fastmath=False)
def _reach(axes, half, m):  # type: ignore[no-untyped-def]
    """Return half the extent of a box along m."""
    return np.sum(half * np.abs(_along(axes, m)))


@numba.njit(cache=True, fastmath=False)
def _two_edges(center_a, A, half_a, i, center_b, B, half_b, j, gap, ids, values, n):  # type: ignore[no-untyped-def]
    """Write one contact midway between the closest points of two edges."""
    u, w = A[:, i].copy(), B[:, j].copy()
    m = np.cross(u, w)
    m = m / np.sqrt(np.sum(m * m))
    if np.sum(m * (center_a - center_b)) < 0.0:
        m = -m
    x, y, number_a, number_b = center_a.copy(), center_b.copy(), 0, 0
    for k in range(3):
        if k != i:
            side = np.sum(A[:, k] * m) < 0.0
            x, number_a = (
                x + (half_a[k] if side else -half_a[k]) * A[:, k],
                2 * number_a + int(side),
            )
        if k != j:
            side = np.sum(B[:, k] * m) > 0.0
            y, number_b = (
                y + (half_b[k] if side else -half_b[k]) * B[:, k],
                2 * number_b + int(side),
            )
    cosine, along_u, along_w = np.sum(u * w), np.sum((x - y) * u), np.sum((x - y) * w)
    s = (cosine * along_w - along_u) / (1.0 - cosine**2)
    t = (along_w - cosine * along_u) / (1.0 - cosine**2)
    s, t = min(max(s, -half_a[i]), half_a[i]), min(max(t, -half_b[j]), half_b[j])
    point = 0.5 * (x + s * u + y + t * w)
    return _store(ids, values, n, _feature(2, 4 * i + number_a, 4 * j + number_b), point, m, gap)


@numba.njit(cache=True, fastmath=False)
def _clipped_face(  # type: ignore[no-untyped-def]
    center, axes, half, face, center_o, axes_o, half_o, sign, separation, margin, ids, values, n
):
    """Write the corners of the incident face clipped to the reference face (four at most); sign 1
    if that is b's."""
    apart, k1, k2 = center_o - center, (face + 1) % 3, (face + 2) % 3
    m, u, w = axes[:, face].copy(), axes[:, k1].copy(), axes[:, k2].copy()
    outward = np.sum(apart * m) >= 0.0
    if not outward:
        m = -m
    over = _along(axes_o, m)
    facing = int(np.argmax(np.abs(over)))
    i1, i2, side = (facing + 1) % 3, (facing + 2) % 3, -1.0 if over[facing] > 0.0 else 1.0
    middle = apart + side * half_o[facing] * axes_o[:, facing] - half[face] * m
    patch, lines, length = np.empty((16, 3)), np.empty((16, 2), np.int64), np.int64(4)
    # around the incident face; a corner lies on two of its edges, numbered 0 to 3
    for c, (along, across) in enumerate(((1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0))):
        x = middle + along * half_o[i1] * axes_o[:, i1] + across * half_o[i2] * axes_o[:, i2]
        patch[c, 0], patch[c, 1], patch[c, 2] = np.sum(x * u), np.sum(x * w), np.sum(x * m)
        lines[c, 0], lines[c, 1] = (c + 3) % 4, c
    deepest = patch[int(np.argmin(patch[:4, 2]))].copy()
    for border in range(4):  # cut off what lies beyond x = ±half[k1], y = ±half[k2]
        limit = half[k1] if border < 2 else half[k2]
        length = _cut(patch, lines, length, border // 2, 1.0 - 2.0 * (border % 2), limit, border)
    start, faces = n, (2 * face + int(outward)) * 6 + 2 * facing + int(side > 0.0)
    for c in range(length):
        gap, nearest = patch[c, 2], np.inf  # to an earlier corner, which can lie at the same place
        for i in range(c):
            nearest = min(nearest, np.abs(patch[i] - patch[c]).max())
        if gap <= margin and nearest > ROUNDING * (half.sum() + half_o.sum()):
            low, high = min(lines[c, 0], lines[c, 1]), max(lines[c, 0], lines[c, 1])
            feature = _feature(0 if sign > 0.0 else 1, faces, 10 * low + high)
            point = center + half[face] * m + patch[c, 0] * u + patch[c, 1] * w + 0.5 * gap * m
            n = _store(ids, values, n, feature, point, sign * m, gap)
    if n == start:
        x, y = min(max(deepest[0], -half[k1]), half[k1]), min(max(deepest[1], -half[k2]), half[k2])
        point = center + half[face] * m + x * u + y * w + 0.5 * separation * m
        return _store(
            ids, values, n, _feature(0 if sign > 0.0 else 1, faces, 99), point, sign * m, separation
        )
    return _widest(ids, values, start, n, m) if n - start > MOST_POINTS else n


@numba.njit(cache=True, fastmath=False)
def _cut(patch, lines, length, axis, sign, limit, border):  # type: ignore[no-untyped-def]
    """Clip a polygon in place to sign x[axis] <= limit; return its number of corners. The border is
    line 4 + border."""
    old, tags, found = patch[:length].copy(), lines[:length].copy(), 0
    for c in range(length):
        d = (c + 1) % length
        before, after = sign * old[c, axis] - limit, sign * old[d, axis] - limit
        if before <= 0.0:
            patch[found], lines[found] = old[c], tags[c]
            found += 1
        if (before < 0.0 < after) or (after < 0.0 < before):
            shared = tags[c, 1]  # the edge from corner c to the next
            patch[found] = old[c] + before / (before - after) * (old[d] - old[c])
            patch[found, axis] = sign * limit
            lines[found, 0], lines[found, 1] = (
                (shared, 4 + border) if before < 0.0 else (4 + border, shared)
            )
            found += 1
    return found


@numba.njit(cache=True, fastmath=False)
def _widest(ids, values, start, n, m):  # type: ignore[no-untyped-def]
    """Keep the deepest contact, the one farthest from it, and the farthest on each side of the line
    through both."""
    chosen = np.empty(MOST_POINTS, np.int64)
    chosen[0] = start + int(np.argmin(values[start:n, 6]))
    x, best = values[chosen[0], :3].copy(), -1.0
    for i in range(start, n):
        distance = np.sum((values[i, :3] - x) ** 2)
        if distance > best:
            chosen[1], best = i, distance
    line = np.cross(m, values[chosen[1], :3] - x)
    for rank, side in ((2, 1.0), (3, -1.0)):
        best = -np.inf
        for i in range(start, n):
            reach = side * np.sum(line * (values[i, :3] - x))
            if reach > best and i != chosen[0] and i != chosen[1] and (rank == 2 or i != chosen[2]):
                chosen[rank], best = i, reach
    kept, numbers = values[chosen].copy(), ids[chosen].copy()
    values[start : start + MOST_POINTS], ids[start : start + MOST_POINTS] = kept, numbers
    return start + MOST_POINTS

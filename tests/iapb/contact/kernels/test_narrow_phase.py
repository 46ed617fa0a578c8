"""Every kind of pair: where contacts begin, full buffers, shapes off their origin; polygons written out in numpy."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.compiled import block
from iapb.contact.geometry import (
    Circle,
    HalfPlane,
    HalfSpace,
    Polygon,
    SpatialBox,
    Sphere,
    box,
    make_contact_buffer,
    make_shapes,
    make_spatial_shapes,
)
from iapb.contact.kernels.narrow_phase import (
    circle_polygon,
    circles,
    detect,
    height_at,
    polygons,
    vertices_half_plane,
)
from iapb.contact.kernels.spatial_pairs import boxes, spatial_pair

Pose = tuple[np.ndarray, np.ndarray]
GROUND, FLOOR = HalfPlane((0.0, 0.0), (0.0, 1.0)), HalfSpace((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
SQUARE, CUBE = box((2.0, 2.0), body=1), SpatialBox([2.0, 2.0, 2.0], body=1)
# (shape a, shape b, place of a, gap, contacts): all numbers are binary, so that the gap is exact.
EXACT: list[tuple[Any, Any, tuple[float, float, float], float, int]] = [
    (Circle(0.5), GROUND, (0.0, 1.0, 0.0), 0.5, 1),
    (box((1.0, 1.0)), GROUND, (0.0, 1.0, 0.0), 0.5, 2),
    (Circle(0.5), Circle(0.25, body=1), (0.0, 2.0, 0.0), 1.25, 1),
    (Circle(0.5), Circle(0.25, body=1), (-1.5, 2.0, 0.0), 1.75, 1),
    (Circle(0.5), SQUARE, (0.25, 2.0, 0.0), 0.5, 1),
    (Circle(1.0), SQUARE, (4.0, 5.0, 0.0), 4.0, 1),
    (box((1.0, 1.0)), SQUARE, (0.25, 2.0, 0.0), 0.5, 2),
    (box((1.0, 1.0)), SQUARE, (-4.5, 5.5, 0.0), 5.0, 1),
    (Sphere(0.5), FLOOR, (0.0, 0.0, 1.0), 0.5, 1),
    (SpatialBox([1.0, 2.0, 0.5]), FLOOR, (0.0, 0.0, 1.0), 0.75, 4),
    (Sphere(0.5), Sphere(0.25, body=1), (1.0, -2.0, 2.0), 2.25, 1),
    (Sphere(0.5), CUBE, (0.25, 0.5, -2.0), 0.5, 1),
    (Sphere(1.0), CUBE, (3.0, -4.0, 7.0), 6.0, 1),
    (SpatialBox([1.0, 1.0, 1.0]), CUBE, (0.25, 2.0, 0.25), 0.5, 4),
]


def on(body: int, shape: Any) -> Any:
    return type(shape)(**{**shape.__dict__, "body": body})


def arrays_of(*shapes: Any) -> Any:
    spatial = isinstance(shapes[0], Sphere | SpatialBox)
    return block(make_spatial_shapes(shapes) if spatial else make_shapes(shapes))


def placed(*places: Any) -> tuple[np.ndarray, np.ndarray]:
    return np.array([np.eye(3)] * len(places)), np.array(places, float)


def found(shapes: Any, R: np.ndarray, p: np.ndarray, margin: float, room: int = 64, pairs: Any = ((0, 1),)) -> Any:
    buffer: Any = block(make_contact_buffer(room))
    return detect(shapes, np.array(pairs, np.int32), R, p, margin, buffer), buffer


@pytest.mark.parametrize(("a", "b", "place", "gap", "number"), EXACT)
@pytest.mark.parametrize("swapped", [False, True])
def test_a_gap_of_the_margin_is_kept_and_the_next_number_is_not(
    a: Any, b: Any, place: Any, gap: float, number: int, swapped: bool
) -> None:
    endless = isinstance(b, HalfPlane | HalfSpace)
    shapes, poses = arrays_of(on(0, a), b), placed(place, np.zeros(3))
    pair = ((1, 0),) if swapped and not endless else ((0, 1),)
    count, buffer = found(shapes, *poses, gap, pairs=pair)
    assert count == number
    assert buffer.gap[:count] == pytest.approx([gap] * number, abs=0.0)
    assert found(shapes, *poses, math.nextafter(gap, 0.0), pairs=pair)[0] == 0


@pytest.mark.parametrize(("a", "b", "place", "gap", "number"), EXACT)
def test_a_full_buffer_is_told_by_minus_one_and_an_exact_fit_is_none(
    a: Any, b: Any, place: Any, gap: float, number: int
) -> None:
    """Also behind a pair that is far away, and before another pair."""
    shapes, poses = arrays_of(on(0, a), b, on(2, a)), placed(place, np.zeros(3), (0.0, 100.0, 100.0))
    for pairs, all_of_them in ((((2, 1), (0, 1)), number), (((0, 1), (0, 1)), 2 * number)):
        assert found(shapes, *poses, gap, all_of_them, pairs)[0] == all_of_them
        for room in range(1, all_of_them):
            assert found(shapes, *poses, gap, room, pairs)[0] == -1
    kernel, extra = kernel_of(a, b)
    full: Any = block(make_contact_buffer(1))
    assert kernel(shapes, 0, 1, *extra, *poses, gap, full, 1) == -1


def test_what_can_touch_at_one_place_only_is_feature_zero_and_a_corner_is_its_own() -> None:
    still = placed((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    for swapped, normal in ((False, [0.0, 1.0, 0.0]), (True, [0.0, -1.0, 0.0])):
        pair = ((1, 0),) if swapped else ((0, 1),)
        _, buffer = found(arrays_of(Circle(0.5, body=0), Circle(0.25, body=1)), *still, 0.0, pairs=pair)
        assert buffer.feature[0] == 0 and buffer.normal[0].tolist() == normal
    corners = np.array([[0.0, 0.0], [2.0, -0.5], [3.0, 1.0], [1.0, 2.0]])
    count, buffer = found(arrays_of(Polygon(corners, 0), HalfPlane((0.5, 0.25), (0.0, 1.0))), *still, 5.0)
    assert count == 4 and [int(feature) for feature in buffer.feature[:4]] == [k << 20 for k in range(4)]
    assert buffer.gap[:4].tolist() == (corners[:, 1] - 0.25).tolist()


def kernel_of(a: Any, b: Any) -> tuple[Any, tuple[bool, ...]]:
    if isinstance(a, Sphere | SpatialBox):
        return (boxes if isinstance(a, SpatialBox) and isinstance(b, SpatialBox) else spatial_pair), ()
    if isinstance(b, HalfPlane):
        return vertices_half_plane, ()
    if isinstance(a, Circle):
        return (circles, ()) if isinstance(b, Circle) else (circle_polygon, (True,))
    return polygons, ()


# --- shapes off their body's origin ----------------------------------------------------------------------------


def planar_pose(rng: np.random.Generator, spread: float) -> Pose:
    cos, sin = np.cos(angle := rng.uniform(-np.pi, np.pi)), np.sin(angle)
    return np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1.0]]), np.array([*rng.uniform(-spread, spread, 2), 0.0])


def spatial_pose(rng: np.random.Generator, spread: float) -> Pose:
    axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return axes * np.sign(np.linalg.det(axes)), rng.uniform(-spread, spread, 3)


def standing_off(shape: Any, offset: Pose, body: int) -> Any:
    """The shape, given about the origin, at an offset in the frame of its body."""
    R, p = offset
    match shape:
        case Circle():
            return Circle(shape.radius, R[:2, :2] @ np.array(shape.center) + p[:2], body)
        case Polygon():
            return Polygon(np.asarray(shape.vertices) @ R[:2, :2].T + p[:2], body)
        case HalfPlane():
            return HalfPlane(R[:2, :2] @ np.array(shape.point) + p[:2], R[:2, :2] @ np.array(shape.normal), body)
        case Sphere():
            return Sphere(shape.radius, R @ np.array(shape.center) + p, body)
        case SpatialBox():
            return SpatialBox(shape.size, p, R, body)
        case _:
            return HalfSpace(R @ np.array(shape.point) + p, R @ np.array(shape.normal), body)


def moved_by(pose: Pose, offset: Pose) -> Pose:
    return pose[0] @ offset[0], pose[1] + pose[0] @ offset[1]


PLANAR = [Circle(0.3), box((0.5, 0.4)), GROUND]
SPATIAL = [Sphere(0.3), SpatialBox([0.5, 0.4, 0.6]), FLOOR]


@pytest.mark.parametrize("a", [0, 1])
@pytest.mark.parametrize("b", [0, 1, 2])
@pytest.mark.parametrize("spatial", [False, True])
def test_a_shape_at_an_offset_touches_as_one_at_the_origin_of_a_moved_body(a: int, b: int, spatial: bool) -> None:
    """On two bodies, and with b fixed in the static world: contacts come from world places alone."""
    rng = np.random.default_rng(8)
    kinds, pose = (SPATIAL, spatial_pose) if spatial else (PLANAR, planar_pose)
    touching = 0
    for _ in range(25):
        poses, offsets = [pose(rng, 0.3) for _ in range(2)], [pose(rng, 0.4) for _ in range(2)]
        whole = [moved_by(pose, offset) for pose, offset in zip(poses, offsets, strict=True)]
        R, p = (np.ascontiguousarray(np.array(part)) for part in zip(*whole, strict=True))
        count, plain = found(arrays_of(on(0, kinds[a]), on(1, kinds[b])), R, p, 0.2)
        touching += count > 0
        on_two = arrays_of(standing_off(kinds[a], offsets[0], 0), standing_off(kinds[b], offsets[1], 1))
        on_world = arrays_of(standing_off(kinds[a], offsets[0], 0), standing_off(kinds[b], whole[1], -1))
        R, p = (np.ascontiguousarray(np.array(part)) for part in zip(*poses, strict=True))
        for shapes, body_b in ((on_two, 1), (on_world, -1)):
            same, other = found(shapes, R, p, 0.2)
            assert same == count
            for name in ("point", "normal", "gap", "feature", "shape_a", "shape_b", "body_a"):
                wanted = getattr(plain, name)[:count]
                assert getattr(other, name)[:count] == pytest.approx(wanted, abs=1e-13), name
            assert list(other.body_b[:count]) == [body_b] * count
    assert touching > 3


@pytest.mark.parametrize("a", [0, 1])
@pytest.mark.parametrize("b", [0, 1, 2])
@pytest.mark.parametrize("spatial", [False, True])
@pytest.mark.parametrize("factor", [2.0**-40, 2.0**40])
def test_the_unit_of_length_changes_no_bit(a: int, b: int, spatial: bool, factor: float) -> None:
    """Metres, picometres, or light minutes: a power of two rounds nothing, and no length is built in."""
    rng = np.random.default_rng(10)
    kinds, pose = (SPATIAL, spatial_pose) if spatial else (PLANAR, planar_pose)
    plain, scaled = (arrays_of(on(0, kinds[a]), on(1, kinds[b])), arrays_of(longer(kinds[a], factor, 0),
                                                                            longer(kinds[b], factor, 1)))
    touching = 0
    for _ in range(25):
        R, p = (np.ascontiguousarray(np.array(part)) for part in zip(*(pose(rng, 0.5) for _ in range(2)), strict=True))
        count, one = found(plain, R, p, 0.2)
        same, other = found(scaled, R, factor * p, factor * 0.2)
        assert same == count
        touching += count
        for name, size in (("point", factor), ("gap", factor), ("normal", 1.0), ("feature", 1)):
            np.testing.assert_array_equal(getattr(other, name)[:count], size * getattr(one, name)[:count])
    assert touching > 0


def longer(shape: Any, factor: float, body: int) -> Any:
    """The same shape in another unit of length."""
    lengths = {"radius", "center", "vertices", "size", "point"} & set(shape.__dict__)
    return on(body, type(shape)(**{**shape.__dict__, **{n: factor * np.asarray(getattr(shape, n)) for n in lengths}}))


# --- a ball and a box, written out -----------------------------------------------------------------------------


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_ball_touches_the_nearest_point_of_a_box_and_names_the_side_it_is_on(dimension: int) -> None:
    """Outside: nearest point = coordinates cut to the box. Inside: out through the nearest face."""
    rng, regions = np.random.default_rng(9), set()
    half, radius = np.array([0.3, 0.2, 0.4])[:dimension], 0.15
    for _ in range(300):
        R, p = (planar_pose if dimension == 2 else spatial_pose)(rng, 0.1)
        local = rng.uniform(-2.0, 2.0, dimension) * half
        center = np.zeros(3)
        center[:] = p + R[:, :dimension] @ local
        ball = Circle(radius, body=0) if dimension == 2 else Sphere(radius, body=0)
        brick = box(2.0 * half, body=1) if dimension == 2 else SpatialBox(2.0 * half, body=1)
        nearest = np.clip(local, -half, half)
        if inside := bool(np.all(nearest == local)):
            k = int(np.argmax(np.abs(local) - half))
            normal = np.eye(dimension)[k] * (1.0 if local[k] >= 0.0 else -1.0)
            distance = abs(local[k]) - half[k]
        else:
            distance = float(np.linalg.norm(local - nearest))
            normal = (local - nearest) / distance
        count, buffer = found(arrays_of(ball, brick), np.array([np.eye(3), R]), np.array([center, p]), 10.0)
        assert count == 1
        assert buffer.gap[0] == pytest.approx(distance - radius, abs=1e-14)
        world_normal = R[:, :dimension] @ normal
        assert buffer.normal[0] == pytest.approx(world_normal, abs=1e-13)
        between = center - (radius + 0.5 * (distance - radius)) * world_normal
        assert buffer.point[0] == pytest.approx(between, abs=1e-14)
        regions.add((int(buffer.feature[0]), tuple(np.sign(np.where(np.abs(normal) > 1e-9, normal, 0.0)))))
        swapped, other = found(arrays_of(on(0, brick), on(1, ball)), np.array([R, np.eye(3)]),
                               np.array([p, center]), 10.0)
        assert swapped == 1 and other.normal[0] == pytest.approx(-world_normal, abs=1e-13)
        assert inside or distance > 0.0
    assert len(regions) == len({feature for feature, _ in regions}) == len({side for _, side in regions})
    assert len(regions) == 3**dimension - 1


ROUNDING = 1e-12  # shapes and positions are of size 1
Corners = np.ndarray  # (n, 2) counter-clockwise


def random_polygon(rng: np.random.Generator) -> Corners:
    """Corners on an ellipse, at angles that leave no edge shorter than a few percent of it."""
    n = int(rng.integers(3, 7))
    angles = 2.0 * np.pi * (np.arange(n) + rng.uniform(0.0, 0.7, n)) / n
    return np.column_stack([rng.uniform(0.3, 1.0) * np.cos(angles), rng.uniform(0.3, 1.0) * np.sin(angles)])


def random_pose(rng: np.random.Generator, spread: float) -> tuple[np.ndarray, np.ndarray]:
    cos, sin = np.cos(angle := rng.uniform(-np.pi, np.pi)), np.sin(angle)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]), np.array([*rng.normal(size=2) * spread, 0.0])


def edges_of(corners: Corners) -> tuple[Corners, np.ndarray, np.ndarray]:
    """Direction, outward normal and length of each edge."""
    along = np.roll(corners, -1, axis=0) - corners
    length = np.linalg.norm(along, axis=1)
    direction = along / length[:, None]
    return direction, np.column_stack([direction[:, 1], -direction[:, 0]]), length


def separations(ref: Corners, other: Corners) -> np.ndarray:
    """Of each edge of `ref`: how far the nearest corner of `other` lies in front of it."""
    _, normals, _ = edges_of(ref)
    return np.array([((other - start) @ n).min() for start, n in zip(ref, normals, strict=True)])


def clipped(ref: Corners, other: Corners) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """(point, normal out of `ref`, gap) of both ends of the incident edge over the reference edge."""
    directions, normals, lengths = edges_of(ref)
    edge = int(np.argmax(separations(ref, other)))
    u, n, length = directions[edge], normals[edge], lengths[edge]
    incident = int(np.argmin(edges_of(other)[1] @ n))
    ends = np.array([other[incident], other[(incident + 1) % len(other)]]) - ref[edge]
    s, h = ends @ u, ends @ n
    if s[1] > length or s[0] < 0.0:
        return []
    inside = np.clip(s, 0.0, length)
    heights = [h[k] if s[k] == inside[k] else np.interp(inside[k], s[::-1], h[::-1]) for k in range(2)]
    return [(ref[edge] + place * u + 0.5 * high * n, n, high) for place, high in zip(inside, heights, strict=True)]


def closest_corners(ref: Corners, other: Corners) -> tuple[np.ndarray, np.ndarray, float]:
    apart = other[None, :] - ref[:, None]
    i, j = np.unravel_index(np.argmin(np.linalg.norm(apart, axis=2)), apart.shape[:2])
    gap = float(np.linalg.norm(apart[i, j]))
    return 0.5 * (ref[i] + other[j]), apart[i, j] / gap, gap


def expected(a: Corners, b: Corners, margin: float) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """(point, normal from b into a, gap) of each contact."""
    best_a, best_b = separations(a, b).max(), separations(b, a).max()
    (ref, other, sign) = (b, a, 1.0) if best_b >= best_a else (a, b, -1.0)
    found = clipped(ref, other)
    if not found or min(gap for *_, gap in found) - max(best_a, best_b) > 1e-10:
        found = [closest_corners(ref, other)]
    return [(point, sign * normal, gap) for point, normal, gap in found if gap <= margin]


def scene(seed: int, spread: float, margin: float) -> tuple[list[Corners], Any, int]:
    """World corners of two polygons on two bodies, and their contacts."""
    rng = np.random.default_rng(seed)
    local, poses = [random_polygon(rng) for _ in range(2)], [random_pose(rng, spread) for _ in range(2)]
    shapes = block(make_shapes([Polygon(corners, body) for body, corners in enumerate(local)]))
    buffer: Any = block(make_contact_buffer(4))
    R, p = np.array([pose[0] for pose in poses]), np.array([pose[1] for pose in poses])
    count = detect(shapes, np.array([[0, 1]], np.int32), R, p, margin, buffer)
    return [corners @ R[k, :2, :2].T + p[k, :2] for k, corners in enumerate(local)], buffer, count


@pytest.mark.parametrize(("spread", "margin"), [(0.4, 0.0), (0.8, 0.2), (0.8, 5.0)])
def test_contacts_are_the_ends_of_the_clipped_edge_or_the_closest_corners(spread: float, margin: float) -> None:
    kinds = []
    for seed in range(120):
        (a, b), buffer, count = scene(seed, spread, margin)
        wanted = expected(a, b, margin)
        assert count == len(wanted)
        for i, (point, normal, gap) in enumerate(wanted):
            assert buffer.gap[i] == pytest.approx(gap, abs=ROUNDING)
            assert buffer.point[i] == pytest.approx([*point, 0.0], abs=ROUNDING)
            assert buffer.normal[i] == pytest.approx([*normal, 0.0], abs=ROUNDING)
            assert (buffer.shape_a[i], buffer.shape_b[i], buffer.body_a[i], buffer.body_b[i]) == (0, 1, 0, 1)
        kinds += [len(wanted)]
    assert {1, 2} <= set(kinds)


@pytest.mark.parametrize(("spread", "margin"), [(0.4, 0.0), (0.8, 5.0)])
def test_a_feature_names_the_corner_and_the_edge_that_the_contact_lies_between(spread: float, margin: float) -> None:
    """Kind 0: corner of a, edge of b; 1: corner of b, edge of a; 2: two corners. a is ½ gap along the normal away."""
    kinds = set()
    for seed in range(120):
        corners, buffer, count = scene(seed, spread, margin)
        features = [int(feature) for feature in buffer.feature[:count]]
        assert len(set(features)) == count
        for i, feature in enumerate(features):
            kind, corner, edge = feature >> 40, feature >> 20 & 0xFFFFF, feature & 0xFFFFF
            half = 0.5 * buffer.gap[i] * buffer.normal[i, :2]
            sides = [buffer.point[i, :2] + half, buffer.point[i, :2] - half]  # on a, on b
            vertex_of, edge_of = (1, 0) if kind == 1 else (0, 1)
            assert corners[vertex_of][corner] == pytest.approx(sides[vertex_of], abs=ROUNDING)
            if kind == 2:
                assert corners[1][edge] == pytest.approx(sides[1], abs=ROUNDING)
            else:
                start, n = corners[edge_of][edge], edges_of(corners[edge_of])[1][edge]
                assert (sides[edge_of] - start) @ n == pytest.approx(0.0, abs=ROUNDING)
            kinds.add(kind)
    assert kinds == ({0, 1} if margin == 0.0 else {0, 1, 2})


coordinate = st.floats(-3.0, 3.0)


@given(coordinate, coordinate, coordinate, coordinate)
def test_heights_lie_on_the_line_through_both_ends(s0: float, h0: float, s1: float, h1: float) -> None:
    assert height_at(s0, s0, h0, s1, h1) == h0
    if abs(s1 - s0) > 1e-3:
        middle = height_at(0.5 * (s0 + s1), s0, h0, s1, h1)
        assert middle == pytest.approx(0.5 * (h0 + h1), abs=1e-12)
        assert math.isclose(height_at(s1, s0, h0, s1, h1), h1, abs_tol=1e-12)
    assert height_at(s0 + 1.0, s0, h0, s0, h1) == h0  # upright

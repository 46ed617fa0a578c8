"""Planar shapes and narrow phase: the laws of geometry, judged by brute force and by symmetry."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from iapb.compiled import block
from iapb.contact.geometry import (
    Circle,
    HalfPlane,
    Polygon,
    Shapes,
    box,
    candidate_pairs,
    contact_capacity,
    make_contact_buffer,
    make_shapes,
)
from iapb.contact.kernels.narrow_phase import detect
from iapb.errors import ArgumentError


def test_pairs_put_the_moving_shape_first_and_the_half_plane_last():
    shapes = make_shapes([HalfPlane((0, 0), (0, 1)), box((1, 1), body=1), Circle(1.0, body=0), Circle(1.0)])
    pairs = {tuple(map(int, pair)) for pair in candidate_pairs(shapes)}
    assert pairs == {(1, 0), (2, 0), (2, 1), (1, 3), (2, 3)}
    assert {tuple(map(int, p)) for p in candidate_pairs(shapes, lambda a, b: b == -1)} == pairs - {(2, 1)}


@pytest.mark.parametrize(
    ("shape", "argument"),
    [
        (Circle(0.0), "shapes[0].radius"),
        (Circle(1.0, (math.nan, 0.0)), "shapes[0].center"),
        (HalfPlane((0, 0), (0, 0)), "shapes[0].normal"),
        (Polygon([[0, 0], [1, 0]]), "shapes[0].vertices"),
        (Polygon([[0, 0], [2, 0], [1, 0.5], [1, 2]]), "shapes[0].vertices"),
        (Polygon([[0, 0], [1, 1], [1, 0], [0, 1]]), "shapes[0].vertices"),
    ],
)
def test_shapes_that_are_none_are_refused_by_name(shape, argument):
    with pytest.raises(ArgumentError) as caught:
        make_shapes([shape])
    assert caught.value.argument == argument


def test_a_clockwise_polygon_is_turned_around():
    corners = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]]
    assert np.array_equal(make_shapes([Polygon(corners)]).vertices, corners[::-1])


ROUNDING = 1e-13  # shapes and positions are of size 1 to 3: a few hundred roundings
FAR = 100.0  # a margin that keeps every pair


def placements(*poses):
    """R (n, 3, 3) and p (n, 3) of planar poses (x, y, angle)."""
    R, p = np.zeros((len(poses), 3, 3)), np.zeros((len(poses), 3))
    for k, (x, y, angle) in enumerate(poses):
        cos, sin = math.cos(angle), math.sin(angle)
        R[k] = [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]
        p[k, :2] = x, y
    return R, p


def contacts(shapes: Shapes, pairs, poses, margin=0.0):
    """Contacts as a list of (feature, point, normal, gap), in buffer order."""
    buffer = block(make_contact_buffer(contact_capacity(shapes, pairs)))
    n = detect(block(shapes), pairs, *placements(*poses), margin, buffer)
    return [
        (int(buffer.feature[i]), buffer.point[i].copy(), buffer.normal[i].copy(), float(buffer.gap[i]))
        for i in range(n)
    ]


def regular_polygon(sides, radius, squeeze, body):
    angles = 2.0 * np.pi * np.arange(sides) / sides
    return Polygon(np.column_stack([radius * np.cos(angles), squeeze * radius * np.sin(angles)]), body)


coordinate = st.floats(-1.5, 1.5)
angle = st.floats(-math.pi, math.pi)
pose = st.tuples(coordinate, coordinate, angle)
size = st.floats(0.1, 1.0)
polygon = st.builds(regular_polygon, st.integers(3, 7), size, st.floats(0.3, 1.0), st.just(0))
circle = st.builds(lambda r, x, y: Circle(r, (x, y), 0), size, coordinate, coordinate)


def on_body(shape, body):
    return Circle(shape.radius, shape.center, body) if isinstance(shape, Circle) else Polygon(shape.vertices, body)


def outline(shape, pose):
    """World vertices of a polygon, or the centre of a circle, and the radius around them."""
    R, p = placements(pose)
    local = np.atleast_2d(shape.center if isinstance(shape, Circle) else shape.vertices)
    return local @ R[0, :2, :2].T + p[0, :2], shape.radius if isinstance(shape, Circle) else 0.0


def segment_distance(x, u, w):
    edge = w - u
    square = float(edge @ edge)
    t = 0.0 if square == 0.0 else min(max(float((x - u) @ edge) / square, 0.0), 1.0)
    return float(np.hypot(*(x - u - t * edge)))


def brute_distance(first, second):
    """Distance of two outlines that do not overlap: every vertex against every edge, both ways."""
    best = math.inf
    for these, those in ((first, second), (second, first)):
        for x in these:
            for k in range(len(those)):
                best = min(best, segment_distance(x, those[k - 1], those[k]))
    return best


def brute_overlap(first, second):
    """Penetration depth of two convex outlines: the smallest overlap of their shadows over all edge normals."""
    depth = math.inf
    for these in (first, second):
        for k in range(len(these)):
            edge = these[k] - these[k - 1]
            if edge @ edge > 0.0:
                normal = np.array([edge[1], -edge[0]]) / np.hypot(*edge)
                depth = min(depth, (first @ normal).max() - (second @ normal).min())
                depth = min(depth, (second @ normal).max() - (first @ normal).min())
    return depth


def signed_gap(a, pose_a, b, pose_b):
    (first, radius_a), (second, radius_b) = outline(a, pose_a), outline(b, pose_b)
    if len(first) == len(second) == 1:
        return float(np.hypot(*(first[0] - second[0]))) - radius_a - radius_b
    depth = brute_overlap(first, second)
    core = -depth if depth > 0.0 else brute_distance(first, second)
    return core - radius_a - radius_b


@given(st.one_of(polygon, circle), st.one_of(polygon, circle), pose, pose)
def test_smallest_gap_is_the_brute_force_distance(a, b, pose_a, pose_b):
    shapes = make_shapes([a, on_body(b, 1)])
    expected = signed_gap(a, pose_a, b, pose_b)
    found = contacts(shapes, np.array([[0, 1]], np.int32), (pose_a, pose_b), FAR)
    assert min(gap for *_, gap in found) == pytest.approx(expected, abs=ROUNDING)
    assert bool(contacts(shapes, np.array([[0, 1]], np.int32), (pose_a, pose_b))) == (expected <= 0.0) or (
        abs(expected) < ROUNDING
    )


@given(size, size, st.floats(-1.0, 1.0), pose)
def test_boxes_in_line_touch_at_the_ends_of_the_edge_that_they_share(width, other_width, shift, pose):
    """One box on the other, however far it juts out: no contact lies beside either of them."""
    assume(abs(shift) < 0.49 * (width + other_width))
    shapes = make_shapes([box((width, 0.2), body=0), box((other_width, 0.2), body=1)])
    x, y, turn = pose
    along, up = np.array([math.cos(turn), math.sin(turn)]), np.array([-math.sin(turn), math.cos(turn)])
    above = (*(np.array([x, y]) + shift * along + (0.2 - 1e-3) * up), turn)
    found = contacts(shapes, np.array([[0, 1]], np.int32), (pose, above))
    places = sorted(float((point[:2] - [x, y]) @ along) for _, point, _, _ in found)
    ends = [max(-width, 2.0 * shift - other_width) / 2.0, min(width, 2.0 * shift + other_width) / 2.0]
    assert places == pytest.approx(ends, abs=ROUNDING)
    assert [gap for *_, gap in found] == pytest.approx([-1e-3, -1e-3], abs=ROUNDING)


@given(st.one_of(polygon, circle), st.one_of(polygon, circle), pose, pose)
def test_normal_is_unit_and_a_moving_along_it_by_the_gap_just_touches(a, b, pose_a, pose_b):
    shapes, pairs = make_shapes([a, on_body(b, 1)]), np.array([[0, 1]], np.int32)
    deepest = min(contacts(shapes, pairs, (pose_a, pose_b), FAR), key=lambda contact: contact[3])
    _, _, normal, gap = deepest
    assert np.linalg.norm(normal) == pytest.approx(1.0, abs=ROUNDING)
    moved = (pose_a[0] - gap * normal[0], pose_a[1] - gap * normal[1], pose_a[2])
    assert signed_gap(a, moved, b, pose_b) == pytest.approx(0.0, abs=1e-7)  # sqrt of rounding at a corner


@given(st.one_of(polygon, circle), st.one_of(polygon, circle), pose, pose)
def test_swapping_the_shapes_negates_the_normals_and_nothing_else(a, b, pose_a, pose_b):
    one_way = contacts(make_shapes([a, on_body(b, 1)]), np.array([[0, 1]], np.int32), (pose_a, pose_b), FAR)
    other_way = contacts(make_shapes([a, on_body(b, 1)]), np.array([[1, 0]], np.int32), (pose_a, pose_b), FAR)
    gaps = sorted(gap for *_, gap in one_way)
    assume(_one_reference(a, b, pose_a, pose_b))
    assert gaps == pytest.approx(sorted(gap for *_, gap in other_way), abs=ROUNDING)
    for _, point, normal, gap in one_way:
        assert any(
            np.allclose(point, q, atol=1e-9) and np.allclose(normal, -m, atol=1e-9) and abs(gap - g) < ROUNDING
            for _, q, m, g in other_way
        )


def _one_reference(a, b, pose_a, pose_b):
    """False where two axes tie or two centres nearly coincide: rounding then chooses among right answers."""
    (first, _), (second, _) = outline(a, pose_a), outline(b, pose_b)
    if len(first) == len(second) == 1 and np.hypot(*(first[0] - second[0])) < 1e-3:
        return False
    overlaps = []
    for these, those in ((first, second), (second, first)):
        for k in range(len(these)):
            edge = these[k] - these[k - 1]
            if edge @ edge > 0.0:
                normal = np.array([edge[1], -edge[0]]) / np.hypot(*edge)
                overlaps.append((those @ normal).min() - these[k] @ normal)
    overlaps.sort()
    return len(overlaps) < 2 or overlaps[-1] - overlaps[-2] > 1e-9


@given(st.one_of(polygon, circle), st.one_of(polygon, circle), pose, pose, pose)
def test_contacts_turn_and_move_with_the_world(a, b, pose_a, pose_b, motion):
    assume(_one_reference(a, b, pose_a, pose_b))
    shapes, pairs = make_shapes([a, on_body(b, 1)]), np.array([[0, 1]], np.int32)
    x, y, turn = motion
    Q = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])

    def moved(pose):
        return (*(Q @ np.array(pose[:2]) + (x, y)), pose[2] + turn)

    before = contacts(shapes, pairs, (pose_a, pose_b), FAR)
    after = contacts(shapes, pairs, (moved(pose_a), moved(pose_b)), FAR)
    assert [c[0] for c in before] == [c[0] for c in after]
    for (_, point, normal, gap), (_, point_moved, normal_moved, gap_moved) in zip(before, after, strict=True):
        assert point_moved[:2] == pytest.approx(Q @ point[:2] + (x, y), abs=1e-11)
        assert normal_moved[:2] == pytest.approx(Q @ normal[:2], abs=1e-11)
        assert gap_moved == pytest.approx(gap, abs=1e-11)


@given(st.one_of(polygon, circle), pose, st.tuples(coordinate, coordinate), angle)
def test_every_vertex_below_a_half_plane_is_a_contact(shape, pose_a, point, direction):
    normal = np.array([math.cos(direction), math.sin(direction)])
    shapes = make_shapes([shape, HalfPlane(point, 3.0 * normal)])
    found = contacts(shapes, np.array([[0, 1]], np.int32), (pose_a,))
    corners, radius = outline(shape, pose_a)
    heights = (corners - point) @ normal - radius
    assert len(found) == np.count_nonzero(heights <= 0.0) or np.abs(heights).min() < ROUNDING
    for _, where, n, gap in found:
        assert n[:2] == pytest.approx(normal, abs=ROUNDING)
        assert np.abs(heights - gap).min() < ROUNDING
        assert (where[:2] - point) @ normal == pytest.approx(0.5 * gap, abs=ROUNDING)  # midway: overlap halved


def test_flat_box_on_box_has_two_contacts_whichever_box_is_the_reference():
    pairs = np.array([[0, 1]], np.int32)
    shapes = make_shapes([box((1.0, 1.0), body=0), box((3.0, 1.0), body=1)])
    features = set()
    for tilt in (-1e-12, 1e-12):  # rounding decides which edge is the reference
        found = contacts(shapes, pairs, ((0.2, 0.99, tilt), (0.0, 0.0, 0.0)))
        assert sorted(c[1][0] for c in found) == pytest.approx([-0.3, 0.7], abs=1e-9)
        features.add(tuple(sorted(c[0] for c in found)))
    assert len(features) == 1


def test_corners_apart_meet_along_the_line_between_them():
    shapes = make_shapes([box((1.0, 1.0), body=0), box((1.0, 1.0), body=1)])
    poses = ((1.3, 1.4, 0.0), (0.0, 0.0, 0.0))
    ((_, point, normal, gap),) = contacts(shapes, np.array([[0, 1]], np.int32), poses, 1.0)
    assert gap == pytest.approx(0.5, abs=ROUNDING) and normal[:2] == pytest.approx([0.6, 0.8], abs=ROUNDING)
    assert point[:2] == pytest.approx([0.65, 0.7], abs=ROUNDING)
    assert not contacts(shapes, np.array([[0, 1]], np.int32), poses, 0.49)


def test_coincident_centres_give_a_finite_antisymmetric_normal():
    shapes = make_shapes([Circle(1.0, body=0), Circle(0.5, body=1)])
    ((_, _, normal, gap),) = contacts(shapes, np.array([[0, 1]], np.int32), ((0, 0, 0), (0, 0, 0)))
    ((_, _, swapped, _),) = contacts(shapes, np.array([[1, 0]], np.int32), ((0, 0, 0), (0, 0, 0)))
    assert gap == -1.5 and np.linalg.norm(normal) == 1.0 and np.array_equal(normal, -swapped)


def test_a_full_buffer_is_a_status_not_an_overrun():
    shapes = make_shapes([box((1.0, 1.0), body=0), HalfPlane((0.0, 5.0), (0.0, 1.0))])
    buffer = block(make_contact_buffer(3))
    assert detect(block(shapes), candidate_pairs(shapes), *placements((0, 0, 0)), 0.0, buffer) == -1

"""The contact set: clusters, coherence, groups and states obey what section III says."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.compiled import block
from iapb.contact.contacts import find_contacts
from iapb.contact.geometry import Circle, HalfPlane, Polygon, box, make_contact_buffer, make_shapes
from iapb.contact.kernels import contact_set
from iapb.errors import ArgumentError
from iapb.mechanics.mechanism import Body, Joint, Mechanism
from iapb.run import COLLIDING, FREE, RESTING

FLOOR, WALL = HalfPlane((0.0, 0.0), (0.0, 1.0)), HalfPlane((0.0, 0.0), (1.0, 0.0))
DOWN = (0.0, -1.0, 0.0)


def free_body(name="peg"):
    return Body(name, None, Joint("planar"), (np.eye(3), np.zeros(3)), 2.0, np.zeros(3), 0.005 * np.eye(3))


def free_bodies(count):
    return Mechanism([free_body(f"body {k}") for k in range(count)])


def written(points, normals, gaps=None, bodies=None):
    """A buffer with contacts as given, on body 0 against the world unless `bodies` says otherwise."""
    buffer = block(make_contact_buffer(max(len(points), 1)))
    for i, (point, normal) in enumerate(zip(points, normals, strict=True)):
        buffer.point[i, :2], buffer.normal[i, :2] = point, normal
        buffer.gap[i] = -1e-3 if gaps is None else gaps[i]
        buffer.body_a[i], buffer.body_b[i] = (0, -1) if bodies is None else bodies[i]
        buffer.feature[i], buffer.shape_b[i] = i, 1
    return buffer


coordinate = st.floats(-1.0, 1.0)
cloud = st.lists(st.tuples(coordinate, coordinate, st.floats(-0.1, 0.0)), min_size=1, max_size=12)


# --- clustering --------------------------------------------------------------------------------------------


@given(cloud, st.floats(0.01, 1.0))
def test_clusters_keep_deep_contacts_apart_and_drop_only_their_neighbours(cloud, distance):
    points, gaps = [c[:2] for c in cloud], [c[2] for c in cloud]
    buffer = written(points, [(0.0, 1.0)] * len(points), gaps)
    kept = contact_set.cluster(buffer, len(points), distance)
    stay = [int(f) for f in buffer.feature[:kept]]
    assert stay == sorted(stay)  # former order
    where = np.array(points)
    for i in stay:
        assert all(np.hypot(*(where[i] - where[j])) >= distance * (1 - 1e-12) for j in stay if j != i)
    for i in set(range(len(points))) - set(stay):
        near = [j for j in stay if np.hypot(*(where[i] - where[j])) < distance * (1 + 1e-12)]
        assert any(gaps[j] <= gaps[i] for j in near)


def test_clusters_do_not_join_floor_and_wall_nor_two_pairs_of_bodies():
    corner = written([(0, 0), (0, 0)], [(0, 1), (1, 0)])
    assert contact_set.cluster(corner, 2, 0.1) == 2
    bodies = written([(0, 0), (0, 0)], [(0, 1), (0, 1)], bodies=[(0, -1), (1, -1)])
    assert contact_set.cluster(bodies, 2, 0.1) == 2
    assert contact_set.cluster(written([(0, 0), (0, 0)], [(0, 1), (0, 1)]), 2, 0.1) == 1


def test_a_tilt_within_the_stated_angle_is_one_surface_and_beyond_it_two():
    limit = math.acos(contact_set.ALIGNED_COSINE)
    for angle, count in ((limit - 1e-6, 1), (limit + 1e-6, 2)):
        normals = [(0.0, 1.0), (math.sin(angle), math.cos(angle))]
        assert contact_set.cluster(written([(0, 0), (0, 0)], normals), 2, 0.1) == count


# --- temporal coherence --------------------------------------------------------------------------------------


def news(now, before, distance):
    contact_set.mark_new(now, len(now.gap), before, len(before.gap), distance)
    return list(map(bool, now.is_new))


def test_coherence_is_by_distance_on_one_surface_or_by_identity():
    before = written([(0.0, 0.0)], [(0.0, 1.0)])
    near, far = written([(0.05, 0.0)], [(0.0, 1.0)]), written([(0.2, 0.0)], [(0.0, 1.0)])
    for contact in (near, far):
        contact.feature[:] = 7
    assert news(near, before, 0.1) == [False] and news(far, before, 0.1) == [True]
    assert news(near, before, 0.0) == [True]  # coherence off: another feature is another contact
    far.feature[:] = 0
    assert news(far, before, 0.0) == [False] and news(far, before, 0.1) == [False]
    before.gap[:] = 1e-3
    assert news(near, before, 0.1) == [True]  # a gap was no contact


def test_a_corner_that_slides_along_the_floor_into_the_wall_is_a_new_contact():
    mechanism = Mechanism([free_body()])
    shapes = make_shapes([box((0.2, 0.1), body=0), FLOOR, WALL])
    sliding = find_contacts(mechanism, shapes, [0.1001, 0.0499, 0.0], [-0.1, 0.0, 0.0], coherence_distance=0.01)
    assert [int(b) for b in sliding.shape_b] == [1, 1]
    struck = find_contacts(
        mechanism, shapes, [0.0999, 0.0499, 0.0], [-0.1, 0.0, 0.0], sliding, coherence_distance=0.01
    )
    assert {int(s): bool(n) for s, n in zip(struck.shape_b, struck.is_new, strict=True)} == {1: False, 2: True}
    assert struck.state_names == ("colliding",)
    assert [int(s) for s, c in zip(struck.shape_b, struck.collides, strict=True) if c] == [2, 2]
    # The planted fault: without the test of the normals the wall would pass for the floor.
    buffer, honest = struck._buffer, int(struck.is_new.sum())
    contact_set.mark_new(buffer, len(struck), sliding._buffer, len(sliding), 0.01, -1.0)
    assert int(buffer.is_new[: len(struck)].sum()) < honest


def faceted_socket(facets):
    """Walls of a regular polygon's inside, radius 1 to the facets."""
    directions = 2.0 * np.pi * np.arange(facets) / facets
    return [HalfPlane((math.cos(t), math.sin(t)), (-math.cos(t), -math.sin(t))) for t in directions]


@pytest.mark.parametrize(("coherence", "false_collisions"), [(0.08, False), (0.0, True)])
def test_a_ball_rolling_in_a_faceted_socket_collides_falsely_only_without_coherence(coherence, false_collisions):
    """C18 in small: 1 mm deep along 24 facets, 32 mm a step; where two facets meet the point jumps 52 mm."""
    mechanism = Mechanism([free_body("ball")])
    shapes = make_shapes([Circle(0.2, body=0), *faceted_socket(24)])
    previous, new = None, 0
    for step in range(200):
        t = 2.0 * np.pi * step / 200
        center = 0.808 * np.array([math.cos(t), math.sin(t)])
        v = [-math.sin(t), math.cos(t), 0.0]
        previous = find_contacts(
            mechanism, shapes, [*center, 0.0], v, previous, cluster_distance=0.1, coherence_distance=coherence
        )
        assert len(previous) >= 1
        new += int(previous.is_new.sum()) if step else 0
    assert (new > 0) == false_collisions


# --- groups and states ---------------------------------------------------------------------------------------


def test_groups_link_moving_bodies_but_not_through_the_floor():
    mechanism = free_bodies(4)
    discs = [Circle(0.5, body=k) for k in range(4)]
    shapes = make_shapes([*discs, FLOOR])
    q = np.zeros(12)
    q[0::3], q[1::3] = [0.0, 5.0, 0.99, 1.98], 0.499  # 0 - 2 - 3 in a chain, 1 alone; all on the floor
    found = find_contacts(mechanism, shapes, q, np.zeros(12))
    assert list(found.group_of_tree) == [0, 1, 0, 0] and found.state_names == ("resting",) * 4


@given(st.lists(st.tuples(st.integers(0, 7), st.integers(0, 7)), max_size=12), st.randoms())
def test_groups_are_the_connected_components_in_any_order(links, random):
    links = [(a, b) for a, b in links if a != b]
    random.shuffle(links)
    buffer = written([(0, 0)] * len(links), [(0, 1)] * len(links), bodies=links)
    group = np.zeros(8, np.int64)
    trees = np.arange(8)
    contact_set.link_groups(buffer, len(links), trees, 3 * trees, 3 * trees + 3, group)
    expected = list(range(8))
    for _ in range(8):
        for a, b in links:
            expected[a] = expected[b] = min(expected[a], expected[b])
    assert list(group) == expected


def test_a_body_fixed_to_the_world_links_nothing():
    buffer = written([(0, 0), (0, 0)], [(0, 1), (0, 1)], bodies=[(0, 2), (1, 2)])
    group = np.zeros(3, np.int64)
    start, stop = np.array([0, 3, 6]), np.array([3, 6, 6])
    contact_set.link_groups(buffer, 2, np.arange(3), start, stop, group)
    assert list(group) == [0, 1, 2]


def classified(is_new, velocities, gaps, spreading=False):
    """State of one body with the given contacts, which of them collide, and whether spreading goes on."""
    n = len(is_new)
    buffer = written([(0.3 * i, 0) for i in range(n)], [(0, 1)] * n, gaps)
    buffer.is_new[:], buffer.normal_velocity[:] = is_new, velocities
    group, state, spread = np.zeros(1, np.int64), np.zeros(1, np.int8), np.array([spreading])
    one, three = np.zeros(1, np.int64), np.full(1, 3)
    contact_set.classify(buffer, n, one, one, three, 1e-3, spread, group, state)
    return int(state[0]), list(map(bool, buffer.collides)), bool(spread[0])


@pytest.mark.parametrize(
    ("is_new", "velocities", "gaps", "state", "collides"),
    [
        ([True], [-0.1], [-1e-4], COLLIDING, [True]),
        ([False], [-0.1], [-1e-4], RESTING, [False]),  # old contacts alone do not collide
        ([True, False], [-0.1, -0.2], [-1e-4] * 2, COLLIDING, [True, True]),  # but join a collision
        ([True, False], [-0.1, 0.2], [-1e-4] * 2, COLLIDING, [True, False]),  # if they approach
        ([True], [0.1], [-1e-4], RESTING, [False]),
        ([True], [-0.9e-3], [0.0], RESTING, [False]),  # slower than v_approach
        ([True], [-1.1e-3], [0.0], COLLIDING, [True]),
        ([True], [-0.1], [1e-4], FREE, [False]),  # a gap is no contact
    ],
)
def test_states_of_a_group(is_new, velocities, gaps, state, collides):
    assert classified(is_new, velocities, gaps)[:2] == (state, collides)


def test_spreading_keeps_a_group_colliding_until_nothing_approaches():
    assert classified([False], [-0.1], [-1e-4], spreading=True) == (COLLIDING, [True], True)
    assert classified([False], [0.1], [-1e-4], spreading=True) == (RESTING, [False], False)


def test_wrong_arguments_are_named():
    mechanism, shapes = Mechanism([free_body()]), make_shapes([Circle(0.1, body=0), FLOOR])
    for name, value in (("cluster_distance", -1.0), ("coherence_distance", math.nan), ("approach_velocity", -1.0)):
        with pytest.raises(ArgumentError) as caught:
            find_contacts(mechanism, shapes, np.zeros(3), np.zeros(3), **{name: value})
        assert caught.value.argument == name
    with pytest.raises(ArgumentError, match="q = "):
        find_contacts(mechanism, shapes, [0.0, 0.0], np.zeros(3))


def test_polygons_of_many_sides_fit_the_buffer():
    sides = 2.0 * np.pi * np.arange(40) / 40
    shapes = make_shapes([Polygon(np.column_stack([np.cos(sides), np.sin(sides)]), 0), FLOOR])
    assert len(find_contacts(Mechanism([free_body()]), shapes, [0.0, -5.0, 0.1], DOWN)) == 40


def test_naming_the_pairs_finds_their_contacts_alone():
    mechanism, shapes = free_bodies(2), make_shapes([box((1.0, 1.0), body=0), box((1.0, 1.0), body=1), FLOOR, WALL])
    q, v = [0.4, 0.4, 0.0, 1.2, 0.3, 0.0], np.zeros(6)
    everything = find_contacts(mechanism, shapes, q, v)
    found = {(a, b) for a, b in zip(everything.shape_a, everything.shape_b, strict=True)}
    assert len(found) >= 3
    for pairs in ([[0, 1], [0, 2], [0, 3], [1, 2]], [[0, 1], [0, 2]], [[0, 2]], []):
        some = find_contacts(mechanism, shapes, q, v, pairs=pairs)
        chosen = [(a, b) in {tuple(sorted(pair)) for pair in pairs} for a, b in zip(
            everything.shape_a, everything.shape_b, strict=True)]
        assert np.array_equal(some.gap, everything.gap[chosen])
        assert np.array_equal(some.point, everything.point[chosen])


def test_finding_contacts_collapses_those_closer_than_the_distance_given():
    """Corners of a box, 0.2 and 0.1 m apart, on a floor: both stay, or the deeper one."""
    mechanism, shapes = Mechanism([free_body()]), make_shapes([box((0.2, 0.1), body=0), FLOOR])
    for distance, count in ((0.0, 2), (0.19, 2), (0.21, 1)):
        found = find_contacts(mechanism, shapes, [0.0, 0.04, 0.01], np.zeros(3), cluster_distance=distance)
        assert len(found) == count
        assert found.gap.min() == pytest.approx(0.04 - 0.05 * math.cos(0.01) - 0.1 * math.sin(0.01))

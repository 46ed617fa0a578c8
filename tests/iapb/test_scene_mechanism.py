"""A scene as mechanism, shapes and candidate pairs."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.contact.geometry import CIRCLE, HALF_PLANE, POLYGON
from iapb.scene import Scene, scene_from_text
from iapb.scene.mechanism import mechanism_of, pairs_of, shapes_of, start_of

# A bracket on the world carries a chain of three links, the last with a welded tool; two pucks lie free.
CHAIN = scene_from_text("""\
name: chain
rate: 1000
duration: 1
bodies:
  - name: bracket
    joint: fixed
    origin: [1, 2]
    angle: 1.5707963267948966
    shapes: [{kind: circle, radius: 0.1, center: [3, 0]}]
  - {name: one, parent: bracket, joint: revolute, inertia: 1, shapes: [{kind: circle, radius: 0.1}]}
  - {name: two, parent: one, joint: revolute, inertia: 1, shapes: [{kind: circle, radius: 0.1}]}
  - {name: three, parent: two, joint: revolute, inertia: 1, shapes: [{kind: circle, radius: 0.1}]}
  - {name: tool, parent: three, joint: fixed, shapes: [{kind: box, size: [0.1, 0.2], center: [1, 0], angle: 0.3}]}
  - {name: puck, joint: planar, mass: 2, inertia: 3, shapes: [{kind: circle, radius: 0.1}]}
walls:
  - {name: floor, kind: half_plane, point: [0, 0], normal: [0, 2]}
contact: {self_collisions: true}
""")
BRACKET, ONE, TWO, THREE, TOOL, PUCK, FLOOR = range(7)  # shapes, in this order


def pairs(scene: Scene) -> set[frozenset[int]]:
    return {frozenset(map(int, pair)) for pair in pairs_of(scene, shapes_of(scene))}


def test_q_and_v_are_the_positions_and_velocities_in_the_order_of_the_bodies() -> None:
    scene = CHAIN.with_values({"bodies.two.position": [0.5], "bodies.puck.velocity": [1, 2, 3]})
    mechanism = mechanism_of(scene)
    q, v = start_of(scene)
    assert mechanism.names == tuple(body.name for body in scene.bodies)
    assert q.shape == (mechanism.nq,)
    assert v.shape == (mechanism.nv,)
    assert q[mechanism.coordinate_names.index("two.angle")] == 0.5
    np.testing.assert_array_equal(v[-3:], [1, 2, 3])


def test_free_planar_body_has_its_mass_and_moment_of_inertia() -> None:
    mass = mechanism_of(CHAIN).mass_matrix(start_of(CHAIN)[0])
    np.testing.assert_array_equal(mass[-3:, -3:], np.diag([2.0, 2.0, 3.0]))


def test_flat_bodies_are_physical_in_space() -> None:
    for body in mechanism_of(CHAIN).bodies:
        principal = np.diag(body.inertia)
        assert all(2.0 * principal[k] <= principal.sum() for k in range(3))  # triangle inequality
        assert (principal >= 0.0).all()


def test_prismatic_axis_lies_in_the_plane_and_has_length_one() -> None:
    scene = CHAIN.with_values(
        {"bodies.puck": {"name": "puck", "joint": "prismatic", "axis": [0, 5], "mass": 2}}
    )
    mechanism = mechanism_of(scene)
    q, _ = start_of(scene)
    step = np.zeros(mechanism.nv)
    step[-1] = 0.25
    moved = mechanism.placements(mechanism.integrate(q, step, 1.0))[1] - mechanism.placements(q)[1]
    np.testing.assert_allclose(moved[-1], [0.0, 0.25, 0.0], atol=1e-15)


def test_shapes_of_a_body_that_nothing_moves_are_static_and_in_world_axes() -> None:
    shapes = shapes_of(CHAIN)
    assert list(shapes.body) == [-1, 1, 2, 3, 4, 5, -1]
    assert list(shapes.kind) == [CIRCLE] * 4 + [POLYGON, CIRCLE, HALF_PLANE]
    np.testing.assert_allclose(
        shapes.vertices[shapes.first[BRACKET]], [1.0, 5.0], atol=1e-15
    )  # turned by 90°
    np.testing.assert_array_equal(shapes.vertices[shapes.first[FLOOR] + 1], [0.0, 1.0])


def test_box_of_a_moving_body_stays_in_body_axes() -> None:
    shapes = shapes_of(CHAIN)
    corners = shapes.vertices[shapes.first[TOOL] : shapes.first[TOOL] + 4]
    np.testing.assert_allclose(corners.mean(axis=0), [1.0, 0.0], atol=1e-15)
    edge = corners[1] - corners[0]
    assert np.arctan2(edge[1], edge[0]) == pytest.approx(0.3)
    assert np.hypot(*edge) == pytest.approx(0.1)


def test_moving_shapes_meet_walls_and_other_trees_neighbours_never_meet() -> None:
    expected = (
        *({link, FLOOR} for link in (ONE, TWO, THREE, TOOL, PUCK)),
        *({link, PUCK} for link in (BRACKET, ONE, TWO, THREE, TOOL)),
        # one tree: more than one joint apart; the tool is welded to link three
        {BRACKET, TWO}, {BRACKET, THREE}, {BRACKET, TOOL}, {ONE, THREE}, {ONE, TOOL},
    )  # fmt: skip
    assert pairs(CHAIN) == {frozenset(pair) for pair in expected}


def test_links_of_one_tree_meet_only_where_the_scene_asks_for_it() -> None:
    left = pairs(CHAIN) - pairs(CHAIN.with_values({"contact.self_collisions": False}))
    assert left == {
        frozenset(pair)
        for pair in ((BRACKET, TWO), (BRACKET, THREE), (BRACKET, TOOL), (ONE, THREE), (ONE, TOOL))
    }


def test_shape_a_of_a_pair_moves() -> None:
    shapes = shapes_of(CHAIN)
    assert (shapes.body[pairs_of(CHAIN, shapes)[:, 0]] >= 0).all()

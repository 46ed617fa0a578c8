"""Laws of the equations of motion, over random trees and on mechanisms small enough to know by
heart."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb import find_scene, load_scene
from iapb.errors import ArgumentError
from iapb.mechanics.mechanism import Body, Joint, Mechanism
from iapb.scene.mechanism import mechanism_of
from reference.random_mechanisms import random_mechanism, random_state

seeds = st.integers(0, 2**32 - 1)


def rod(name, parent, x, joint=None):
    inertia = np.diag([0.0, 1.0 / 12.0, 1.0 / 12.0])
    return Body(
        name, parent, joint or Joint("revolute"), (np.eye(3), (x, 0, 0)), 1.0, (0.5, 0, 0), inertia
    )


def two_link_arm():
    return Mechanism([rod("upper", None, 0.0), rod("lower", "upper", 1.0)])


WHEEL = Mechanism([rod("a", None, 0, Joint("continuous"))])


def test_results_belong_to_the_caller():
    arm = two_link_arm()
    rotations, positions = arm.placements([0.1, 0.2])
    before = rotations.copy(), positions.copy()
    arm.placements([1.0, -2.0])
    assert (rotations == before[0]).all() and (positions == before[1]).all()


def test_names_units_and_layout():
    ball = Body("ball", None, Joint("free_flyer"), mass=1.0, inertia=np.eye(3))
    wheel = Body("wheel", "ball", Joint("continuous", (0, 0, 2)), mass=1.0, inertia=np.eye(3))
    mechanism = Mechanism([ball, wheel, Body("ground", None, Joint("fixed"))])
    assert mechanism.coordinate_names[::4] == ("ball.x", "ball.qy", "wheel.sin")
    assert mechanism.coordinate_units == ("m",) * 3 + ("1",) * 6
    assert mechanism.velocity_units == ("m/s",) * 3 + ("rad/s",) * 4
    assert mechanism.velocity_names[2:5] == ("ball.z", "ball.rx", "ball.ry")
    assert mechanism.tree_dofs == [(0, 7), (7, 7)] and list(mechanism.tree_of_body) == [0, 0, 1]
    np.testing.assert_array_equal(mechanism.neutral(), [0, 0, 0, 0, 0, 0, 1, 1, 0])


@pytest.mark.parametrize(
    ("call", "named"),
    [
        (lambda: Joint("hinge"), "kind"),
        (
            lambda: Body("b", None, Joint("fixed"), (np.diag([1, 1, -1]), np.zeros(3))),
            "placement rotation",
        ),
        (lambda: Body("b", None, Joint("fixed"), inertia=np.triu(np.ones((3, 3)))), "inertia"),
        (lambda: Mechanism([rod("a", None, 0.0), rod("a", None, 0.0)]), "name"),
        (lambda: Mechanism([rod("a", None, 0), rod("b", None, 0), rod("c", "a", 0)]), "bodies"),
        (lambda: two_link_arm().bias([0.0, 0.0], [0.0, np.inf]), "v"),
        (lambda: two_link_arm().biases([[0.0, 0.0]] * 2, [[0.0, 0.0], [0.0, np.inf]]), r"vs\[1\]"),
        (lambda: two_link_arm().rows_along([[0.0, 0.0]], [9], [[0, 0, 0]], [[1, 0, 0]]), "bodies"),
        (lambda: WHEEL.mass_matrices([[1.0, 0.0], [1.0, 1.0]]), r"qs\[1\] of body 'a'"),
    ],
)
def test_errors_name_the_argument(call, named):
    with pytest.raises(ArgumentError, match=named):
        call()


@given(seeds, st.integers(0, 5))
def test_many_states_give_bit_for_bit_what_each_gives_alone_in_any_layout(
    seed: int, count: int
) -> None:
    rng = np.random.default_rng(seed)
    mechanism = random_mechanism(rng, 5)
    states = [random_state(rng, mechanism) for _ in range(count)]
    qs, vs = (
        np.array([state[i] for state in states]).reshape(count, -1 if count else n)
        for i, n in enumerate((mechanism.nq, mechanism.nv))
    )
    masses = np.array([mechanism.mass_matrix(q) for q in qs]).reshape(
        count, mechanism.nv, mechanism.nv
    )
    biases = np.array([mechanism.bias(q, v) for q, v in zip(qs, vs, strict=True)]).reshape(vs.shape)
    for layout in (np.asarray, np.asfortranarray, lambda rows: np.repeat(rows, 2, axis=1)[:, ::2]):
        np.testing.assert_array_equal(mechanism.mass_matrices(layout(qs)), masses)
        np.testing.assert_array_equal(mechanism.biases(layout(qs), layout(vs)), biases)


@pytest.mark.parametrize("name", ["arm_obstacles", "peg_hole_space", "arm_pushing"])
def test_rows_along_number_bodies_as_the_scene_does_where_some_do_not_move(name: str) -> None:
    """The kernels that need M alone leave out what is fixed to the world; contacts name bodies of
    the whole scene."""
    mechanism = mechanism_of(load_scene(find_scene(name)))
    q = mechanism.neutral()
    rng = np.random.default_rng(0)
    for body in range(len(mechanism.names)):
        point = rng.normal(size=3)
        along = rng.normal(size=3)
        [row] = mechanism.rows_along([q], [body], [point], [along])
        np.testing.assert_allclose(
            row, along @ mechanism.point_jacobian(q, body, point), atol=1e-13, rtol=1e-12
        )

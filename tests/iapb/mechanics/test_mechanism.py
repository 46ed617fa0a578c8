"""Laws of the equations of motion, over random trees and on mechanisms small enough to know by
heart."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iapb import find_scene, load_scene
from iapb.errors import ArgumentError
from iapb.mechanics.joints import KINDS
from iapb.mechanics.mechanism import Body, Joint, Mechanism
from iapb.scene.mechanism import mechanism_of
from reference.random_mechanisms import random_mechanism, random_state

FIELD = np.array([0.3, -9.0, 2.0])  # a gravity field along no axis
STEP = 1e-5  # of central differences: error STEP^2, rounding eps / STEP
moving_kinds = tuple(kind for kind in KINDS if kind != "fixed")
OFTEN_FIXED = (*KINDS, "fixed", "fixed", "fixed")
seeds = st.integers(0, 2**32 - 1)


def rod(name, parent, x, joint=None):
    inertia = np.diag([0.0, 1.0 / 12.0, 1.0 / 12.0])
    return Body(
        name, parent, joint or Joint("revolute"), (np.eye(3), (x, 0, 0)), 1.0, (0.5, 0, 0), inertia
    )


def two_link_arm():
    return Mechanism([rod("upper", None, 0.0), rod("lower", "upper", 1.0)])


WHEEL = Mechanism([rod("a", None, 0, Joint("continuous"))])


def test_the_arm_of_figure_2_has_its_textbook_mass_matrix_and_energy():
    arm = two_link_arm()
    for angle in (0.0, 0.4, 2.0):
        c = np.cos(angle)
        s = np.sin(angle)
        expected = np.array([[5 / 3 + c, 1 / 3 + c / 2], [1 / 3 + c / 2, 1 / 3]])
        np.testing.assert_allclose(arm.mass_matrix([1.1, angle]), expected, rtol=1e-14)
        u = 0.7
        w = -1.3
        expected = [-s * u * w - s * w * w / 2, s * u * u / 2]
        np.testing.assert_allclose(arm.bias([1.1, angle], [u, w]), expected, atol=1e-15)
    assert arm.kinetic_energy([np.pi / 2, 0.0], [1.0, 1.0]) == pytest.approx(7.0 / 3.0, rel=1e-15)


@settings(max_examples=40)
@given(seeds, st.integers(1, 10), st.integers(1, 3))
def test_mass_matrix_momenta_and_energy_are_sums_over_the_bodies(seed, joints, trees):
    """M = Σ m JᵀJ + JωᵀI Jω at the centres of mass; Σ m u and Σ I ω + (c − c̄) × m u, written out
    with numpy."""
    rng = np.random.default_rng(seed)
    mechanism = random_mechanism(rng, joints, OFTEN_FIXED, trees)
    q, v = random_state(rng, mechanism)
    rotations, positions = mechanism.placements(q)
    mass = np.zeros((mechanism.nv, mechanism.nv))
    centers = []
    momenta = []
    spins = []
    masses = []
    for b, body in enumerate(mechanism.bodies):
        center = positions[b] + rotations[b] @ body.center_of_mass
        moving = mechanism.point_jacobian(q, b, center)
        turning = mechanism.frame_jacobian(q, b)[3:]
        inertia = rotations[b] @ body.inertia @ rotations[b].T
        mass += body.mass * moving.T @ moving + turning.T @ inertia @ turning
        if moving.any() or turning.any():
            masses.append(body.mass)
            centers.append(center)
            momenta.append(body.mass * moving @ v)
            spins.append(inertia @ turning @ v)
    found = mechanism.mass_matrix(q)
    size = np.abs(mass).max(initial=0.0)
    np.testing.assert_allclose(found, mass, rtol=0.0, atol=1e-11 * size)
    outside = np.ones_like(mass, dtype=bool)
    for start, stop in mechanism.tree_dofs:
        outside[start:stop, start:stop] = False
    assert (found == found.T).all() and not found[outside].any()
    assert mechanism.kinetic_energy(q, v) == pytest.approx(0.5 * v @ mass @ v, rel=1e-9)
    tau = mass @ v + mechanism.bias(q, v) + mechanism.gravity(q, FIELD)
    np.testing.assert_allclose(
        mechanism.inverse_dynamics(q, v, v, FIELD), tau, atol=1e-10 * np.abs(tau).max(initial=0)
    )
    if masses:
        spins = np.sum(spins, axis=0) + np.sum(
            np.cross(centers - np.average(centers, 0, masses), momenta), axis=0
        )
        expected = [*np.sum(momenta, axis=0), *spins]
        np.testing.assert_allclose(
            mechanism.centroidal_momentum(q, v), expected, rtol=1e-9, atol=1e-9
        )


@settings(max_examples=30)
@given(seeds, st.integers(1, 8))
def test_jacobians_are_the_derivatives_of_positions(seed, joints):
    rng = np.random.default_rng(seed)
    mechanism = random_mechanism(rng, joints, moving_kinds)
    q, v = random_state(rng, mechanism)
    body = joints - 1
    rotations, positions = mechanism.placements(q)
    local = rng.normal(size=3)

    def place(h):
        there, origin = mechanism.placements(mechanism.integrate(q, v, h))
        return origin[body] + there[body] @ local, there[body]

    after, turned = place(STEP)
    before, unturned = place(-STEP)
    point = positions[body] + rotations[body] @ local
    jacobian = mechanism.point_jacobian(q, body, point)
    np.testing.assert_allclose(jacobian @ v, (after - before) / (2 * STEP), atol=1e-6, rtol=1e-6)
    along = rng.normal(size=3)
    rows = mechanism.rows_along([q, q], [-1, body], [point, point], [along, along])
    expected = [0.0 * v, along @ jacobian]
    np.testing.assert_allclose(rows, expected, atol=1e-13, rtol=1e-12)
    at_origin = mechanism.point_jacobian(q, body, positions[body])
    np.testing.assert_array_equal(mechanism.frame_jacobian(q, body)[:3], at_origin)
    spin = (turned - unturned) @ rotations[body].T / (2 * STEP)
    turning = mechanism.frame_jacobian(q, body)[3:] @ v
    np.testing.assert_allclose(turning, [spin[2, 1], spin[0, 2], spin[1, 0]], atol=1e-6, rtol=1e-6)


def test_a_copy_through_pickle_gives_the_same_numbers():
    mechanism = random_mechanism(np.random.default_rng(1), 5, moving_kinds)
    copy = pickle.loads(pickle.dumps(mechanism))
    q, v = random_state(np.random.default_rng(2), mechanism)
    np.testing.assert_array_equal(copy.mass_matrix(q), mechanism.mass_matrix(q))
    np.testing.assert_array_equal(copy.bias(q, v), mechanism.bias(q, v))


def test_results_belong_to_the_caller():
    arm = two_link_arm()
    rotations, positions = arm.placements([0.1, 0.2])
    before = rotations.copy(), positions.copy()
    arm.placements([1.0, -2.0])
    assert (rotations == before[0]).all() and (positions == before[1]).all()


def test_names_units_and_layout():
    ball = Body("ball", None, Joint("free_flyer"), mass=1.0, inertia=np.eye(3))
    wheel = Body("wheel", "ball", Joint("continuous", (0, 0, 2)), mass=1.0, inertia=np.eye(3))
    ground = Body("ground", None, Joint("fixed"))
    mechanism = Mechanism([ball, wheel, ground])
    assert (mechanism.nq, mechanism.nv) == (9, 7)
    assert mechanism.coordinate_names[:3] == ("ball.x", "ball.y", "ball.z")
    assert mechanism.coordinate_names[-2:] == ("wheel.cos", "wheel.sin")
    assert mechanism.coordinate_units == ("m",) * 3 + ("1",) * 6
    assert mechanism.velocity_units == ("m/s",) * 3 + ("rad/s",) * 4
    assert mechanism.velocity_names == (
        *(f"ball.{turn}" for turn in ("x", "y", "z", "rx", "ry", "rz")),
        "wheel.angle",
    )
    assert mechanism.tree_dofs == [(0, 7), (7, 7)] and list(mechanism.tree_of_body) == [0, 0, 1]
    np.testing.assert_array_equal(mechanism.neutral(), [0, 0, 0, 0, 0, 0, 1, 1, 0])


@pytest.mark.parametrize(
    ("call", "named"),
    [
        (lambda: Joint("hinge"), "kind"),
        (lambda: Joint("revolute", (0, 0, 0)), "axis"),
        (lambda: Body("b", None, Joint("fixed"), mass=-1.0), "mass"),
        (lambda: Body("b", None, Joint("fixed"), mass=float("nan")), "mass"),
        (
            lambda: Body("b", None, Joint("fixed"), (np.diag([1, 1, -1]), np.zeros(3))),
            "placement rotation",
        ),
        (lambda: Body("b", None, Joint("fixed"), inertia=np.triu(np.ones((3, 3)))), "inertia"),
        (lambda: Mechanism([rod("a", "b", 0.0)]), "parent"),
        (lambda: Mechanism([rod("a", None, 0.0), rod("a", None, 0.0)]), "name"),
        (lambda: Mechanism([rod("a", None, 0), rod("b", None, 0), rod("c", "a", 0)]), "bodies"),
        (lambda: two_link_arm().mass_matrix([0.0]), "q"),
        (lambda: two_link_arm().mass_matrix([["a", "b"]]), "q"),
        (lambda: two_link_arm().mass_matrices([[0.0]]), "qs"),
        (lambda: two_link_arm().bias([0.0, 0.0], [0.0, np.inf]), "v"),
        (
            lambda: two_link_arm().biases([[0.0, 0.0]], [[0.0, 0.0], [0.0, np.inf]]),
            "as many rows as qs",
        ),
        (lambda: two_link_arm().biases([[0.0, 0.0]] * 2, [[0.0, 0.0], [0.0, np.inf]]), r"vs\[1\]"),
        (
            lambda: two_link_arm().energies([[0.0, 0.0]] * 2, [[0.0, 0.0]], [0.0] * 3),
            "as many rows as qs",
        ),
        (lambda: two_link_arm().point_jacobian([0.0, 0.0], "hand", [0, 0, 0]), "body"),
        (lambda: two_link_arm().rows_along([[0.0, 0.0]], [9], [[0, 0, 0]], [[1, 0, 0]]), "bodies"),
        (
            lambda: two_link_arm().rows_along([[0.0, 0.0]], [0, 1], [[0, 0, 0]], [[1, 0, 0]]),
            "as many as qs",
        ),
        (lambda: WHEEL.mass_matrix([1.0, 1.0]), "q of body 'a'"),
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

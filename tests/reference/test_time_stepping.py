"""One rigid step: what it must satisfy, and what it does where the answer is known by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.contact.geometry import (
    HalfPlane,
    box,
    candidate_pairs,
    contact_capacity,
    make_contact_buffer,
    make_shapes,
)
from iapb.errors import ArgumentError, SolverError
from iapb.mechanics.mechanism import Body, Joint, Mechanism
from iapb.run import COLLIDING, FREE, RESTING
from iapb.scene.mechanism import Frictions
from reference import rigid_step as stepping
from reference.rigid_step import NEWTON, POISSON, rigid_step, velocity_bounds
from reference.time_stepping import RigidConstraints

DT = 1.0 / 512


def step(mass, v, f, rows, gap, e):  # type: ignore[no-untyped-def]
    rows, v = np.atleast_2d(np.asarray(rows, float)), np.asarray(v, float)
    return rigid_step(
        np.asarray(mass, float), v, np.asarray(f, float), DT, rows, np.asarray(gap, float), rows @ v, e
    )


def test_free_motion_is_semi_implicit_euler() -> None:
    result = step(np.diag([2.0, 4.0]), [0.1, 0.0], [1.0, 2.0], [[1.0, 0.0]], [1.0], 0.0)
    assert np.array_equal(result.velocity, [0.1 + DT / 2, DT / 2])
    assert not result.impulse.any()


def test_open_plastic_contact_closes_exactly_and_does_not_pass() -> None:
    gap = 1e-4
    result = step([[2.0]], [-1.0], [0.0], [[1.0]], [gap], 0.0)
    assert gap + DT * result.velocity[0] == pytest.approx(0.0, abs=1e-18)


@pytest.mark.parametrize("e", [0.0, 0.3, 1.0])
def test_closed_contact_obeys_newton(e: float) -> None:
    result = step([[2.0]], [-1.0], [0.0], [[1.0]], [0.0], e)
    assert result.velocity[0] == pytest.approx(e, abs=1e-15)
    assert result.impulse[0] == pytest.approx(2.0 * (1.0 + e), rel=1e-15)


def test_open_elastic_contact_is_left_alone() -> None:
    assert step([[2.0]], [-1.0], [0.0], [[1.0]], [1e-9], 0.5).velocity[0] == -1.0


def test_resting_contact_carries_the_load() -> None:
    """A box on two equal corners under its weight: it stays, and the impulses sum to the weight times dt."""
    result = step(
        np.diag([2.0, 0.005]), [0.0, 0.0], [-20.0, 0.0], [[1.0, 0.01], [1.0, -0.01]], [0.0, 0.0], 0.0
    )
    assert np.abs(result.velocity).max() <= 1e-16
    assert result.impulse.sum() == pytest.approx(20.0 * DT, rel=1e-13)
    assert result.impulse.min() > 0.0


@given(st.integers(0, 10_000))
def test_every_step_satisfies_its_conditions(seed: int) -> None:
    """Feasible, non-adhesive, complementary, dynamics kept; a plastic closed step without load never gains energy."""
    rng = np.random.default_rng(seed)
    d, c = int(rng.integers(1, 7)), int(rng.integers(1, 9))
    root = rng.normal(size=(d, d))
    mass, v = root @ root.T + 0.1 * np.eye(d), rng.normal(size=d)
    rows = rng.normal(size=(c, d)) @ np.diag(rng.integers(0, 2, size=d))
    gap = rng.choice([-1e-3, 0.0, 1e-4], size=c)
    result = step(mass, v, np.zeros(d), rows, gap, 0.0)
    bound = velocity_bounds(gap, rows @ v, 0.0, DT)
    scale = np.abs(rows).max() * max(np.abs(v).max(), np.abs(result.velocity).max()) + 1.0
    slack = rows @ result.velocity - bound
    assert slack.min() >= -1e-9 * scale
    assert result.impulse.min() >= 0.0
    assert (
        np.abs(mass @ (result.velocity - v) - rows.T @ result.impulse).max()
        <= 1e-9 * scale * np.abs(mass).max()
    )
    assert result.residual <= stepping.STEP_TOLERANCE
    if gap.max() <= 0.0:
        assert result.velocity @ mass @ result.velocity <= (1.0 + 1e-12) * (v @ mass @ v)


def test_facing_contacts_with_restitution_step_by_poisson_and_say_so() -> None:
    """A mass between two closed walls: no velocity obeys Newton at both; Poisson's step stops it."""
    result = step([[1.0]], [-1.0], [0.0], [[1.0], [-1.0]], [0.0, 0.0], 0.5)
    assert result.restitution_law == POISSON
    assert result.velocity[0] == pytest.approx(0.0, abs=1e-15)
    assert result.impulse == pytest.approx([1.5, 0.5])
    assert step([[1.0]], [-1.0], [0.0], [[1.0], [-1.0]], [0.0, 1.0], 0.5).restitution_law == NEWTON


def test_stewart_trinkle_with_restitution_is_poisson_and_bounces_before_it_passes() -> None:
    rows, v, gap = np.array([[1.0]]), np.array([-1.0]), np.array([1e-4])
    found = rigid_step(np.eye(1), v, np.zeros(1), DT, rows, gap, rows @ v, 0.5, scheme="stewart-trinkle")
    assert found.restitution_law == POISSON and gap[0] + DT * found.velocity[0] >= 0.0
    closed = rigid_step(np.eye(1), v, np.zeros(1), DT, rows, 0.0 * gap, rows @ v, 0.5, scheme="stewart-trinkle")
    assert closed.velocity[0] == pytest.approx(0.5)
    left_alone = rigid_step(np.eye(1), v, np.zeros(1), DT, rows, gap, rows @ v, 0.0, scheme="moreau")
    assert left_alone.velocity[0] == -1.0


def test_an_open_contact_may_not_pass_where_its_own_restitution_is_zero() -> None:
    gap, v = np.array([1e-4, 1e-4]), np.array([-1.0, -1.0])
    found = rigid_step(np.eye(2), v, np.zeros(2), DT, np.eye(2), gap, v, np.array([0.0, 0.5]))
    assert gap[0] + DT * found.velocity[0] == pytest.approx(0.0, abs=1e-18) and found.velocity[1] == -1.0


@pytest.mark.parametrize("e", [np.array([0.5]), np.array([0.5, 1.5]), -0.1])
def test_a_wrong_restitution_is_named(e: Any) -> None:
    with pytest.raises(ArgumentError, match="restitution"):
        velocity_bounds(np.zeros(2), np.zeros(2), e, DT)


def test_a_wrong_multiplier_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    wrong = lambda rows, offset: np.full(len(offset), 0.123)  # noqa: E731
    monkeypatch.setitem(stepping.STEP_SOLVERS, "daqp", wrong)
    assert step([[2.0]], [-1.0], [0.0], [[1.0]], [0.0], 0.0).velocity[0] == pytest.approx(0.0)  # quadprog
    monkeypatch.setitem(stepping.STEP_SOLVERS, "quadprog", wrong)
    assert step([[2.0]], [-1.0], [0.0], [[1.0]], [0.0], 0.0).velocity[0] == pytest.approx(0.0)  # Gauss-Seidel
    monkeypatch.setitem(stepping.STEP_SOLVERS, "gauss_seidel", wrong)
    with pytest.raises(SolverError, match="residual"):
        step([[2.0]], [-1.0], [0.0], [[1.0]], [0.0], 0.0)


def test_velocities_that_cancel_are_judged_by_their_rounding() -> None:
    """A gram under a tonne, at rest: 5e3 m/s from above and from below leave 1e-12 m/s, not a wrong active set."""
    mass, load = np.diag([1e-3, 1e3]), np.array([-9.81e-3, -9.81e3])
    result = step(mass, [0.0, 0.0], load, [[1.0, 0.0], [-1.0, 1.0]], [0.0, 0.0], 0.0)
    assert np.abs(result.velocity).max() <= 1e-11
    assert result.impulse == pytest.approx([9.81e3 * DT, 9.81e3 * DT], rel=1e-5)


def test_stabilization_removes_its_share_of_the_overlap() -> None:
    overlap = np.array([-1e-3])
    bound = velocity_bounds(overlap, np.array([0.0]), 0.0, DT, stabilization=0.25)
    assert overlap[0] + DT * bound[0] == pytest.approx(0.75 * overlap[0])
    with pytest.raises(ArgumentError, match="stabilization"):
        velocity_bounds(overlap, overlap, 0.0, DT, stabilization=2.0)


def peg_world(position, velocity, restitution=0.0):  # type: ignore[no-untyped-def]
    """The paper's peg over a floor and beside a wall, with the least of a system that the law asks for."""
    mechanism = Mechanism([Body("peg", None, Joint("planar"), mass=2.0, inertia=np.diag([1.0, 1.0, 0.005]))])
    walls = [HalfPlane((0.0, 0.0), (0.0, 1.0)), HalfPlane((0.1, 0.0), (-1.0, 0.0))]
    shapes = make_shapes([box((0.021, 0.0105), body=0), *walls])
    pairs = candidate_pairs(shapes)
    capacity = contact_capacity(shapes, pairs)
    contact = SimpleNamespace(restitution=restitution, approach_velocity=1e-6)
    system = SimpleNamespace(
        mechanism=mechanism, shapes=shapes, pairs=pairs, capacity=capacity, tool_tree=0,
        gravity=np.zeros(3), scene=SimpleNamespace(contact=contact), restitutions=np.array([restitution]),
        stops=SimpleNamespace(bound=()), frictions=Frictions(np.zeros(3, np.int64), np.zeros((1, 1))),
        joint_damping=np.zeros(3),
    )  # fmt: skip
    log = SimpleNamespace(
        logged=np.zeros(1, int), group=np.zeros(1, int), rows=np.zeros(1, int), rank=np.zeros(1, int),
        scale=np.zeros(1), clamp=np.zeros(1), energy_lost=np.zeros(1),
        v_minus=np.zeros((1, 3)), v_plus=np.zeros((1, 3)), impulse=np.zeros((1, 3)),
    )  # fmt: skip
    state = SimpleNamespace(
        q=np.array(position, float), v=np.array(velocity, float), contacts=make_contact_buffer(capacity),
        contact_count=np.zeros(2, int), contact_impulse=np.zeros(capacity), impacts=log,
    )  # fmt: skip
    return system, state


def test_the_pushed_peg_comes_to_rest_in_the_corner_and_never_overlaps() -> None:
    system, state = peg_world([0.06, 0.03, 0.1], [0.0, 0.0, 0.0])
    force = np.array([3.2, -4.0, 0.0])
    states, deepest = set(), 0.0
    for _ in range(1500):
        result = RigidConstraints().advance(system, state, force, DT)
        state.q[:], state.v[:] = result.q, result.v
        states.add(result.state)
        deepest = min(deepest, state.contacts.gap[: state.contact_count[0]].min(initial=0.0))
    assert states == {FREE, COLLIDING, RESTING}
    assert state.q == pytest.approx([0.1 - 0.0105, 0.00525, 0.0], abs=1e-5)
    assert np.abs(state.v).max() <= 1e-9
    assert np.abs(result.penalty_force + force).max() <= 1e-6  # the walls balance the hand
    assert deepest >= -1e-4  # second order in the step: corners turn while they touch


def test_the_parts_of_a_step_add_up_to_the_change_of_momentum() -> None:
    system, state = peg_world([0.05, 0.006, 0.05], [0.1, -0.5, 0.3])
    mass, force = np.diag([2.0, 2.0, 0.005]), np.array([0.3, -1.0, 0.01])
    for _ in range(40):
        before = state.v.copy()
        result = RigidConstraints().advance(system, state, force, DT)
        total = DT * (force + result.penalty_force) + result.impulse
        assert np.abs(mass @ (result.v - before) - total).max() <= 1e-12
        if state.impacts.logged[0]:
            assert state.impacts.energy_lost[0] >= 0.0 and result.state == COLLIDING
        state.q[:], state.v[:] = result.q, result.v


def test_elastic_peg_keeps_its_energy_over_many_bounces() -> None:
    system, state = peg_world([0.05, 0.02, 0.2], [0.4, -0.5, 1.0], restitution=1.0)
    mass, bounces = np.diag([2.0, 2.0, 0.005]), 0
    energy = state.v @ mass @ state.v
    for _ in range(200):
        result = RigidConstraints(margin=0.0).advance(system, state, np.zeros(3), DT)
        state.q[:], state.v[:] = result.q, result.v
        bounces += result.state == COLLIDING
    assert bounces >= 2
    assert state.v @ mass @ state.v == pytest.approx(energy, rel=1e-13)

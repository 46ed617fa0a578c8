"""Rigid steps by hand and by their conditions, contacts and rows; rigid worlds; the paper's worlds
by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.errors import ArgumentError, SolverError
from iapb.run import COLLIDING, FREE, RESTING
from iapb.scene import find_scene, load_scene
from iapb.simulation import simulate
from iapb.system import System
from reference import rigid_step as stepping
from reference import time_stepping
from reference.rigid_step import (
    StepContacts,
    friction_step,
    rigid_step,
    velocity_bounds,
)
from reference.time_stepping import RigidConstraints
from reference.worlds import find_world, run_world
from tests.reference.scenes import GIVEN, scene_of
from verification.certificate import certify

DT = 1.0 / 512
BAR = np.diag([1.0, 1.0 / 12.0])
ENDS = np.array([[1.0, 0.5], [1.0, -0.5]])


def step(mass, v, f, rows, gap, e, together=False):  # type: ignore[no-untyped-def]
    mass, v, f, gap = (np.asarray(each, float) for each in (mass, v, f, gap))
    rows = np.atleast_2d(np.asarray(rows, float))
    return rigid_step(mass, v, f, DT, StepContacts(rows, gap, e), together)


# one mass of 2 kg at −1 m/s: gap, restitution, options, v⁺
HAND = [
    (1e-4, 0.0, {}, -1e-4 / DT),  # an open plastic contact closes exactly and does not pass
    (1e-9, 0.5, {}, -1.0),  # an open elastic contact is left alone
    (0.0, 0.0, {}, 0.0),
    (0.0, 1.0, {}, 1.0),  # a closed contact obeys Newton
    (0.0, 0.5, {"together": True}, 0.5),
]


@pytest.mark.parametrize(("gap", "e", "options", "expected"), HAND)
def test_one_mass_by_hand(gap: float, e: float, options: Any, expected: float) -> None:
    result = step([[2.0]], [-1.0], [0.0], [[1.0]], [gap], e, **options)
    assert result.velocity[0] == pytest.approx(expected, abs=1e-15)
    assert result.impulse[0] == pytest.approx(2.0 * (1.0 + result.velocity[0]), abs=1e-14)


@pytest.mark.parametrize("equal", [0.0, 0.3, 1.0, None])
@given(seed=st.integers(0, 10_000))
def test_every_step_satisfies_its_conditions(equal: float | None, seed: int) -> None:
    """Feasible, non-adhesive, dynamics kept; a closed step without load never gains energy."""
    rng = np.random.default_rng(seed)
    d = int(rng.integers(1, 7))
    c = int(rng.integers(1, 9))
    root = rng.normal(size=(d, d))
    mass = root @ root.T + 0.1 * np.eye(d)
    v = rng.normal(size=d)
    rows = rng.normal(size=(c, d)) @ np.diag(rng.integers(0, 2, size=d))
    gap = rng.choice([-1e-3, 0.0, 1e-4], size=c) if equal == 0.0 else np.zeros(c)
    e = rng.choice([0.0, 0.3, 1.0], size=c) if equal is None else equal
    result = step(mass, v, np.zeros(d), rows, gap, e)
    bound = velocity_bounds(gap, rows @ v, 0.0, DT)
    scale = np.abs(rows).max() * max(np.abs(v).max(), np.abs(result.velocity).max()) + 1.0
    assert (rows @ result.velocity - bound).min() >= -1e-9 * scale and result.impulse.min() >= 0.0
    left = mass @ (result.velocity - v) - rows.T @ result.impulse
    assert np.abs(left).max() <= 1e-9 * scale * np.abs(mass).max()
    assert result.residual <= stepping.STEP_TOLERANCE
    if gap.max() <= 0.0:
        assert result.velocity @ mass @ result.velocity <= (1.0 + 1e-12) * (v @ mass @ v)


def test_facing_contacts_with_restitution_step_by_poisson() -> None:
    """A mass between two closed walls: no velocity obeys Newton at both; Poisson's step stops
    it."""
    result = step([[1.0]], [-1.0], [0.0], [[1.0], [-1.0]], [0.0, 0.0], 0.5)
    assert result.impulse == pytest.approx([1.5, 0.5])
    assert result.velocity[0] == pytest.approx(0.0, abs=1e-15)
    early = step(np.eye(1), [-1.0], [0.0], [[1.0]], [1e-4], 0.5, together=True)
    assert 1e-4 + DT * early.velocity[0] >= 0.0  # before it passes


def test_a_resting_contact_under_load_does_not_hop() -> None:
    found = step([[1.0]], [0.0], [-9.81], [[1.0]], [0.0], 0.5, together=True)
    assert found.velocity == pytest.approx([0.0], abs=1e-15)
    assert found.impulse == pytest.approx([9.81 * DT])


def test_a_wrong_multiplier_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("daqp", "quadprog", "gauss_seidel"):
        assert step([[2.0]], [-1.0], [0.0], [[1.0]], [0.0], 0.0).velocity[0] == pytest.approx(
            0.0
        )  # by those left
        monkeypatch.setitem(
            stepping.STEP_SOLVERS, name, lambda rows, offset: np.full(len(offset), 0.123)
        )
    with pytest.raises(SolverError, match="residual"):
        step([[2.0]], [-1.0], [0.0], [[1.0]], [0.0], 0.0)


def test_velocities_that_cancel_are_judged_by_their_rounding() -> None:
    """A gram under a tonne, at rest: 5e3 m/s from above and from below leave 1e-12 m/s, not a wrong
    active set."""
    mass = np.diag([1e-3, 1e3])
    load = np.array([-9.81e-3, -9.81e3])
    result = step(mass, [0.0, 0.0], load, [[1.0, 0.0], [-1.0, 1.0]], [0.0, 0.0], 0.0)
    assert np.abs(result.velocity).max() <= 1e-11
    assert result.impulse == pytest.approx([9.81e3 * DT, 9.81e3 * DT], rel=1e-5)


def test_an_unknown_friction_is_refused() -> None:
    with pytest.raises(ArgumentError, match="friction"):
        RigidConstraints(friction="viscous")


# --- restitution: one e for all contacts, or one for each
# -----------------------------------------------------------
@pytest.mark.parametrize("e", [(1.0, 0.0), (0.3, 0.8)])
def test_each_contact_returns_its_own_share(e: tuple[float, float]) -> None:
    """A bar falls flat on its two ends: J v⁺ = −E J v⁻ at both, by Newton's law."""
    found = step(BAR, [-1.0, 0.0], [0.0, 0.0], ENDS, [0.0, 0.0], np.array(e))
    assert ENDS @ found.velocity == pytest.approx(e, abs=1e-14)


def test_a_box_slides_straight_and_stops() -> None:
    """v²/(2 μ g) = 21 mm along (0.6, 0.8)."""
    scene = scene_of("plate")
    run = simulate(scene, RigidConstraints(friction="coulomb"), steps=110)
    way = 0.5**2 / (2.0 * 0.6 * 9.81) * np.array([0.6, 0.8])
    assert run.q[-1, :2] == pytest.approx(way, abs=2e-3) and np.abs(run.v[-1]).max() < 2e-2
    assert run.q[:, 2].max() <= 0.01 + 1e-6


@pytest.mark.parametrize("size", [2, 3])
def test_friction_never_leaves_its_cone_and_leaves_no_contact_closing(size: int) -> None:
    """Contacts left out of the solved problem are those that the answer does not close; those that
    push are at their bounds."""
    rng = np.random.default_rng(size)
    for _ in range(20):
        rows = rng.normal(size=(6, size, 5))
        bound = rng.normal(size=6) * 0.1 - 0.3
        v_free = rng.normal(size=5)
        v, normal, tangential = friction_step(
            np.eye(5), v_free, rows[:, 0], rows[:, 1:], bound, 0.4
        )
        beyond = (rows[:, 0] @ v - bound) / np.abs(v_free).max()
        assert beyond.min() >= -1e-6 and np.abs(beyond[normal > 1e-6]).max(initial=0.0) <= 1e-6
        assert (np.linalg.norm(tangential, axis=1) <= 0.4 * normal + 1e-9).all()
        change = np.einsum("ck,ckd->d", np.column_stack([normal, tangential]), rows)
        assert v - v_free == pytest.approx(change, abs=1e-9)


def test_of_answers_that_have_not_converged_the_best_counts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A mass of 1 kg that a contact stops: p = 1 N s, found with an error of a few 1e-7."""
    errors = iter([5e-7, 1e-7, 3e-7])
    right = stepping.solve

    def inexact(problem: Any, solver: str) -> Any:
        found = right(problem, solver)
        return replace(found, impulse=found.impulse * (1.0 + next(errors)))

    monkeypatch.setattr(stepping, "solve", inexact)
    rows = np.eye(3)[None]
    _, normal, _ = friction_step(
        np.eye(3), np.array([-1.0, 0.0, 0.0]), rows[:, 0], rows[:, 1:], np.zeros(1), 0.3
    )
    assert normal[0] - 1.0 == pytest.approx(1e-7, rel=1e-3)


def test_contacts_without_a_common_body_are_solved_apart() -> None:
    rng = np.random.default_rng(5)
    parts = rng.normal(size=(2, 3, 3, 6))
    v_free = rng.normal(size=12)
    rows = np.zeros((6, 3, 12))
    rows[::2, :, :6], rows[1::2, :, 6:] = parts
    v, normal, _ = friction_step(np.eye(12), v_free, rows[:, 0], rows[:, 1:], np.zeros(6), 0.3)
    for part, at in zip(parts, (slice(0, 6), slice(6, 12)), strict=True):
        alone, _, _ = friction_step(
            np.eye(6), v_free[at], part[:, 0], part[:, 1:], np.zeros(3), 0.3
        )
        assert v[at] == pytest.approx(alone, abs=1e-9)
    assert (normal > 0.0).any()


def test_the_parts_of_a_step_add_up_to_the_change_of_momentum_and_the_peg_comes_to_rest() -> None:
    run = run_world("peg_corner", "ideal")
    mass = System(PEG).mechanism.mass_matrix(run.q[0])  # of one free body: constant
    forces = run.hand_force + run.coupling_force + run.penalty_force + run.friction_force
    change = run.dt * forces + run.impulse
    assert np.abs(np.diff(run.v, axis=0) @ mass - change).max() <= 1e-12
    struck = np.isin(np.arange(run.steps), run.impacts.step)
    assert np.array_equal(run.state == COLLIDING, struck) and {*run.state} == {
        FREE,
        COLLIDING,
        RESTING,
    }
    assert run.contacts.gap.min() >= -1e-4  # corners turn while they touch
    assert np.abs(run.v[-1]).max() <= 1e-9


def test_the_bar_on_two_posts_gains_nothing_and_follows_poissons_law() -> None:
    """Posts with e = 0 and 1, on which equalities end with 12.167 J: Poisson's law loses what the
    near post stops."""
    scene = load_scene(find_scene("bar_on_posts"))
    engine = simulate(scene).energy["kinetic"][-1]
    kinetic = simulate(scene, RigidConstraints()).energy["kinetic"]
    assert kinetic.max() <= 0.5 * (1.0 + 1e-12)
    assert kinetic[-1] == pytest.approx(engine, rel=1e-3)


def test_a_blow_through_resting_balls_is_one_impact_and_a_load_elsewhere_is_none() -> None:
    """One of three equal balls strikes two that touch, e = 0: they go on at a third, 1/3 J is lost;
    two stand apart."""
    scene = scene_of("balls")
    run = simulate(scene, RigidConstraints(), steps=5)
    assert len(run.impacts.step) == 1 and run.impacts.energy_lost[0] == pytest.approx(
        1.0 / 3.0, rel=1e-12
    )
    assert (
        run.impacts.v_plus[0, :3] == pytest.approx([1.0 / 3.0] * 3)
        and not run.impacts.impulse[0, 3:].any()
    )
    assert run.penalty_force[0, 3:] == pytest.approx(
        [-1.5, 1.5], rel=1e-9
    )  # the pushed pair shares the hand's force


# --- cost
# ---------------------------------------------------------------------------------------------------------
def test_too_many_are_refused_before_the_first_step(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(time_stepping, "MOST_ENTRIES", 500)
    few = scene_of("row", bodies=GIVEN["row"]["bodies"][:4])
    assert run_world(few, "ideal").complete
    for world in ("ideal", "ideal-friction"):
        with pytest.raises(
            ArgumentError, match=r"at most 500 numbers .* 36 contacts of 24 coordinates have 864"
        ):
            run_world(scene_of("row"), world)


PEG = load_scene(find_scene("peg_corner"))


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: run_world("peg_cornre", "PB"), "peg_corner"),
        (
            lambda: find_world("CBuc").coupling_in(PEG.with_values({"couplings.unilateral": None})),
            "gives no gains",
        ),
        (lambda: find_world("ideal", "spread"), "rendering = 'spread': expected full.*ideal"),
        (lambda: find_world("PB", "spread"), "rendering = 'spread': expected full.*PB"),
        (lambda: find_world("IAPB", "clip"), "rendering = 'clip'"),
        (lambda: find_world("best"), "world = 'best': expected one of IAPB, PB, "),
    ],
)
def test_worlds_that_cannot_be_are_refused(call: Callable[[], Any], says: str) -> None:
    with pytest.raises(ArgumentError, match=says):
        call()


# --- order of the rigid worlds
# ------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("name", "values", "least"),
    [
        ("pendulum", {}, 3.9),
        ("pendulum", {"bodies__rod__joint_damping": 0.5}, 3.9),
        ("edge", {}, 3.5),
    ],
)
def test_smooth_motion_is_of_order_two(name: str, values: Any, least: float) -> None:
    """Half the step leaves a quarter of the change that the step before left."""
    ends = []
    for rate in (500.0, 1000.0, 2000.0):
        scene = scene_of(name, rate=rate, **values)
        ends.append(run_world(scene, "ideal-friction").q[-1])
    apart = np.abs(np.diff(ends, axis=0)).max(axis=1)
    assert apart[0] > least * apart[1]


def test_a_scene_with_a_hand_keeps_its_step() -> None:
    """A fall within a step is exact without a hand, and of first order with one."""
    held = {"hand": {"body": "body"}}
    for given_, late in (({}, 0.0), (held, 0.5 * 9.81 * 1e-3 * 0.1)):
        scene = scene_of("fall", **given_)
        exact = -0.5 * 9.81 * 0.1**2
        assert run_world(scene, "ideal").q[-1, 1] == pytest.approx(exact - late, rel=1e-12)


@pytest.mark.parametrize("world", ["ideal", "CBuc"])
def test_the_record_of_a_rigid_world_has_the_places_of_its_impulses(world: str) -> None:
    run = run_world("peg_corner", world)
    struck = run.contacts.impulse != 0.0
    assert struck.any()
    np.testing.assert_allclose(np.linalg.norm(run.contacts.normal[struck], axis=1), 1.0)
    assert certify(run).span < 1e-12


def test_velocity_bounds_take_each_contact_s_own_share_of_an_overlap() -> None:
    gap = np.array([-1e-3, -1e-3])
    found = velocity_bounds(gap, np.zeros(2), 0.0, DT, removed=np.array([1.0, 0.5]))
    assert found == pytest.approx([1e-3 / DT, 0.5e-3 / DT])

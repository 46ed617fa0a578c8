"""One rigid step: what it must satisfy, what it returns by hand, and that nothing is gained."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.errors import ArgumentError, SolverError
from reference import rigid_step as stepping
from reference.rigid_step import NEWTON, POISSON, rigid_step, velocity_bounds

DT = 1.0 / 512
BAR, ENDS = np.diag([1.0, 1.0 / 12.0]), np.array([[1.0, 0.5], [1.0, -0.5]])


def step(mass, v, f, rows, gap, e, **options):  # type: ignore[no-untyped-def]
    rows, v = np.atleast_2d(np.asarray(rows, float)), np.asarray(v, float)
    return rigid_step(np.asarray(mass, float), v, np.asarray(f, float), DT, rows, np.asarray(gap, float), rows @ v, e,
                      **options)  # fmt: skip


def energy(v, mass=BAR):  # type: ignore[no-untyped-def]
    return 0.5 * float(v @ mass @ v)


def test_free_motion_is_semi_implicit_euler() -> None:
    result = step(np.diag([2.0, 4.0]), [0.1, 0.0], [1.0, 2.0], [[1.0, 0.0]], [1.0], 0.0)
    assert np.array_equal(result.velocity, [0.1 + DT / 2, DT / 2]) and not result.impulse.any()


# one mass of 2 kg at −1 m/s: gap, restitution, options, v⁺
HAND = [
    (1e-4, 0.0, {}, -1e-4 / DT),  # an open plastic contact closes exactly and does not pass
    (1e-4, 0.0, {"scheme": "moreau"}, -1.0), (1e-9, 0.5, {}, -1.0),  # an open elastic contact is left alone
    (0.0, 0.0, {}, 0.0), (0.0, 0.3, {}, 0.3), (0.0, 1.0, {}, 1.0),  # a closed contact obeys Newton
    (0.0, 0.5, {"scheme": "stewart-trinkle"}, 0.5),
]  # fmt: skip


@pytest.mark.parametrize(("gap", "e", "options", "expected"), HAND)
def test_one_mass_by_hand(gap: float, e: float, options: Any, expected: float) -> None:
    result = step([[2.0]], [-1.0], [0.0], [[1.0]], [gap], e, **options)
    assert result.velocity[0] == pytest.approx(expected, abs=1e-15)
    assert result.impulse[0] == pytest.approx(2.0 * (1.0 + result.velocity[0]), abs=1e-14)


def test_resting_contact_carries_the_load() -> None:
    """A box on two equal corners under its weight: it stays, and the impulses sum to the weight times dt."""
    result = step(np.diag([2.0, 0.005]), [0.0, 0.0], [-20.0, 0.0], [[1.0, 0.01], [1.0, -0.01]], [0.0, 0.0], 0.0)
    assert np.abs(result.velocity).max() <= 1e-16 and result.impulse.min() > 0.0
    assert result.impulse.sum() == pytest.approx(20.0 * DT, rel=1e-13)


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
    left = mass @ (result.velocity - v) - rows.T @ result.impulse
    assert np.abs(left).max() <= 1e-9 * scale * np.abs(mass).max()
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
    found = step(np.eye(1), [-1.0], [0.0], [[1.0]], [1e-4], 0.5, scheme="stewart-trinkle")
    assert found.restitution_law == POISSON and 1e-4 + DT * found.velocity[0] >= 0.0


def test_an_open_contact_may_not_pass_where_its_own_restitution_is_zero() -> None:
    gap, v = np.array([1e-4, 1e-4]), np.array([-1.0, -1.0])
    found = rigid_step(np.eye(2), v, np.zeros(2), DT, np.eye(2), gap, v, np.array([0.0, 0.5]))
    assert gap[0] + DT * found.velocity[0] == pytest.approx(0.0, abs=1e-18) and found.velocity[1] == -1.0


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


@pytest.mark.parametrize(("given_", "says"), [
    ({"restitution": np.array([0.5])}, "restitution"), ({"restitution": np.array([0.5, 1.5])}, "restitution"),
    ({"restitution": -0.1}, "restitution"), ({"restitution": 0.0, "stabilization": 2.0}, "stabilization"),
    ({"restitution": 0.0, "scheme": "euler"}, "scheme"),
])  # fmt: skip
def test_refusals(given_: dict[str, Any], says: str) -> None:
    with pytest.raises(ArgumentError, match=says):
        velocity_bounds(np.zeros(2), np.zeros(2), dt=DT, **given_)


# --- restitution: one e for all contacts, or one for each -----------------------------------------------------------
@pytest.mark.parametrize("e", [(1.0, 0.0), (0.3, 0.8), (0.5, 0.5)])
def test_each_contact_returns_its_own_share(e: tuple[float, float]) -> None:
    """A bar falls flat on its two ends: J v⁺ = −E J v⁻ at both, by Newton's law; equal e is the scalar's step."""
    found = step(BAR, [-1.0, 0.0], [0.0, 0.0], ENDS, [0.0, 0.0], np.array(e))
    assert found.restitution_law == NEWTON
    assert ENDS @ found.velocity == pytest.approx(e, abs=1e-14)
    if e[0] == e[1]:
        assert np.array_equal(found.velocity, step(BAR, [-1.0, 0.0], [0.0, 0.0], ENDS, [0.0, 0.0], e[0]).velocity)


@pytest.mark.parametrize("e", [np.array([1.0, 0.0]), 0.97, 1.0])
def test_a_bar_that_turns_does_not_gain(e: Any) -> None:
    """One end falls at 1 m/s, the other rises at 0.1 m/s: Newton's step would make 0.015 J of nothing with e = 1."""
    v = np.linalg.solve(ENDS, [-1.0, 0.1])
    newton = stepping.nearest_velocity(BAR, v, ENDS, velocity_bounds(np.zeros(2), ENDS @ v, e, DT))
    found = step(BAR, v, [0.0, 0.0], ENDS, [0.0, 0.0], e)
    if np.ndim(e) == 0 and e == 1.0:
        assert newton.impulse == pytest.approx([0.65, 0.3])
        assert energy(newton.velocity) - energy(v) == pytest.approx(0.015)
    assert energy(newton.velocity) > energy(v) * (1.0 + 1e-6)  # what is avoided
    assert energy(found.velocity) <= energy(v) * (1.0 + 1e-14)
    assert found.restitution_law == POISSON and (ENDS @ found.velocity).min() >= -1e-14


def test_a_load_at_rest_is_not_thrown_by_rounding() -> None:
    """Speeds of 1e-17 m/s of both signs on the feet of a loaded box: it is carried, e = 1 or not."""
    v = np.linalg.solve(ENDS, [-1e-17, 1e-17])
    found = step(BAR, v, [-9.81, 0.0], ENDS, [0.0, 0.0], 1.0)
    assert found.restitution_law == NEWTON and np.abs(found.velocity).max() <= 1e-15


@pytest.mark.parametrize("equal", [0.3, 0.7, 1.0, None])
@given(seed=st.integers(0, 10_000))
def test_steps_never_gain(equal: float | None, seed: int) -> None:
    rng = np.random.default_rng(seed)
    d, c = int(rng.integers(1, 7)), int(rng.integers(2, 7))
    root, rows, v = rng.normal(size=(d, d)), rng.normal(size=(c, d)), rng.normal(size=d)
    mass, e = root @ root.T + 0.1 * np.eye(d), rng.choice([0.0, 0.3, 1.0], size=c)
    found = step(mass, v, np.zeros(d), rows, np.zeros(c), e if equal is None else equal)
    assert energy(found.velocity, mass) <= (1.0 + 1e-9) * energy(v, mass)
    assert (rows @ found.velocity).min() >= -1e-8 * np.abs(rows).max() * np.abs(v).max() * d

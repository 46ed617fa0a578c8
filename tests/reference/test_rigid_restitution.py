"""Restitution in one rigid step, one e for all or one for each: what is returned, and that nothing is gained."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reference import rigid_step as stepping
from reference.rigid_step import NEWTON, POISSON, rigid_step, velocity_bounds

DT = 1.0 / 512


def step(mass, v, f, rows, gap, e):  # type: ignore[no-untyped-def]
    rows, v = np.atleast_2d(np.asarray(rows, float)), np.asarray(v, float)
    return rigid_step(
        np.asarray(mass, float), v, np.asarray(f, float), DT, rows, np.asarray(gap, float), rows @ v, e
    )


BAR, ENDS = np.diag([1.0, 1.0 / 12.0]), np.array([[1.0, 0.5], [1.0, -0.5]])


@pytest.mark.parametrize("e", [(1.0, 0.0), (0.3, 0.8), (0.5, 0.5)])
def test_each_contact_returns_its_own_share(e: tuple[float, float]) -> None:
    """A bar falls flat on its two ends: J v⁺ = −E J v⁻ at both, by Newton's law; equal e is the scalar's step."""
    found = step(BAR, [-1.0, 0.0], [0.0, 0.0], ENDS, [0.0, 0.0], np.array(e))
    assert found.restitution_law == NEWTON
    assert ENDS @ found.velocity == pytest.approx(e, abs=1e-14)
    if e[0] == e[1]:
        assert np.array_equal(found.velocity, step(BAR, [-1.0, 0.0], [0.0, 0.0], ENDS, [0.0, 0.0], e[0]).velocity)


def test_unequal_restitution_that_would_gain_energy_steps_by_poisson() -> None:
    """One end falls, the other rises slowly and is struck down: holding it at rest by Newton's law would pay for it."""
    v, e = np.linalg.solve(ENDS, [-1.0, 0.1]), np.array([1.0, 0.0])
    bound = velocity_bounds(np.zeros(2), ENDS @ v, e, DT)
    newton = stepping.nearest_velocity(BAR, v, ENDS, bound).velocity
    found = step(BAR, v, [0.0, 0.0], ENDS, [0.0, 0.0], e)
    assert newton @ BAR @ newton > 1.01 * (v @ BAR @ v)  # what is avoided
    assert found.restitution_law == POISSON
    assert found.velocity @ BAR @ found.velocity <= (1.0 + 1e-14) * (v @ BAR @ v)
    assert (ENDS @ found.velocity).min() >= -1e-14


@pytest.mark.parametrize("e", [0.97, 1.0])
def test_equal_restitution_on_a_bar_that_turns_does_not_gain(e: float) -> None:
    """One end falls at 1 m/s, the other rises at 0.1 m/s: Newton's step would make 0.015 J of nothing with e = 1."""
    v = np.linalg.solve(ENDS, [-1.0, 0.1])
    bound = velocity_bounds(np.zeros(2), ENDS @ v, e, DT)
    newton = stepping.nearest_velocity(BAR, v, ENDS, bound)
    found = step(BAR, v, [0.0, 0.0], ENDS, [0.0, 0.0], e)
    before, avoided, after = (0.5 * float(u @ BAR @ u) for u in (v, newton.velocity, found.velocity))
    if e == 1.0:
        assert newton.impulse == pytest.approx([0.65, 0.3]) and avoided - before == pytest.approx(0.015)
    assert avoided > before and after <= before * (1.0 + 1e-14)
    assert found.restitution_law == POISSON and (ENDS @ found.velocity).min() >= -1e-14


def test_a_load_at_rest_is_not_thrown_by_rounding() -> None:
    """Speeds of 1e-17 m/s of both signs on the feet of a loaded box: it is carried, e = 1 or not."""
    v = np.linalg.solve(ENDS, [-1e-17, 1e-17])
    found = step(BAR, v, [-9.81, 0.0], ENDS, [0.0, 0.0], 1.0)
    assert found.restitution_law == NEWTON and np.abs(found.velocity).max() <= 1e-15


@pytest.mark.parametrize("equal", [0.3, 0.7, 1.0])
@given(seed=st.integers(0, 10_000))
def test_steps_with_equal_restitution_never_gain(equal: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    d, c = int(rng.integers(1, 7)), int(rng.integers(2, 7))
    root, rows, v = rng.normal(size=(d, d)), rng.normal(size=(c, d)), rng.normal(size=d)
    mass = root @ root.T + 0.1 * np.eye(d)
    found = step(mass, v, np.zeros(d), rows, np.zeros(c), equal)
    assert found.velocity @ mass @ found.velocity <= (1.0 + 1e-9) * (v @ mass @ v)


@given(st.integers(0, 10_000))
def test_steps_with_unequal_restitution_never_gain(seed: int) -> None:
    rng = np.random.default_rng(seed)
    d, c = int(rng.integers(1, 7)), int(rng.integers(2, 7))
    root, rows, v = rng.normal(size=(d, d)), rng.normal(size=(c, d)), rng.normal(size=d)
    mass, e = root @ root.T + 0.1 * np.eye(d), rng.choice([0.0, 0.3, 1.0], size=c)
    e[:2] = 0.0, 1.0
    found = step(mass, v, np.zeros(d), rows, np.zeros(c), e)
    assert found.velocity @ mass @ found.velocity <= (1.0 + 1e-9) * (v @ mass @ v)
    assert (rows @ found.velocity).min() >= -1e-8 * np.abs(rows).max() * np.abs(v).max() * d

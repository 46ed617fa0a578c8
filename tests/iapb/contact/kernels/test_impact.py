"""The pieces of one impact, each against its formula in numpy: whitening, tolerance, change, clamp, momentum."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb.compiled import block
from iapb.contact.kernels.collide import largest_share
from iapb.contact.kernels.impact import (
    RANK_TOLERANCE,
    apply_change,
    factored_impact,
    make_impact_work,
    rank_tolerance,
    whiten_impact,
)


def masses(rng: np.random.Generator, d: int) -> tuple[np.ndarray, np.ndarray]:
    root = rng.normal(size=(d, d))
    mass = root @ root.T + np.eye(d)
    return mass, np.linalg.cholesky(mass)


def test_whitening_gives_unit_rows_their_lengths_and_the_velocity() -> None:
    """A = J L⁻ᵀ, u = Lᵀv, in scratch that is larger than the impact; a row of zeros stays one."""
    rng = np.random.default_rng(0)
    for d, count in ((3, 2), (5, 4), (6, 1)):
        work: Any = block(make_impact_work(6, 5))
        _, lower = masses(rng, d)
        J, v = rng.normal(size=(count, d)), rng.normal(size=d)
        J[-1] *= count == 1
        work.columns[:d, :count] = J.T
        whiten_impact(lower, v, count, work)
        A = np.linalg.solve(lower, J.T).T
        length = np.linalg.norm(A, axis=1)
        assert work.length[:count] == pytest.approx(length, abs=1e-13)
        unit = A / np.where(length > 0.0, length, 1.0)[:, None]
        assert work.columns[:d, :count] == pytest.approx(unit.T, abs=1e-13)
        assert np.array_equal(work.rows[:d, :count], work.columns[:d, :count])
        assert work.u[:d] == pytest.approx(lower.T @ v, abs=1e-13)


def test_the_tolerance_grows_with_the_spread_of_the_factor() -> None:
    """RANK_TOLERANCE, or 8 d ε/2 × largest over smallest diagonal entry of L, whichever is larger."""
    for diagonal in ([1.0, 2.0, 0.5], [1.0, 1e9, 3.0], [1e9, 1.0, 1.0], [2.0, 1.0, 1e-9], [1e-9, 4.0, 1.0]):
        expected = max(RANK_TOLERANCE, 8.0 * 3 * 2.0**-53 * max(diagonal) / min(diagonal))
        assert rank_tolerance(np.diag(diagonal)) == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize("clamped", [False, True])
def test_a_change_is_applied_up_to_where_it_would_gain_energy(clamped: bool) -> None:
    """v⁺ = v + α L⁻ᵀΔu, momentum α LΔu; also where some coordinates do not move, or none does."""
    rng, cut = np.random.default_rng(1), 0
    for trial in range(60):
        d = 4
        mass, lower = masses(rng, d)
        if trial % 2:  # a body without coupling between its coordinates
            mass, lower = np.diag(np.diag(mass)), np.diag(np.sqrt(np.diag(mass)))
        work: Any = block(make_impact_work(6, 1))
        v, change = rng.normal(size=d), rng.normal(size=d) * (rng.random(d) < 0.6)
        work.change[:d] = change
        v_plus, momentum = np.full(d, np.nan), np.full(d, np.nan)
        alpha = apply_change(mass, lower, v, clamped, work, v_plus, momentum)
        step = np.linalg.solve(lower.T, change)
        slope, square = v @ mass @ step, step @ mass @ step
        passive = 1.0 if square == 0.0 else max(0.0, min(1.0, -2.0 * slope / square))
        expected = passive if clamped else 1.0
        cut += expected < 1.0
        assert alpha == pytest.approx(expected, abs=1e-12)
        assert v_plus == pytest.approx(v + expected * step, abs=1e-12)
        assert momentum == pytest.approx(expected * lower @ change, abs=1e-12)
        assert work.change[:d] == pytest.approx(expected * change, abs=1e-12)
    assert (cut > 20) == clamped


@pytest.mark.parametrize("budget", [1, 2, 9])
@pytest.mark.parametrize("restitution", [-1.0, 0.0, 0.7])
def test_an_impact_takes_the_rows_that_close_fastest_and_reverses_those_speeds(restitution: float, budget: int) -> None:
    """Orthogonal rows: each of the `budget` fastest closing ones gets −e times its speed, the others keep theirs."""
    rng = np.random.default_rng(2)
    work: Any = block(make_impact_work(7, 4))
    mass, lower = masses(rng, 5)
    rows = (lower @ np.linalg.qr(rng.normal(size=(5, 3)))[0]).T * [[1.0], [20.0], [0.3]]
    v = rng.normal(size=5)
    work.columns[:5, :3] = rows.T
    v_plus, momentum = np.empty(5), np.empty(5)
    rank, clamp = factored_impact(mass, lower, v, restitution, 3, 1e-10, budget, True, work, v_plus, momentum)
    used = min(budget, 3)
    speeds = rows @ v
    fastest = np.argsort(-np.abs(speeds) / np.linalg.norm(np.linalg.solve(lower, rows.T), axis=0))[:used]
    expected = speeds.copy()
    expected[fastest] *= -restitution
    assert rank == used
    assert clamp == pytest.approx(1.0 if restitution > -1.0 else clamp)
    assert rows @ v_plus == pytest.approx(expected, abs=1e-11)
    assert mass @ (v_plus - v) == pytest.approx(momentum, abs=1e-11)


def test_the_share_for_the_device_is_the_largest_within_every_limit() -> None:
    """|share · p_i / Δt| <= limit in floating point too, one common factor, 1 where all are within."""
    rng, cut = np.random.default_rng(3), 0
    for _ in range(200):
        impulse, limit = rng.normal(size=4), rng.exponential(2.0, 7)
        limit[rng.integers(0, 7)] = np.inf
        dofs, dt = rng.permutation(7)[:4], float(rng.uniform(0.1, 2.0))
        share = largest_share(impulse, dofs, 3, dt, limit)
        forces = np.abs(impulse[:3]) / dt
        assert share == pytest.approx(min(1.0, float((limit[dofs[:3]] / forces).min())), rel=1e-14)
        assert np.all(share * np.abs(impulse[:3]) / dt <= limit[dofs[:3]])
        cut += share < 1.0
    assert 50 < cut < 200
    exact = np.array([2.0, 1.0]), np.array([0, 1]), 2, 0.5, np.array([4.0, 2.0])
    assert largest_share(*exact) == 1.0  # at the limits themselves

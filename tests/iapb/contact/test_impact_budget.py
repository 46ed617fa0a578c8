"""The anytime form: every budget is passive, more rows never make the approach worse at the end."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb import resolve_impact


def impact_of(seed: int, d: int = 8, c: int = 12) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(d, d))
    return root @ root.T + np.eye(d), rng.normal(size=(c, d)), rng.normal(size=d)


@given(seed=st.integers(0, 10_000), budget=st.integers(0, 9), restitution=st.floats(-1.0, 1.0))
def test_every_budget_is_passive(seed: int, budget: int, restitution: float) -> None:
    mass, rows, v = impact_of(seed)
    impact = resolve_impact(mass, rows, v, restitution, budget=budget)
    assert impact.rank == min(budget, 8)
    assert impact.energy_change <= 1e-13 * (v @ mass @ v)
    assert impact.rows_used == budget
    assert impact.status == ("budget" if budget < 8 else "complete")


def test_no_budget_is_no_impulse_and_full_budget_is_all() -> None:
    mass, rows, v = impact_of(1)
    assert np.array_equal(resolve_impact(mass, rows, v, 0.5, budget=0).velocity, v)
    assert np.array_equal(
        resolve_impact(mass, rows, v, 0.5, budget=8).velocity, resolve_impact(mass, rows, v, 0.5).velocity
    )


@pytest.mark.parametrize("seed", range(5))
def test_plastic_energy_falls_with_every_row(seed: int) -> None:
    mass, rows, v = impact_of(seed)
    changes = [resolve_impact(mass, rows, v, 0.0, budget=k).energy_change for k in range(9)]
    assert all(later <= earlier + 1e-13 for earlier, later in zip(changes, changes[1:], strict=False))


def test_the_most_violated_row_comes_first() -> None:
    rows, v = np.eye(3), np.array([-1.0, -5.0, -2.0])
    first = resolve_impact(np.eye(3), rows, v, 0.0, budget=1)
    assert np.array_equal(first.velocity, [-1.0, 0.0, -2.0])
    assert np.array_equal(first.impulses, [0.0, 5.0, 0.0])


def test_a_budget_that_was_enough_says_complete() -> None:
    """Six copies of one contact need one row."""
    impact = resolve_impact(np.eye(3), np.tile([1.0, 0.0, 0.0], (6, 1)), [-1.0, 0.0, 0.0], 0.0, budget=1)
    assert impact.status == "complete"
    assert resolve_impact(np.eye(3), np.eye(3), [-1.0, 0.0, 0.0], 0.0, budget=0).status == "budget"


def test_a_replay_with_the_recorded_budget_is_exact() -> None:
    mass, rows, v = impact_of(3)
    first = resolve_impact(mass, rows, v, 0.5, budget=np.int64(4))
    again = resolve_impact(mass, rows, v, 0.5, budget=first.rows_used)
    assert np.array_equal(first.velocity, again.velocity)

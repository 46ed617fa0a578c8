"""The judges are judged: rationals against hand results, double-doubles against rationals."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.errors import ArgumentError
from reference import exact
from reference.exact import (
    exact_impact,
    exact_rank,
    independent_rows,
    relative_energy_gain,
)

SMALL = st.integers(-4, 4)


def test_one_mass_against_a_wall() -> None:
    impact = exact_impact([[2.0]], [[1.0], [3.0]], [-0.25], Fraction(1, 2))
    assert impact.velocity == (Fraction(1, 8),) and impact.generalized_impulse == (Fraction(3, 4),)
    assert (impact.rank, impact.independent_rows) == (1, (0,))
    assert impact.energy_after - impact.energy_before == Fraction(1, 64) - Fraction(1, 16)


@pytest.mark.parametrize("seed", range(8))
def test_exact_outcome_obeys_the_theorem_without_any_tolerance(seed: int) -> None:
    """J v⁺ = −e J v⁻ on every row, redundant ones included, and elastic energy is conserved,
    exactly."""
    rng = np.random.default_rng(seed)
    root = rng.integers(-4, 5, (4, 4)).astype(float)
    rows = rng.integers(-3, 4, (6, 4)).astype(float)
    rows[3:] = 2.0 * rows[:3]
    v = rng.normal(size=4)
    impact = exact_impact(root @ root.T + np.eye(4), rows, v, 1)
    assert impact.energy_after == impact.energy_before
    for row in rows:
        after = sum(Fraction(r) * x for r, x in zip(row, impact.velocity, strict=True))
        assert after == -sum(Fraction(r) * Fraction(x) for r, x in zip(row, v, strict=True))


@given(st.lists(st.lists(SMALL, min_size=3, max_size=3), min_size=1, max_size=6))
def test_independent_rows_span_as_many_dimensions_as_the_rank(rows: list[list[int]]) -> None:
    chosen = independent_rows(rows)
    assert len(chosen) == np.linalg.matrix_rank(np.array(rows))
    assert np.linalg.matrix_rank(np.array(rows)[list(chosen)].reshape(-1, 3)) == len(chosen)


def test_condition_numbers() -> None:
    assert exact.condition_number(np.diag([1.0, 1e-12, 3.0])) == pytest.approx(3e12, rel=1e-14)
    assert exact.row_condition_number(
        np.eye(3), [[1.0, 0, 0], [0, 4.0, 0], [0, 4.0, 0]]
    ) == pytest.approx(32**0.5)
    assert exact.row_condition_number(np.eye(2), np.zeros((0, 2))) == 1.0


@pytest.mark.parametrize(
    ("arguments", "gain"),
    [
        (([[1.0]], [1e-10], [1e300]), np.inf),
        ((np.eye(2), [1.0, 0.0], [1.0, 1e-200]), 5e-324),
        ((np.eye(2), [1.0, 1e-200], [1.0, 0.0]), 0.0),
        (([[1.0]], [0.0], [0.0]), 0.0),
        (([[1.0]], [0.0], [1.0]), np.inf),
    ],
)
def test_a_gain_beyond_the_range_of_doubles_is_a_gain(arguments: Any, gain: float) -> None:
    assert relative_energy_gain(*arguments) == gain


@pytest.mark.parametrize(
    ("call", "arguments", "says"),
    [
        (exact_impact, ([[1.0]], [[np.nan]], [1.0], 1.0), "finite"),
        (exact_impact, ([[1.0]], [[1.0, 2.0]], [1.0], 1.0), "columns"),
        (relative_energy_gain, ([[1.0]], [1.0], [np.nan]), "finite"),
    ],
)
def test_refusals(call: Any, arguments: Any, says: str) -> None:
    with pytest.raises(ArgumentError, match=says):
        call(*arguments)


def test_the_rank_modulo_a_prime_is_that_of_rational_numbers() -> None:
    """Rows dependent exactly, to the last bit only, and in units hundreds of decades apart."""
    rng = np.random.default_rng(0)
    for _ in range(50):
        c, d, rank = rng.integers(1, 7, size=3)
        whole = rng.integers(-3, 4, size=(c, rank)) @ rng.integers(-9, 10, size=(rank, d))
        rows = whole * 2.0 ** rng.integers(-300, 300)
        for tried in (rows, rows * rng.normal(size=(c, 1)), 0.0 * rows):
            assert exact_rank(tried) == len(independent_rows(tried))

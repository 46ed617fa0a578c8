"""The orthonormal basis: orthonormal to rounding, in the rows' span, and never an amplifier."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.contact.kernels.projector import _next_direction, orthonormal_basis, projected_change, unit_columns


def basis_of(rows: np.ndarray, u: np.ndarray, tolerance: float = 1e-10, budget: int = 99) -> np.ndarray:
    c, d = rows.shape
    columns, basis = rows.T.copy(), np.zeros((d, d))
    length, closing, size, overlap = (np.zeros(c) for _ in range(4))
    unit_columns(columns, c, length)
    np.testing.assert_allclose(length, np.linalg.norm(rows, axis=1), rtol=1e-15 * d)
    rank = orthonormal_basis(columns, c, u, tolerance, budget, basis, closing, size, overlap)
    return basis[:rank]


@given(seed=st.integers(0, 100_000), exponent=st.integers(1, 16), d=st.integers(2, 12), c=st.integers(1, 30))
def test_orthonormal_to_rounding_even_from_nearly_dependent_rows(seed: int, exponent: int, d: int, c: int) -> None:
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(c, 2)) @ rng.normal(size=(2, d)) + 10.0**-exponent * rng.normal(size=(c, d))
    basis = basis_of(rows, rng.normal(size=d))
    np.testing.assert_allclose(basis @ basis.T, np.eye(len(basis)), rtol=0, atol=4e-16 * d)


@given(seed=st.integers(0, 100_000), restitution=st.floats(-1.0, 1.0), tolerance=st.sampled_from([1e-17, 1e-10, 0.5]))
def test_u_is_never_lengthened_whatever_the_rank_decision(seed: int, restitution: float, tolerance: float) -> None:
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(9, 3)) @ rng.normal(size=(3, 6))
    u, change = rng.normal(size=6), np.zeros(6)
    basis = basis_of(rows, u, tolerance)
    projected_change(basis, len(basis), u, 1.0 + restitution, change)
    assert np.linalg.norm(u + change) <= np.linalg.norm(u) * (1.0 + 4 * 6 * 2.0**-52)


def test_a_single_direction_left_is_taken_from_a_long_residual() -> None:
    """All residual rows tie then; the shortest would carry ε / ‖r‖ of rounding into the direction."""
    rng = np.random.default_rng(7)
    row_space = np.linalg.qr(rng.normal(size=(6, 3)))[0].T
    rows, u = rng.normal(size=(5000, 3)) @ row_space, rng.normal(size=6)
    basis = basis_of(rows, u)
    assert len(basis) == 3
    outside = basis - basis @ row_space.T @ row_space
    assert np.abs(outside).max() <= 1e-14


@pytest.mark.parametrize("budget", range(5))
def test_a_budget_gives_the_beginning_of_the_same_basis(budget: int) -> None:
    rng = np.random.default_rng(1)
    rows, u = rng.normal(size=(6, 4)), rng.normal(size=4)
    assert np.array_equal(basis_of(rows, u, budget=budget), basis_of(rows, u)[:budget])


@pytest.mark.parametrize("share", [1.0, 2.0**-30, 2.0**30])
def test_a_row_in_the_span_gives_no_direction_whatever_its_length(share: float) -> None:
    """Nothing is left of it, exactly: no direction, and no number that is none."""
    basis = np.array([[0.0, 1.0, 0.0], [0.6, 0.0, 0.8], [0.0, 0.0, 0.0]])
    columns = np.ascontiguousarray(share * np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]).T)
    assert not _next_direction(columns, 0, basis, 1)
    assert np.array_equal(basis[1], [0.0, 0.0, 0.0])
    basis[1] = (0.6, 0.0, 0.8)
    assert _next_direction(columns, 1, basis, 2)
    assert abs(basis[2]) == pytest.approx([0.8, 0.0, 0.6], abs=1e-15)


def test_columns_of_any_length_become_unit_and_none_stays_none() -> None:
    rng = np.random.default_rng(2)
    columns = rng.normal(size=(4, 9)) * 10.0 ** np.arange(-4.0, 5.0)
    columns[:, 3] = 0.0
    expected, length = columns.copy(), np.full(9, np.nan)
    unit_columns(columns, 8, length)
    norms = np.linalg.norm(expected, axis=0)
    assert length[:8] == pytest.approx(norms[:8], rel=1e-15) and np.isnan(length[8])
    norms[[3, 8]] = 1.0
    assert columns == pytest.approx(expected / norms, rel=1e-14)

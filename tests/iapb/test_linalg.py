"""Cholesky factor and triangular solves: residuals within their known bounds, and a pivot that fails is named."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.linalg import (
    cholesky,
    from_whitened,
    solve_mass,
    to_momentum,
    to_whitened,
    whiten_columns,
)

EPS = 2.0**-52


def mass_of(seed: int, d: int, exponent: float = 3.0) -> np.ndarray:
    basis = np.linalg.qr(np.random.default_rng(seed).normal(size=(d, d)))[0]
    mass = basis * np.logspace(0, -exponent, d) @ basis.T
    return 0.5 * (mass + mass.T)


@given(seed=st.integers(0, 10_000), d=st.integers(1, 15), exponent=st.floats(0, 12))
def test_the_factor_reproduces_the_matrix(seed: int, d: int, exponent: float) -> None:
    """Backward error of Cholesky: |M − L Lᵀ| ≤ (d + 1) ε |L||Lᵀ| (Higham 2002, theorem 10.3)."""
    mass, lower = mass_of(seed, d, exponent), np.zeros((d, d))
    assert cholesky(mass, lower) == 0
    assert np.array_equal(lower, np.tril(lower))
    assert (np.abs(mass - lower @ lower.T) <= (d + 2) * EPS * (np.abs(lower) @ np.abs(lower.T)) + 1e-300).all()


@given(seed=st.integers(0, 10_000), d=st.integers(1, 12))
def test_the_maps_undo_one_another(seed: int, d: int) -> None:
    mass, lower = mass_of(seed, d), np.zeros((d, d))
    cholesky(mass, lower)
    v = np.random.default_rng(seed + 1).normal(size=d)
    u, back, momentum, acceleration = (np.zeros(d) for _ in range(4))
    to_whitened(lower, v, u)
    from_whitened(lower, u, back)
    np.testing.assert_allclose(back, v, atol=1e-11)
    assert u @ u == pytest.approx(v @ mass @ v, rel=1e-11)  # KE = ½|u|²
    to_momentum(lower, u, momentum)
    np.testing.assert_allclose(momentum, mass @ v, atol=1e-12)
    solve_mass(lower, momentum, acceleration)
    np.testing.assert_allclose(acceleration, v, atol=1e-10)
    solve_mass(lower, momentum, momentum)  # in place
    assert np.array_equal(momentum, acceleration)


def test_whitened_columns_give_the_delassus_matrix() -> None:
    mass, lower = mass_of(3, 5), np.zeros((5, 5))
    cholesky(mass, lower)
    rows = np.random.default_rng(4).normal(size=(7, 5))
    columns = np.ascontiguousarray(rows.T)
    whiten_columns(lower, columns, 7)
    np.testing.assert_allclose(columns.T @ columns, rows @ np.linalg.solve(mass, rows.T), rtol=1e-9)


def test_the_failing_pivot_is_named() -> None:
    lower = np.zeros((3, 3))
    assert cholesky(np.diag([1.0, 2.0, -1.0]), lower) == 3
    assert cholesky(np.array([[1.0, 1.0], [1.0, 1.0]]), np.zeros((2, 2))) == 2
    assert cholesky(np.diag([np.nan, 1.0]), np.zeros((2, 2))) == 1

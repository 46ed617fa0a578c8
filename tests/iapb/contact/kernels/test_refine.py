"""An impact made exact for M where the factor belongs to a neighbour of M."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.contact.kernels.impact import refine_change


def refined(error: float, rank: int, seed: int) -> tuple[np.ndarray, ...]:
    """M, the factor of M + error, Q, Δu₀, Δv before, and Δu, Δv after."""
    rng, d = np.random.default_rng(seed), 6
    root = rng.normal(size=(d, d))
    mass = root @ root.T + np.eye(d)
    wrong = rng.normal(size=(d, d))
    lower = np.linalg.cholesky(mass)
    lower = np.linalg.cholesky(mass + error * lower @ (wrong + wrong.T) @ lower.T / np.linalg.norm(wrong + wrong.T))
    basis = np.zeros((d, d))
    basis[:rank] = np.linalg.qr(rng.normal(size=(d, rank)))[0].T
    given = basis[:rank].T @ rng.normal(size=rank)
    change, v_change = given.copy(), np.linalg.solve(lower.T, given)
    before = v_change.copy()
    refine_change(mass, lower, basis, rank, change, v_change, *(np.full(d, np.nan) for _ in range(3)))
    return mass, lower, basis[:rank], given, before, change, v_change


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("rank", [1, 3, 6])
@pytest.mark.parametrize("error", [1e-8, 1e-6, 1e-5])
def test_restitution_is_kept_and_the_impulse_for_m_lies_in_the_row_space(error: float, rank: int, seed: int) -> None:
    """Q Lᵀ Δv = Q Δu₀; Δu = L⁻¹ M Δv = QᵀQ Δu. Before it was so to `error` only."""
    mass, lower, Q, given, before, change, v_change = refined(error, rank, seed)
    assert Q @ (lower.T @ v_change) == pytest.approx(Q @ given, abs=1e-13)
    assert np.linalg.solve(lower, mass @ v_change) == pytest.approx(change, abs=1e-13)
    assert Q.T @ (Q @ change) == pytest.approx(change, abs=1e-13)
    wrong = np.linalg.solve(lower, mass @ before) - given
    assert np.linalg.norm(wrong) > 0.01 * error * np.linalg.norm(given)


@pytest.mark.parametrize("error", [0.0, 0.6])
def test_what_is_not_felt_or_does_not_contract_is_left_to_the_clamp(error: float) -> None:
    _, _, _, given, before, change, v_change = refined(error, 3, 1)
    assert np.array_equal(change, given) and np.array_equal(v_change, before)


def test_no_change_stays_none() -> None:
    change, v_change = np.zeros(3), np.zeros(3)
    refine_change(np.eye(3), np.eye(3), np.eye(3), 3, change, v_change, *(np.full(3, np.nan) for _ in range(3)))
    assert not change.any() and not v_change.any()

"""The energy clamp: never above one, never a gain, and silent where nothing is to be done."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb import resolve_impact
from iapb.contact.kernels.impact import energy_clamp
from reference.exact import exact_impact, relative_energy_gain

NUMBERS = st.lists(st.integers(-8, 8).map(float), min_size=3, max_size=3)
MASS = np.array([[4.0, 1.0, 0.0], [1.0, 3.0, -1.0], [0.0, -1.0, 2.0]])


@given(v=NUMBERS, change=NUMBERS)
def test_the_factor_is_the_largest_passive_one(v: list[float], change: list[float]) -> None:
    """Against rationals: KE(v + αΔv) ≤ KE(v), with equality where α < 1; 0 where every step gains."""
    before, step = np.array(v), np.array(change)
    alpha = energy_clamp(MASS, before, step)
    assert 0.0 <= alpha <= 1.0
    cross, square = before @ MASS @ step, step @ MASS @ step  # integers: exact
    if square == 0.0 or cross >= 0.0:
        assert alpha == 0.0
    else:
        exact = min(Fraction(1), Fraction(-2) * Fraction(cross) / Fraction(square))
        assert alpha == pytest.approx(float(exact), rel=1e-15)


def light_direction(exponent: int, d: int = 6, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """M with κ = 10^exponent and the velocity along its lightest direction."""
    rng = np.random.default_rng(seed)
    basis = np.linalg.qr(rng.normal(size=(d, d)))[0]
    mass = basis * np.logspace(0, -exponent, d) @ basis.T
    return 0.5 * (mass + mass.T), basis[:, -1]


@pytest.mark.parametrize("exponent", [4, 8, 12])
def test_with_the_clamp_the_gain_keeps_its_bound_without_it_not(exponent: int) -> None:
    """v along the light direction, e = 1: the bound 10 d ε √κ(M) holds with the clamp; at κ = 1e12 only with it."""
    gains = {True: [], False: []}
    for seed in range(10):
        mass, v = light_direction(exponent, seed=seed)
        # Rows random in the kinetic metric: the impact turns part of the light motion into heavy motion.
        rows = np.random.default_rng(seed + 100).normal(size=(3, 6)) @ np.linalg.cholesky(mass).T
        for clamp in gains:
            impact = resolve_impact(mass, rows, v, 1.0, clamp=clamp)
            gains[clamp].append(relative_energy_gain(mass, v, impact.velocity))
    bound = 10 * 6 * 2.0**-52 * 10 ** (exponent / 2)
    assert max(gains[True]) <= bound
    if exponent == 12:
        assert max(gains[False]) > bound


@pytest.mark.parametrize("seed", range(10))
def test_an_ill_conditioned_impact_is_exact_for_the_mass_matrix_itself(seed: int) -> None:
    """κ(M) = 1e12: energy neither gained nor lost above the bound, restitution met, M Δv = Jᵀp in exact arithmetic.

    Without the refinement the factor's L Lᵀ ≠ M costs 1e-5 of the energy either way, and the clamp restitution.
    """
    mass, v = light_direction(12, seed=seed)
    rows = np.random.default_rng(seed + 100).normal(size=(3, 6)) @ np.linalg.cholesky(mass).T
    impact = resolve_impact(mass, rows, v, 1.0)
    bound = 10 * 6 * 2.0**-52 * 1e6
    assert abs(relative_energy_gain(mass, v, impact.velocity)) <= bound
    assert 1.0 - impact.clamp <= bound
    length = np.linalg.norm(np.linalg.solve(np.linalg.cholesky(mass), rows.T), axis=0)
    assert (np.abs(rows @ (impact.velocity + v)) <= bound * length * np.sqrt(v @ mass @ v)).all()
    truth = exact_impact(mass, rows, v, 1.0)
    error = np.array([float(Fraction(a) - b) for a, b in zip(impact.velocity, truth.velocity, strict=True)])
    assert np.sqrt(error @ mass @ error / (v @ mass @ v)) <= bound
    momentum = np.array([float(f) for f in truth.generalized_impulse])
    np.testing.assert_allclose(impact.generalized_impulse, momentum, atol=1e-8 * np.abs(momentum).max())


def test_a_clamped_impulse_is_scaled_with_its_velocity() -> None:
    """M Δv = Jᵀp holds for what is returned, clamp or not."""
    mass, v = light_direction(12)
    rows = np.random.default_rng(3).normal(size=(3, 6))
    impact = resolve_impact(mass, rows, v, 1.0)
    assert impact.clamp <= 1.0
    np.testing.assert_allclose(impact.generalized_impulse, rows.T @ impact.impulses, rtol=1e-9, atol=1e-18)

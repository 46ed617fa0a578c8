"""Unequal restitution: Poisson's law by two LCPs, and the rules that are not sound."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb import resolve_impact
from iapb.contact.kernels.unilateral import make_push_work, poisson_impulses

BAR_MASS = np.diag([1.0, 1.0 / 12.0])
BAR_ROWS = np.array([[1.0, 0.5], [1.0, 0.4]])


def bar_velocity() -> np.ndarray:
    """Falling without turning: γ⁻ = (−1, −1)."""
    return np.linalg.solve(BAR_ROWS, [-1.0, -1.0])


def impact_of(seed: int, d: int = 5, c: int = 7) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(d, d))
    rows = rng.normal(size=(c, min(d, c) - 1)) @ rng.normal(size=(min(d, c) - 1, d))
    return root @ root.T + 0.1 * np.eye(d), rows, rng.normal(size=d), rng.uniform(0.0, 1.0, size=c)


def test_equalities_with_unequal_restitution_gain_energy_on_the_bar() -> None:
    """The counterexample: KE 0.5 → 12.167 when both contacts are made to obey their own e."""
    v = bar_velocity()
    after = np.linalg.solve(BAR_ROWS, [1.0, 0.0])
    assert 0.5 * v @ BAR_MASS @ v == pytest.approx(0.5)
    assert 0.5 * after @ BAR_MASS @ after == pytest.approx(12.1666667)


def test_poissons_law_is_passive_on_the_bar() -> None:
    impact = resolve_impact(BAR_MASS, BAR_ROWS, bar_velocity(), [1.0, 0.0])
    assert impact.law == "Poisson, two LCPs"
    assert impact.energy_change <= 0.0
    assert impact.clamp == 1.0
    assert impact.impulses.min() >= 0.0
    assert (BAR_ROWS @ impact.velocity).min() >= -1e-13


@given(seed=st.integers(0, 100_000), d=st.integers(1, 8), c=st.integers(1, 14))
def test_passive_pushing_and_separating_for_any_restitution(seed: int, d: int, c: int) -> None:
    """Energy falls without the clamp's help; no contact pulls; none approaches afterwards."""
    mass, rows, v, e = impact_of(seed, d, c)
    e = np.append(e[:-1], 1.0 - e[0] / 2) if c > 1 else e
    impact = resolve_impact(mass, rows, v, e, clamp=False)
    if c == 1:
        return  # one value is equal to itself: the scalar rule
    speed = np.sqrt(v @ mass @ v)
    length = np.sqrt(np.einsum("ij,ji->i", rows, np.linalg.solve(mass, rows.T)))
    assert impact.energy_change <= 1e-13 * speed**2
    assert impact.impulses.min() >= 0.0
    assert (rows @ impact.velocity >= -1e-11 * speed * length).all()
    np.testing.assert_allclose(mass @ (impact.velocity - v), rows.T @ impact.impulses, atol=1e-10 * (1 + speed))


@given(seed=st.integers(0, 100_000), e=st.floats(0.0, 1.0))
def test_equal_restitution_reduces_to_the_scalar_rule(seed: int, e: float) -> None:
    """Where all contacts approach and the scalar rule pushes at all, Poisson's law gives the same velocity."""
    rng = np.random.default_rng(seed)
    rows = rng.uniform(0.0, 1.0, size=(3, 5)) + np.eye(3, 5)  # no two rows oppose one another
    u = -rows.T @ rng.uniform(0.1, 1.0, size=3)  # then p = (1 + e) × those weights > 0
    columns = np.ascontiguousarray((rows / np.linalg.norm(rows, axis=1)[:, None]).T)
    p, change = np.zeros(3), np.zeros(5)
    assert poisson_impulses(columns, 3, u, np.full(3, e), p, change, make_push_work(5, 3))
    scalar = resolve_impact(np.eye(5), rows, u, e)
    np.testing.assert_allclose(u + change, scalar.velocity, atol=1e-12)
    assert np.array_equal(resolve_impact(np.eye(5), rows, u, np.full(3, e)).velocity, scalar.velocity)


def test_separating_contacts_are_left_alone() -> None:
    impact = resolve_impact(np.eye(2), np.eye(2), [1.0, 2.0], [0.0, 1.0])
    assert np.array_equal(impact.velocity, [1.0, 2.0])
    assert not impact.impulses.any()


def test_returning_each_contacts_own_share_and_no_more_is_not_sound() -> None:
    """Naive p = (I + E) p_c can leave a contact approaching; Poisson's second LCP repairs it."""
    mass, rows = np.eye(2), np.array([[1.0, 0.0], [-0.8, 0.6]])
    v = np.array([-1.0, -2.0])
    columns = np.ascontiguousarray(rows.T)
    p, change = np.zeros(2), np.zeros(2)
    assert poisson_impulses(columns, 2, v, np.zeros(2), p, change, make_push_work(2, 2))
    naive = v + rows.T @ (p * (1.0 + np.array([1.0, 0.0])))
    assert (rows @ naive).min() < -0.1
    sound = resolve_impact(mass, rows, v, [1.0, 0.0])
    assert (rows @ sound.velocity).min() >= -1e-14


@pytest.mark.parametrize("copies", [2, 10, 300])
def test_copies_of_contacts(copies: int) -> None:
    """Redundant contacts with different restitution: passive, pushing, separating."""
    rng = np.random.default_rng(copies)
    rows = np.tile(BAR_ROWS, (copies, 1))
    impact = resolve_impact(BAR_MASS, rows, bar_velocity(), rng.uniform(0, 1, size=2 * copies), clamp=False)
    assert impact.energy_change <= 1e-14
    assert impact.impulses.min() >= 0.0
    assert (rows @ impact.velocity).min() >= -1e-12


@pytest.mark.parametrize("difference", [1e-5, 1e-8, 1e-10, 1e-12, 1e-14])
@pytest.mark.parametrize("seed", range(5))
def test_nearly_parallel_contacts_converge(difference: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = np.array([1.0, 0.0, 0.0]) + difference * rng.normal(size=(8, 3))
    impact = resolve_impact(np.diag([1.0, 2.0, 3.0]), rows, [-1.0, 0.5, -0.5], rng.uniform(0, 1, 8), clamp=False)
    assert impact.energy_change <= 1e-13
    assert (rows @ impact.velocity).min() >= -1e-10

"""What a resolved impact obeys: Newton's law on every row, impulses from the contacts, and no gain of energy."""

from __future__ import annotations

import numpy as np
import pytest

from iapb import resolve_impact

METHODS = ("factored", "gram_pinv", "gram_cholesky", "damped", "svd")
EPS = np.finfo(float).eps


def random_impact(seed: int, d: int = 6, c: int = 4) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A well conditioned mass matrix, unit rows and a velocity."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(d, d))
    rows = rng.normal(size=(c, d))
    return root @ root.T + d * np.eye(d), rows / np.linalg.norm(rows, axis=1)[:, None], rng.normal(size=d)


def gain(mass: np.ndarray, before: np.ndarray, after: np.ndarray) -> float:
    """2 (KE⁺ − KE⁻)."""
    return float((after - before) @ mass @ (after + before))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("restitution", [-1.0, -0.3, 0.0, 0.7, 1.0])
def test_newtons_law_is_met_on_independent_rows(method: str, restitution: float) -> None:
    mass, rows, v = random_impact(1)
    impact = resolve_impact(mass, rows, v, restitution, method=method)
    tolerance = 1e-6 if method == "damped" else 1e-13  # damping leaves λ κ(W) of the approach
    np.testing.assert_allclose(rows @ impact.velocity, -restitution * (rows @ v), atol=tolerance)
    np.testing.assert_allclose(mass @ (impact.velocity - v), rows.T @ impact.impulses, atol=1e-12)
    np.testing.assert_allclose(impact.generalized_impulse, rows.T @ impact.impulses, atol=1e-12)
    assert impact.rank == 4
    assert gain(mass, v, impact.velocity) <= 1e-14 * (v @ mass @ v)


@pytest.mark.parametrize("method", METHODS)
def test_the_loss_is_the_quadratic_form_with_its_half(method: str) -> None:
    mass, rows, v = random_impact(2)
    gamma = rows @ v
    form = gamma @ np.linalg.solve(rows @ np.linalg.solve(mass, rows.T), gamma)
    impact = resolve_impact(mass, rows, v, 0.25, method=method)
    assert impact.energy_change == pytest.approx(-0.5 * (1 - 0.25**2) * form, rel=1e-6)
    assert impact.energy_change == pytest.approx(0.5 * gain(mass, v, impact.velocity), rel=1e-12)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("nothing", [[], np.zeros((0, 6))])
def test_no_contact_leaves_every_bit(method: str, nothing: object) -> None:
    mass, _, v = random_impact(3)
    impact = resolve_impact(mass, nothing, v, 0.5, method=method)
    assert np.array_equal(impact.velocity, v)
    assert impact.impulses.shape == (0,) and impact.rank == 0
    assert impact.energy_change == 0.0 and impact.clamp == 1.0


@pytest.mark.parametrize("method", ["factored", "gram_pinv", "damped", "svd"])
def test_zero_rows_push_nothing(method: str) -> None:
    mass, rows, v = random_impact(4)
    padded = np.vstack([np.zeros(6), rows, np.zeros(6)])
    impact = resolve_impact(mass, padded, v, 0.5, method=method)
    assert impact.impulses[0] == impact.impulses[-1] == 0.0
    alone = resolve_impact(mass, rows, v, 0.5, method=method)
    np.testing.assert_allclose(impact.velocity, alone.velocity, rtol=0, atol=1e-14)
    assert np.array_equal(resolve_impact(mass, np.zeros((3, 6)), v, 0.5, method=method).velocity, v)


@pytest.mark.parametrize("method", ["factored", "gram_pinv", "svd"])
def test_duplicated_rows_change_nothing_and_share_the_impulse(method: str) -> None:
    mass, rows, v = random_impact(5)
    alone = resolve_impact(mass, rows, v, 0.5, method=method)
    tripled = resolve_impact(mass, np.vstack([rows, rows, rows]), v, 0.5, method=method)
    np.testing.assert_allclose(tripled.velocity, alone.velocity, rtol=0, atol=1e-13)
    np.testing.assert_allclose(tripled.impulses, np.tile(alone.impulses / 3.0, 3), atol=1e-12)
    assert tripled.rank == 4


@pytest.mark.parametrize("method", ["factored", "gram_pinv", "svd"])
def test_impulses_are_those_of_least_norm(method: str) -> None:
    """Among all p with Jᵀp = M Δv; rows of unlike sizes, so that a norm in scaled rows would be seen."""
    mass, rows, v = random_impact(6, d=3, c=7)
    rows = rows * np.array([0.4, 1.0, 3.0, 1.7, 0.9, 2.2, 5.0])[:, None]
    impact = resolve_impact(mass, rows, v, 0.2, method=method)
    least = np.linalg.pinv(rows.T) @ impact.generalized_impulse
    np.testing.assert_allclose(impact.impulses, least, atol=1e-11 * np.linalg.norm(least))


@pytest.mark.parametrize("method", METHODS)
def test_one_coordinate(method: str) -> None:
    impact = resolve_impact([[2.0]], [[1.0]], [-3.0], 0.5, method=method)
    assert impact.velocity == pytest.approx([1.5], rel=1e-7)
    assert impact.impulses == pytest.approx([9.0], rel=1e-7)
    assert impact.energy_change == pytest.approx(-6.75, rel=1e-7)


def test_ten_thousand_contacts() -> None:
    rng = np.random.default_rng(7)
    mass, _, v = random_impact(7)
    rows = rng.normal(size=(10_000, 3)) @ rng.normal(size=(3, 6))
    impact = resolve_impact(mass, rows, v, 0.9)
    assert impact.rank == 3
    assert np.abs(rows @ impact.velocity + 0.9 * (rows @ v)).max() <= 1e-12 * np.abs(rows).max()
    np.testing.assert_allclose(rows.T @ impact.impulses, mass @ (impact.velocity - v), atol=1e-11)


def test_minus_one_is_no_impact_and_one_conserves() -> None:
    mass, rows, v = random_impact(8)
    nothing = resolve_impact(mass, rows, v, -1.0)
    assert np.array_equal(nothing.velocity, v)
    assert not nothing.impulses.any() and not nothing.generalized_impulse.any()
    elastic = resolve_impact(mass, rows, v, 1.0)
    assert abs(elastic.energy_change) <= 20 * EPS * (v @ mass @ v)


def test_inputs_are_never_written() -> None:
    mass, rows, v = random_impact(9)
    copies = mass.copy(), rows.copy(), v.copy()
    for method in METHODS:
        resolve_impact(mass, rows, v, 0.5, method=method)
    for given, copy in zip((mass, rows, v), copies, strict=True):
        assert np.array_equal(given, copy)


def test_the_result_repeats_bit_for_bit() -> None:
    mass, rows, v = random_impact(10, d=12, c=60)
    first, second = (resolve_impact(mass, rows, v, 0.5) for _ in range(2))
    assert np.array_equal(first.velocity, second.velocity)
    assert np.array_equal(first.impulses, second.impulses)


def test_a_plastic_blow_to_the_straight_arm_takes_what_the_paper_says() -> None:
    """Fig. 3 with slender rods: 7/3 J before; all of it lost at 0.5 m, 0.379845 J left at 0.7 m."""
    v = np.array([1.0, 1.0])
    for reach, left in ((0.5, 0.0), (0.7, 0.379845)):
        straight = np.array([[8 / 3, 5 / 6], [5 / 6, 1 / 3]])  # q2 = 0: I1 + I2 + m (l1² + lc² + 2 l1 lc) …
        before = 0.5 * v @ straight @ v
        impact = resolve_impact(straight, [[1.0 + reach, reach]], -v, 0.0)
        assert before == pytest.approx(7 / 3)
        assert before + impact.energy_change == pytest.approx(left, abs=1e-6)

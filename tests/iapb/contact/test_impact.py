"""What a resolved impact obeys: Newton's law, least norm, no gain of energy, at every budget and rank."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb import resolve_impact
from iapb.double_double import passive_range
from reference.exact import exact_impact, relative_energy_gain

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


def test_inputs_are_never_written() -> None:
    mass, rows, v = random_impact(9)
    copies = mass.copy(), rows.copy(), v.copy()
    for method in METHODS:
        resolve_impact(mass, rows, v, 0.5, method=method)
    for array, copy in zip((mass, rows, v), copies, strict=True):
        assert np.array_equal(array, copy)


def test_a_plastic_blow_to_the_straight_arm_takes_what_the_paper_says() -> None:
    """Fig. 3 with slender rods: 7/3 J before; all of it lost at 0.5 m, 0.379845 J left at 0.7 m."""
    v = np.array([1.0, 1.0])
    for reach, left in ((0.5, 0.0), (0.7, 0.379845)):
        straight = np.array([[8 / 3, 5 / 6], [5 / 6, 1 / 3]])  # q2 = 0: I1 + I2 + m (l1² + lc² + 2 l1 lc) …
        before = 0.5 * v @ straight @ v
        impact = resolve_impact(straight, [[1.0 + reach, reach]], -v, 0.0)
        assert before == pytest.approx(7 / 3)
        assert before + impact.energy_change == pytest.approx(left, abs=1e-6)


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


NUMBERS = st.lists(st.integers(-8, 8).map(float), min_size=3, max_size=3)
MASS = np.array([[4.0, 1.0, 0.0], [1.0, 3.0, -1.0], [0.0, -1.0, 2.0]])


@given(v=NUMBERS, change=NUMBERS)
def test_the_factor_is_the_largest_passive_one(v: list[float], change: list[float]) -> None:
    """Against rationals: KE(v + αΔv) ≤ KE(v), with equality where α < 1; 0 where every step gains."""
    before, step = np.array(v), np.array(change)
    alpha = min(1.0, passive_range(MASS, before, step)[1])
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


def face_rows(angle: float, lever_arms: tuple[float, ...] = (-0.5, 0.1, 0.5)) -> np.ndarray:
    """Three points of a box face on a wall turned by `angle`: rows (n, (r × n)_z), exactly of rank two."""
    normal = np.array([-np.sin(angle), np.cos(angle)])
    tangent = np.array([np.cos(angle), np.sin(angle)])
    points = [0.3 * -normal + arm * tangent for arm in lever_arms]
    return np.array([[*normal, r[0] * normal[1] - r[1] * normal[0]] for r in points])


@pytest.mark.parametrize("angle", np.linspace(0.1, 6.2, 37))
def test_a_face_struck_at_three_points_keeps_its_tangential_speed(angle: float) -> None:
    mass, rows = np.diag([2.0, 2.0, 0.1]), face_rows(angle)
    tangent = np.array([np.cos(angle), np.sin(angle), 0.0])
    normal = np.array([-np.sin(angle), np.cos(angle), 0.0])
    impact = resolve_impact(mass, rows, 3.0 * tangent - normal, 0.5)
    assert impact.rank == 2
    np.testing.assert_allclose(impact.velocity, 3.0 * tangent + 0.5 * normal, atol=1e-14)


def test_too_tight_a_tolerance_would_brake_the_face() -> None:
    """The other side: with noise taken for a row the tangential speed is lost, so the test above can fail."""
    mass, angle = np.diag([2.0, 2.0, 0.1]), 0.7
    tangent = np.array([np.cos(angle), np.sin(angle), 0.0])
    lost = []
    for angle in np.linspace(0.1, 6.2, 37):
        tangent = np.array([np.cos(angle), np.sin(angle), 0.0])
        impact = resolve_impact(mass, face_rows(angle), 3.0 * tangent, 0.0, rank_tolerance=1e-18)
        lost.append(abs(impact.velocity @ tangent - 3.0))
    assert max(lost) > 1.0


@pytest.mark.parametrize("difference", [1e-3, 1e-6, 1e-9])
def test_rows_that_differ_are_two(difference: float) -> None:
    rows = np.array([[1.0, 0.0, 0.0], [1.0, difference, 0.0]])
    impact = resolve_impact(np.eye(3), rows, [-1.0, 2.0, 1.0], 0.0)
    assert impact.rank == 2
    assert impact.velocity[1] == pytest.approx(0.0, abs=1e-15 / difference)
    assert impact.velocity[2] == 1.0


@pytest.mark.parametrize("difference", [1e-11, 1e-13, 1e-16])
def test_rows_within_the_tolerance_are_one_and_restitution_is_met_to_it(difference: float) -> None:
    rows = np.array([[1.0, 0.0, 0.0], [1.0, difference, 0.0]])
    impact = resolve_impact(np.eye(3), rows, [-1.0, 2.0, 1.0], 0.0)
    assert impact.rank == 1
    assert impact.velocity[1] == pytest.approx(2.0, abs=1e-9)
    assert np.abs(rows @ impact.velocity).max() <= 4.0 * difference + 1e-15


def test_the_stated_tolerance_can_be_moved() -> None:
    rows = np.array([[1.0, 0.0], [1.0, 1e-6]])
    assert resolve_impact(np.eye(2), rows, [-1.0, 1.0], 0.0, rank_tolerance=1e-5).rank == 1
    assert resolve_impact(np.eye(2), rows, [-1.0, 1.0], 0.0, rank_tolerance=1e-7).rank == 2


@pytest.mark.parametrize("seed", range(20))
def test_rounding_of_an_ill_conditioned_mass_matrix_is_not_taken_for_contacts(seed: int) -> None:
    """Rank three by construction, κ(M) = 1e12: whitening leaves noise of about ε κ(L) in dependent rows."""
    rng = np.random.default_rng(seed)
    d = 10
    basis = np.linalg.qr(rng.normal(size=(d, d)))[0]
    mass = basis * np.logspace(0, -12, d) @ basis.T
    rows = rng.normal(size=(40, 3)) @ rng.normal(size=(3, d))
    assert resolve_impact(0.5 * (mass + mass.T), rows, rng.normal(size=d), 0.5).rank == 3

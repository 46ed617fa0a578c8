"""Impacts of (19)-(21), Poisson's law and Coulomb's against exact rationals; the kit:
tests/verification/laws."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import permutations, product
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import nnls

from iapb import resolve_frictional_impact, resolve_impact, resolve_impacts
from reference.complementarity import ImpactProblem
from reference.complementarity.laws import poisson
from reference.exact import exact_impact
from tests.iapb.contact.paper import Floats, breach_of_coulomb
from verification.certificate import exact_gain
from verification.impacts import with_spectrum

EPS = 2.0**-52
Arrays = tuple[Floats, Floats, Floats]


# --- one impact against exact rationals
# ------------------------------------------------------------------------------


def problem(seed: int, d: int = 4, c: int = 3, decades: float = 0.3) -> Arrays:
    """M, J, v; coordinates, rows and speeds differ in size by up to the given number of decades."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(d, d))
    units = 10.0 ** rng.uniform(-decades, decades, d)
    mass = (root @ root.T + np.eye(d)) * units[:, None] * units
    rows = rng.normal(size=(c, d)) * units * 10.0 ** rng.uniform(-decades, decades, (c, 1))
    return (
        0.5 * (mass + mass.T),
        rows,
        rng.normal(size=d) / units * 10.0 ** rng.uniform(-decades, decades),
    )


def enclosed_gain(M: Floats, v: Floats, found: Any) -> Fraction:
    """The exact change of energy of an impact, which its interval encloses."""
    change = exact_gain(M, v, found.velocity)
    low, high = map(Fraction, found.energy_interval)
    assert low <= change <= high
    return change


def ill_conditioned(kappa: float, count: int) -> list[Arrays]:
    """M with eigenvalues from 1 to κ in random directions, random rows and velocities."""
    rng = np.random.default_rng(round(kappa))
    found = []
    for _ in range(count):
        d = int(rng.integers(2, 9))
        mass = with_spectrum(rng, np.append(kappa ** rng.uniform(0.0, 1.0, d - 1), kappa))
        rows = rng.normal(size=(int(rng.integers(1, d + 1)), d))
        found.append((mass, rows, rng.normal(size=d)))
    return found


@pytest.mark.parametrize("kappa", [1e8, 1e16])
def test_poissons_law_is_complete_only_if_no_contact_closes(kappa: float) -> None:
    found = []
    for M, J, v in ill_conditioned(kappa, 1000):
        impact = resolve_impact(M, J, v, np.linspace(0.0, 1.0, len(J)), method="poisson")
        found.append((impact.status, -(J @ impact.velocity).min() <= 1e-6 * np.abs(J @ v).max()))
    assert ("complete", False) not in found and ("complete", True) in found
    assert (
        kappa < 1e10 or ("not solved", False) in found
    )  # some 11 of 1000, whatever rounds the draws


@pytest.mark.parametrize("seed", range(30))
@pytest.mark.parametrize("clamp", [True, False])
@pytest.mark.parametrize("decades", [0.3, 4.0, 40.0])
def test_an_impact_is_the_exact_one_in_every_unit(seed: int, clamp: bool, decades: float) -> None:
    """v⁺ of (21), M(v⁺ − v) = P = Jᵀp, p of least norm; the interval encloses the exact change of
    energy, tightly."""
    M, J, v = problem(seed, decades=decades)
    # dependent to the last bit of these rows only; in rationals of rank five at most
    if decades < 1.0:
        J = np.vstack((J, 2.0 * J[2], J[1], 0.0 * J[0]))
    e = (0.0, 0.25, -0.5)[seed % 3]
    M = M + np.triu(M * EPS, 1) * (seed % 2)  # a skew part in the last bit belongs to M
    found = resolve_impact(M, J, v, e, clamp=clamp)
    truth = exact_impact(0.5 * (M + M.T), J, v, e)
    scale = np.sqrt(np.diag(M))
    size = np.linalg.norm(scale * v)
    np.testing.assert_allclose(
        scale * (found.velocity - np.array(truth.velocity, float)), 0.0, atol=1e-10 * size
    )
    momentum = np.array(truth.generalized_impulse, float)
    np.testing.assert_allclose(
        found.generalized_impulse / scale, momentum / scale, atol=1e-10 * size
    )
    np.testing.assert_allclose(J.T @ found.impulses / scale, momentum / scale, atol=1e-10 * size)
    if decades < 1.0:
        least = np.linalg.pinv(J.T, rcond=1e-10) @ momentum
        np.testing.assert_allclose(found.impulses, least, atol=1e-9 * np.abs(least).max())
    assert (found.rank, found.status) == (3, "complete") and found.clamp == pytest.approx(
        1.0, abs=1e-13
    )
    change = enclosed_gain(M, v, found)
    low, high = found.energy_interval
    assert low <= found.energy_change <= high
    assert abs(Fraction(found.energy_change) - change) <= Fraction(
        0.51 * math.ulp(found.energy_change)
    )
    assert high <= 0.0 or not clamp
    energy = float(v @ M @ v)
    assert high - low <= 5.0 * math.ulp(found.energy_change) + 1e-28 * energy * 10.0 ** min(
        decades, 3.0
    )


@pytest.mark.parametrize("power", [-535, -525, -400, 0, 300, 500, 511])
@pytest.mark.parametrize("skew", [0.0, EPS])
def test_energy_is_enclosed_where_its_squares_leave_the_range(power: int, skew: float) -> None:
    """Elastic and back: all but rounding cancels. Of entries asymmetric in the last bit both
    count."""
    for seed in range(40):
        M, J, v = problem(seed, d=3, c=2)
        M = M + np.triu(np.abs(M) * skew, 1)
        v = np.ldexp(v / np.abs(v).max() / 16.0, power)
        for e, clamp in ((1.0, False), (1.0, True), (0.3, True)):
            found = resolve_impact(M, J, v, e, clamp=clamp)
            assert enclosed_gain(M, v, found) <= 0 or not clamp
            if e == 1.0 and power in (0, 300):  # as narrow as double-double sums of these products
                low, high = found.energy_interval
                assert high - low <= 2.0**-90 * float(np.abs(v) @ np.abs(M) @ np.abs(v))


def test_energy_is_enclosed_where_only_halves_of_its_products_overflow() -> None:
    """Δ A s is finite, but not the product of the rounded halves of its factors; a bound of −∞ is
    not accepted."""
    M = np.array([[float.fromhex("0x1.492a43be43642p-1")]])
    v = np.array([float.fromhex("-0x1.c386bbc204f8ap+511")])
    found = resolve_impact(M, np.eye(1), v, 0.0)
    change = enclosed_gain(M, v, found)
    assert found.energy_interval[1] < 0.0
    assert abs(Fraction(found.energy_change) - change) <= Fraction(math.ulp(found.energy_change))


def test_subnormal_speeds_have_the_nearest_result_that_exists() -> None:
    assert resolve_impact([[3.0]], [[1.0]], [-5e-324], 1.0).velocity[0] == 5e-324
    assert resolve_impact([[3.0]], [[1.0]], [-5e-324], 0.0).velocity[0] == 0.0


@given(
    seed=st.integers(0, 10_000),
    d=st.integers(1, 6),
    c=st.integers(0, 8),
    clamp=st.booleans(),
    budget=st.none() | st.integers(0, 6),
    tolerance=st.sampled_from([None, 1e-6]),
)
def test_many_at_once_are_those_one_by_one_bit_for_bit(
    seed: int, d: int, c: int, clamp: bool, budget: int | None, tolerance: float | None
) -> None:
    rng = np.random.default_rng(seed)
    options = {"clamp": clamp, "budget": budget, "rank_tolerance": tolerance}
    root = rng.normal(size=(5, d, d))
    masses = root @ root.transpose(0, 2, 1) + 10.0 ** rng.uniform(-9, 0) * np.eye(d)
    rows = rng.normal(size=(5, c, d)) * 10.0 ** rng.uniform(-6, 6, (5, c, 1))
    rows[:, 2:4] = rows[:, 1:2]
    v = rng.normal(size=(5, d)) * 10.0 ** rng.uniform(-300, 9, (5, 1))
    e = rng.uniform(-1.0, 1.0, 5)
    found: Any = resolve_impacts(masses, rows, v, e, **options)  # type: ignore[arg-type]
    for k in range(5):
        single = resolve_impact(masses[k], rows[k], v[k], e[k], **options)  # type: ignore[arg-type]
        for name in (
            "velocity",
            "generalized_impulse",
            "impulses",
            "energy_interval",
            "rank",
            "energy_change",
            "clamp",
            "status",
        ):
            np.testing.assert_array_equal(
                getattr(found, name)[k], getattr(single, name), strict=False
            )


# --- how an impact ends; ranks and tolerances
# ------------------------------------------------------------------------

V = [-1.0, -2.0, 3.0]
NEAR = [[1.0, 0.0, 0.0], [1.0, 1e-4, 0.0]]


@pytest.mark.parametrize(
    ("rows", "v", "options", "status", "rank"),
    [
        (np.eye(3), V, {}, "complete", 3),
        (np.eye(3), V, {"budget": 2}, "budget", 2),
        (NEAR, V, {"budget": 1, "rank_tolerance": 1e-3}, "complete", 1),
        (NEAR, V, {"budget": 1, "rank_tolerance": 1e-5}, "budget", 1),
        ([[1.0, 0.0, 0.0], [1.0, 1e-11, 0.0]], V, {}, "complete", 1),
        ([[1.0, 0.0, 0.0]], [-1e-300, 1e100, 0.0], {}, "cancelled", 1),
        (np.zeros((2, 3)), V, {}, "complete", 0),
    ],
)
def test_how_an_impact_ends(
    rows: Any, v: list[float], options: dict[str, Any], status: str, rank: int
) -> None:
    found = resolve_impact(np.eye(3), rows, v, 0.5, **options)
    assert (found.status, found.rank, found.rows_used) == (status, rank, options.get("budget"))
    assert (
        rank > 0
        or np.array_equal(found.velocity, v)
        and not found.impulses.any()
        and found.energy_change == 0.0
    )


def test_a_budget_takes_the_rows_that_close_fastest_and_each_takes_energy() -> None:
    """Rows orthogonal in the kinetic metric: the fastest are reversed, the others keep their
    speed."""
    for seed in range(5):
        M, _, v = problem(seed, d=5)
        rows = (
            np.linalg.cholesky(M) @ np.linalg.qr(np.random.default_rng(seed).normal(size=(5, 4)))[0]
        ).T
        speeds = rows @ v
        change = 0.0
        rows = rows * [[1.0], [20.0], [0.3], [4.0]]
        for budget in range(5):
            found = resolve_impact(M, rows, v, 0.5, budget=budget)
            expected = speeds.copy()
            expected[np.argsort(-np.abs(speeds))[:budget]] *= -0.5
            np.testing.assert_allclose(
                rows @ found.velocity / [1.0, 20.0, 0.3, 4.0], expected, atol=1e-12
            )
            assert found.energy_change <= change
            change = found.energy_change


# --- contacts that only push
# -----------------------------------------------------------------------------------------


@given(seed=st.integers(0, 100_000), d=st.integers(2, 6), c=st.integers(2, 6))
def test_unequal_restitution_is_poissons_law(seed: int, d: int, c: int) -> None:
    """As the reference solves its two problems; what dependent rows leave open is still passive and
    only pushes."""
    M, J, v = problem(seed, d, c)
    J = J * 10.0 ** np.random.default_rng(seed).uniform(-2, 2, (c, 1))
    rng = np.random.default_rng(seed + 1)
    J[-1] *= rng.random() < 0.8
    e = rng.uniform(0.0, 1.0, c)
    found = resolve_impact(M, J, v, e)
    size = np.sqrt(v @ M @ v)
    length = np.linalg.norm(np.linalg.solve(np.linalg.cholesky(M), J.T), axis=0)
    assert found.law == "Poisson, two LCPs" and found.status == "complete"
    assert found.energy_change <= 0.0 and found.impulses.min() >= 0.0 and found.clamp >= 1.0 - 1e-13
    assert (J @ found.velocity >= -1e-11 * size * length).all()
    np.testing.assert_allclose(
        M @ (found.velocity - v), J.T @ found.impulses, atol=1e-10 * size * np.abs(M).max()
    )
    if np.linalg.matrix_rank(J[length > 0.0]) == np.count_nonzero(length):
        truth = poisson(ImpactProblem.from_impact(M, J[length > 0.0], v, e[length > 0.0]))
        v_plus = truth.velocity
        p = truth.impulse
        np.testing.assert_allclose(found.velocity, v_plus, atol=1e-8 * np.abs(v).max())
        np.testing.assert_allclose(found.impulses[length > 0.0], p, atol=1e-7 * (p.max() + size))
        assert found.rank == np.count_nonzero(p > 1e-9 * p.max(initial=0.0))


def test_a_contact_that_just_touches_after_compression_shares_the_impact() -> None:
    """It is the last row; the first two are opposed. v⁺ from rationals."""
    rows = [[-2.0, 1.0], [2.0, -1.0], [1.0, -1.0], [0.0, -1.0]]
    e = [0.0, 0.0, 0.5, 1.0]
    found = resolve_impact([[2.0, -2.0], [-2.0, 14.0]], rows, [-4.0, 0.0], e)
    np.testing.assert_allclose(found.velocity, [-0.1184, -0.2368], atol=1e-15)


def test_a_contact_that_is_far_slower_than_another_bounces_too() -> None:
    for slow in (1e-10, 1e-13, 1e-20, 1e-100):
        found = resolve_impact(np.eye(2), np.eye(2), [-1.0, -slow], [0.5, 0.25])
        np.testing.assert_allclose(found.velocity, [0.5, 0.25 * slow], rtol=1e-14)
        assert found.status == "complete"


@pytest.mark.parametrize("kappa", [1e6, 1e10, 1e12])
@pytest.mark.parametrize("mu", [None, 0.0, 0.3])
def test_poisson_and_friction_are_refined_for_the_given_mass_matrix(
    mu: float | None, kappa: float
) -> None:
    """Restitution, and M Δv = Jᵀp + Tᵀp_t in the kinetic metric, in extended precision. With L Lᵀ in
    place of M these miss by 6e-5 and 2e-3 at κ = 1e12. The factor that judges has an error of
    1e-16 √κ itself, a hundred times as much in the worst draw of another LAPACK."""
    for M, J, v in ill_conditioned(kappa, 60):
        L = np.linalg.cholesky(M)
        if mu is None:  # a single row: Poisson's law is an equality
            J = J[:1] * -np.sign(J[:1] @ v)
            found = resolve_impact(M, J, v, 0.5, method="poisson")
        else:
            T = np.roll(J, 1, axis=1)
            found = resolve_frictional_impact(M, J, T, v, 0.5, mu)
        length = np.linalg.norm(np.linalg.solve(L, J.T), axis=0)
        wide = J.astype(np.longdouble) / length[:, None]
        unmet = wide @ found.velocity + 0.5 * (wide @ v)
        assert np.abs(unmet).max() <= 1e-9 * np.abs(wide @ v).max()
        change = M.astype(np.longdouble) @ (found.velocity.astype(np.longdouble) - v)
        left = change - J.T.astype(np.longdouble) @ found.impulses
        if mu is not None:
            left -= T.T.astype(np.longdouble) @ found.tangential_impulses[:, 0]
        missed, whole = (np.linalg.solve(L, p.astype(float)) for p in (left, change))
        assert np.linalg.norm(missed) <= 1e-12 * kappa**0.5 * np.linalg.norm(whole)


# --- friction in an impact
# -------------------------------------------------------------------------------------------


def rubbing(seed: int, most: float = 2.0) -> tuple[Any, ...]:
    """M, J, T, v, e, μ up to `most`: couplings strong enough that limits may never settle."""
    rng = np.random.default_rng(seed)
    d = int(rng.integers(2, 8))
    c = int(rng.integers(1, 5))
    m = int(rng.integers(1, 3))
    root = rng.normal(size=(d, d))
    rows = rng.normal(size=(c, d))
    tangents = rng.normal(size=(c, m, d))
    v = rng.normal(size=d)
    e = float(rng.choice([0.0, 0.4, 1.0]))
    mu = rng.uniform(0.0, most, c)
    return root @ root.T + 0.1 * np.eye(d), rows, tangents, v, e, mu


@pytest.mark.parametrize("most", [1.0, 2.0])
def test_friction_obeys_coulomb_and_gains_nothing(most: float) -> None:
    """Within the cones; sticks or slides if complete; reduced no more than its energy demands. What
    else it keeps, the kit asks (tests/verification/laws/test_contracts.py)."""
    seen: dict[str, int] = {"complete": 0, "reduced": 0, "scaled": 0, "obeyed": 0}
    for seed in range(300):
        M, J, T, v, e, mu = rubbing(seed, most)
        found = resolve_frictional_impact(M, J, T, v, e, mu)
        plain = resolve_impact(M, J, v, e)
        p = found.impulses
        p_t = found.tangential_impulses
        assert found.energy_change <= 0.0
        limit = mu * np.maximum(p, 0.0)
        assert np.all(np.linalg.norm(p_t, axis=1) <= limit * (1 + 1e-9) + 1e-12 * np.abs(p).max())
        seen[found.status] += 1
        assert found.status != "complete" or found.friction_share >= 1.0 - 1e-9
        alone = plain.impulses.min() > 0.0 and len(J) * (1 + T.shape[1]) <= len(v)
        if found.status == "scaled":  # as much as keeps the energy
            assert found.friction_share < 1.0
            assert found.energy_change == pytest.approx(0.0, abs=1e-9 * float(v @ M @ v))
        elif found.status == "complete" and alone:
            seen["obeyed"] += 1
            worst = breach_of_coulomb(T, p_t, limit, found.velocity)
            assert worst <= 1e-7 * np.abs(T).max() * np.linalg.norm(v) * len(v)
    assert seen["obeyed"] > 10 and seen["scaled"] > 3 and seen["reduced"] < 30 * most
    assert most == 1.0 or seen["reduced"] > 0


@pytest.mark.parametrize("decades", [5.0, 15.0])
def test_rows_of_friction_may_differ_in_size(decades: float) -> None:
    """As many sizes as contacts; where p is not unique, the choice depends on them."""
    for seed in range(60):
        M, J, T, v, e, mu = rubbing(seed, 0.5)
        sizes = np.logspace(-decades, decades, len(J))
        rows = J * sizes[:, None]
        tangents = T * sizes[:, None, None]
        plain = resolve_frictional_impact(M, J, T, v, e, mu)
        found = resolve_frictional_impact(M, rows, tangents, v, e, mu)
        pushed = found.impulses @ rows + np.tensordot(found.tangential_impulses, tangents, 2)
        size = np.linalg.norm(M) * np.linalg.norm(v)
        np.testing.assert_allclose(M @ (found.velocity - v), pushed, atol=1e-9 * size)
        if len(J) <= len(v) and plain.status == found.status == "complete":
            np.testing.assert_allclose(found.velocity, plain.velocity, atol=1e-7 * size)


def poisson_with_least_compression(M: Floats, J: Floats, v: Floats, e: Floats) -> Floats:
    """v⁺ of Poisson's law with the p_c ≥ 0 of least Σ W_ii p_c², by least squares: Aᵀp_c = Δu_c
    weighs 1e6 times as much as p_c = 0."""
    L = np.linalg.cholesky(M)
    A = np.linalg.solve(L, J.T)
    A = A / np.linalg.norm(A, axis=0)
    u = L.T @ v
    stopped = A @ nnls(A, -u)[0]
    touching = A.T @ (u + stopped) < 1e-9 * np.linalg.norm(u)
    goal = np.append(1e6 * stopped, np.zeros(len(J)))
    p_c = nnls(np.vstack([1e6 * A * touching, np.eye(len(J))]), goal)[0]
    returned = u + A @ ((1.0 + e) * p_c)
    return np.asarray(np.linalg.solve(L.T, returned + A @ nnls(A, -returned)[0]))


@pytest.mark.parametrize("every", [pytest.param(1, marks=pytest.mark.thorough), 17])
@pytest.mark.parametrize("v", [[-1.0, 0.0, 0.0], [-1.0, 0.5, 0.25], [-2.0, 0.0, 3.0]])
def test_the_order_of_four_corners_does_not_matter(v: list[float], every: int) -> None:
    """A plate with e drawn from 0, 0.3, 0.8 and 1; with equal e the answer is that of one e."""
    M = np.diag([1.3, 0.02, 0.03])
    corners = np.array([[1.0, x, y] for x in (-0.2, 0.3) for y in (-0.1, 0.4)])
    for e in np.array(list(product((0.0, 0.3, 0.8, 1.0), repeat=4)))[::every]:
        first = resolve_impact(M, corners, v, e, method="poisson")
        truth = poisson_with_least_compression(M, corners, np.array(v), e)
        np.testing.assert_allclose(first.velocity, truth, atol=1e-8)
        for order in permutations(range(4)):
            rows = corners[list(order)] * [[1.0], [0.3], [70.0], [1.0]]
            found = resolve_impact(M, rows, v, e[list(order)], method="poisson")
            assert np.abs(found.velocity - first.velocity).max() <= 1e-12
            assert exact_gain(M, np.array(v), found.velocity) <= 0
    alike = resolve_impact(M, corners, v, [0.3] * 4, method="poisson").velocity
    assert np.array_equal(alike, resolve_impact(M, corners, v, 0.3, method="poisson").velocity)

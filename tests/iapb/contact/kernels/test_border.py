"""Scaling by powers of two, refusals, units of results: the border of an impact against plain numpy and rationals."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from iapb.compiled import block
from iapb.contact.kernels import border
from iapb.contact.kernels.border import (
    make_border_work,
    row_sizes,
    scale_impact,
    unscale_impact,
    whole_impact,
)

Arrays = tuple[np.ndarray, np.ndarray, np.ndarray]
INF, NAN = math.inf, math.nan


def problem(seed: int, d: int = 4, c: int = 3, decades: float = 40.0) -> Arrays:
    """M, J, v whose coordinates, rows and speeds differ in size by up to the given number of decades."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(d, d))
    units = 10.0 ** rng.uniform(-decades, decades, d)
    mass = (root @ root.T + np.eye(d)) * units[:, None] * units
    mass = 0.5 * (mass + mass.T)
    rows = rng.normal(size=(c, d)) * units * 10.0 ** rng.uniform(-decades, decades, (c, 1))
    return mass, rows, rng.normal(size=d) / units * 10.0 ** rng.uniform(-decades, decades)


def scaled(mass: np.ndarray, rows: np.ndarray, v: np.ndarray) -> tuple[Any, tuple[int, int, int]]:
    work: Any = block(make_border_work(len(v), len(rows)))
    return work, scale_impact(mass, rows, v, work)


def whole(mass: Any, rows: Any, v: Any, e: float = 0.5, clamped: bool = True, tolerance: float = 0.0,
          budget: int = 99) -> dict[str, Any]:
    mass, rows, v = (np.array(x, dtype=float) for x in (mass, rows, v))
    work: Any = block(make_border_work(len(v), len(rows)))
    v_plus, momentum, impulses = np.full(len(v), NAN), np.full(len(v), NAN), np.full(len(rows), NAN)
    wrong, (rank, status), clamp, energies = whole_impact(mass, rows, v, e, tolerance, budget, clamped, work, v_plus,
                                                          momentum, impulses)
    return {"wrong": wrong, "rank": rank, "status": status, "clamp": clamp, "energies": energies, "v": v_plus,
            "momentum": momentum, "impulses": impulses}


def exponents_of(values: np.ndarray) -> np.ndarray:
    return np.frexp(values)[1]


# --- scaling in --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(12))
def test_scaling_is_exact_and_brings_every_size_near_one(seed: int) -> None:
    """v' = 2^−(s + k) v, M' = 2^(s + s) M, J' = 2^(s + r) J: diagonals in [½, 2), largest entries in [½, 1)."""
    mass, rows, v = problem(seed)
    rows[1] = 0.0
    v[seed % 4] = 0.0
    work, wrong = scaled(mass, rows, v)
    s, r, k = work.coordinate_exponent, work.row_exponent, int(work.velocity_exponent[0])
    assert wrong == (border.FINE, 0, 0)
    assert np.array_equal(work.mass, np.ldexp(mass, s[:, None] + s))
    assert np.array_equal(work.symmetric, work.mass)
    assert np.array_equal(work.rows, np.ldexp(rows, r[:, None] + s).T)
    assert np.array_equal(work.velocity, np.ldexp(v, -(s + k)))
    assert (np.diag(work.mass) >= 0.5).all() and (np.diag(work.mass) < 2.0).all()
    largest = np.abs(work.rows).max(axis=0)
    assert largest[1] == r[1] == 0.0 and (np.delete(exponents_of(largest), 1) == 0).all()
    assert exponents_of(np.abs(work.velocity).max()) == 0
    np.testing.assert_allclose(work.lower @ work.lower.T, work.mass, rtol=0.0, atol=1e-14)
    assert not np.triu(work.lower, 1).any() and (np.diag(work.lower) > 0.0).all()


@pytest.mark.parametrize("far", [999, 1000, 1001, 1500])
def test_entries_too_far_apart_to_be_scaled_exactly_are_told(far: int) -> None:
    """2^−1000 of the largest entry is still exact; zeros never count."""
    _, rows, _ = problem(0, 2, 1)
    for v in ([2.0**500, -(2.0 ** (500 - far))], [0.0, 1.0], [0.0, 0.0]):
        work, _ = scaled(np.eye(2), rows, np.array(v))
        assert work.underflows[0] == (v[0] != 0.0 and far > 1000)
        if v[0]:
            assert work.velocity_exponent[0] == 501


def test_at_rest_the_scale_is_one() -> None:
    work, _ = scaled(*problem(1)[:2], np.zeros(4))
    assert work.velocity_exponent[0] == 0 and not work.velocity.any()


def test_a_skew_part_up_to_1e9_of_the_diagonal_is_rounding() -> None:
    """The symmetric part is factored; M itself is kept for energies. One part in a hundred more is refused."""
    for units in (np.ones(3), np.array([2.0**40, 2.0**-40, 1.0])):
        base = np.eye(3) + 0.25
        skew = np.zeros((3, 3))
        skew[2, 0], skew[0, 2], skew[1, 0] = 0.495e-9, -0.495e-9, 1e-12
        mass = (base + skew) * units[:, None] * units
        work, wrong = scaled(mass, np.ones((1, 3)), np.ones(3))
        assert wrong == (border.FINE, 0, 0)
        # rtol: sums and halves of neighbours round once
        np.testing.assert_allclose(work.symmetric, 0.5 * (work.mass + work.mass.T), rtol=3e-16)
        assert not np.array_equal(work.mass, work.mass.T)
        mass = (base + 1.1 * skew) * units[:, None] * units
        assert scaled(mass, np.ones((1, 3)), np.ones(3))[1] == (border.ASYMMETRIC, 0, 2)


@pytest.mark.parametrize("bad", [NAN, INF, -INF])
def test_the_first_entry_that_is_not_finite_is_named(bad: float) -> None:
    for i in range(3):
        for j in range(3):
            mass, rows, v = problem(2, 3, 4, 1.0)
            mass[i, j] = mass[2, 2] = bad
            v[1] = rows[1, 1] = bad
            assert scaled(mass, rows, v)[1] == (border.MASS_NOT_FINITE, i, j)
    for i in range(3):
        mass, rows, v = problem(2, 3, 4, 1.0)
        v[i:] = rows[1, 1] = bad
        assert scaled(mass, rows, v)[1] == (border.VELOCITY_NOT_FINITE, i, 0)
    for i in range(4):
        for j in range(3):
            mass, rows, v = problem(2, 3, 4, 1.0)
            rows[i, j:] = rows[i + 1:] = bad
            assert scaled(mass, rows, v)[1] == (border.ROWS_NOT_FINITE, i, j)


def test_what_is_not_positive_definite_is_named_by_place() -> None:
    rows, v = np.ones((1, 4)), np.ones(4)
    for least in range(4):
        for value in (0.0, -1.0, -5e-324):
            mass = np.diag([3.0, 2.0, 1.0, 4.0])
            mass[least, least] = value
            assert scaled(mass, rows, v)[1] == (border.DIAGONAL, least, least)
    mass = np.diag([1.0, -2.0, -3.0, -1.0])
    assert scaled(mass, rows, v)[1] == (border.DIAGONAL, 2, 2)
    mass = np.eye(4)
    mass[1, 3] = mass[3, 1] = mass[3, 2] = mass[2, 3] = -5.0
    mass[2, 0] = mass[0, 2] = 2.5
    assert scaled(mass, rows, v)[1] == (border.ENTRY, 1, 3)
    mass = np.eye(4)
    mass[1, 3] = mass[3, 1] = 2.0  # scaled it is 2, which a positive definite matrix might have: pivots decide
    assert scaled(mass, rows, v)[1] == (border.NOT_DEFINITE, 4, 0)
    for pivot in range(1, 4):
        mass = np.eye(4)
        mass[pivot, 0] = mass[0, pivot] = 1.0
        assert scaled(mass, rows, v)[1] == (border.NOT_DEFINITE, pivot + 1, 0)


def test_row_sizes_are_those_of_the_caller() -> None:
    """2^−r over its largest, 1 for rows of zeros, and never so small that it is lost."""
    _, rows, v = problem(3, 3, 5, 0.0)
    for powers in ([0, 0, 0, 0, 0], [4, 4, 4, 4, 4], [3, -2, 0, 7, 1], [-3, -4, -5, -9, -2], [600, -600, 0, 0, 300]):
        for empty in ([], [1], [3], [0, 4]):
            given = np.ldexp(rows / 2.0 ** exponents_of(np.abs(rows).max(axis=1))[:, None], np.array(powers)[:, None])
            given[empty] = 0.0
            work, _ = scaled(np.eye(3), given, v)
            r = work.row_exponent[~np.isin(np.arange(5), empty)]
            expected = np.ones(5)
            expected[~np.isin(np.arange(5), empty)] = 2.0 ** np.maximum(r.min() - r, -1000)
            assert row_sizes(work) == bool((expected == 1.0).all())
            assert np.array_equal(work.size, expected)


# --- the whole impact ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("clamped", [True, False])
def test_every_result_is_that_of_the_scaled_impact_in_the_callers_units(seed: int, clamped: bool) -> None:
    """Powers of two: q' = 2^−s q, rows 2^r, mass 2^m, time 2^−t. No bit of any result differs but for its unit."""
    rng = np.random.default_rng(seed)
    mass, rows, v = problem(seed, decades=0.5)
    rows = np.vstack((rows, rows[0] + rows[1], 0.0 * rows[0]))
    s, m, t, e = rng.integers(-40, 40, 4), 2 * int(rng.integers(-30, 30)), int(rng.integers(-60, 60)), 0.7
    r = int(rng.integers(-50, 50))  # one for all rows: their least norm depends on their ratios
    plain = whole(mass, rows, v, e, clamped)
    other = whole(np.ldexp(mass, s[:, None] + s + m), np.ldexp(rows, s + r), np.ldexp(v, t - s), e, clamped)
    assert plain["wrong"] == other["wrong"] == (border.FINE, 0, 0)
    assert np.array_equal(other["v"], np.ldexp(plain["v"], t - s))
    assert np.array_equal(other["momentum"], np.ldexp(plain["momentum"], s + t + m))
    assert np.array_equal(other["impulses"], np.ldexp(plain["impulses"], t + m - r))
    assert (other["rank"], other["status"], other["clamp"]) == (plain["rank"], plain["status"], plain["clamp"])
    assert other["energies"][0] == math.ldexp(plain["energies"][0], 2 * t + m)
    np.testing.assert_allclose(other["energies"][1:], np.ldexp(plain["energies"][1:], 2 * t + m), rtol=1e-15)


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("clamped", [True, False])
@pytest.mark.parametrize("decades", [0.0, 3.0])
def test_a_whole_impact_is_that_of_plain_numpy(seed: int, clamped: bool, decades: float) -> None:
    """J v⁺ = −e J v, M(v⁺ − v) = P = Jᵀp, p of least norm; the energies enclose the rational change."""
    mass, rows, v = problem(seed, decades=0.3)
    rows = np.vstack((rows, rows[0] - 2.0 * rows[2], rows[1])) * 10.0 ** np.random.default_rng(seed).uniform(
        -decades, decades, (5, 1))
    found = whole(mass, rows, v, 0.25, clamped)
    assert (found["wrong"], found["rank"], found["status"]) == ((border.FINE, 0, 0), 3, border.COMPLETE)
    assert found["clamp"] == pytest.approx(1.0, abs=1e-14)
    independent = np.linalg.pinv(rows[:3] @ np.linalg.solve(mass, rows[:3].T))
    momentum = -1.25 * rows[:3].T @ independent @ rows[:3] @ v
    np.testing.assert_allclose(found["momentum"], momentum, rtol=1e-9, atol=1e-11 * np.abs(momentum).max())
    np.testing.assert_allclose(mass @ (found["v"] - v), momentum, atol=1e-11 * np.abs(momentum).max())
    least = np.linalg.pinv(rows.T) @ momentum
    np.testing.assert_allclose(rows.T @ found["impulses"], momentum, atol=1e-11 * np.abs(momentum).max())
    np.testing.assert_allclose(found["impulses"], least, rtol=1e-6, atol=1e-8 * np.abs(least).max())
    change = exact_change(mass, v, found["v"])
    middle, low, high = found["energies"]
    assert Fraction(low) <= change <= Fraction(high) and low <= middle <= high
    assert abs(Fraction(middle) - change) <= Fraction(0.51 * math.ulp(middle))  # summed exactly, rounded once
    assert high - low <= 5.0 * math.ulp(middle)


def exact_change(mass: np.ndarray, v: np.ndarray, w: np.ndarray) -> Fraction:
    """½ (wᵀMw − vᵀMv) in rationals."""
    a, b = ([Fraction(float(x)) for x in vector] for vector in (v, w))
    return sum((Fraction(float(m)) * (b[i] * b[j] - a[i] * a[j]) for (i, j), m in np.ndenumerate(mass)),
               Fraction(0)) / 2


def test_how_an_impact_ends() -> None:
    v = [-1.0, -2.0, 3.0]
    assert whole(np.eye(3), np.eye(3), v)["status"] == border.COMPLETE
    short = whole(np.eye(3), np.eye(3), v, budget=2)
    assert (short["status"], short["rank"]) == (border.BUDGET, 2)
    assert whole(np.eye(3), np.eye(3)[:2], v, budget=2)["status"] == border.COMPLETE
    assert whole(np.eye(3), np.eye(3), v, budget=3)["status"] == border.COMPLETE
    assert whole(np.eye(3), np.eye(3), v, budget=0)["status"] == border.BUDGET
    # rows closer than the tolerance to the span of the others are no work left undone
    near = [[1.0, 0.0, 0.0], [1.0, 1e-4, 0.0]]
    assert whole(np.eye(3), near, v, budget=1, tolerance=1e-3)["status"] == border.COMPLETE
    assert whole(np.eye(3), near, v, budget=1, tolerance=1e-5)["status"] == border.BUDGET
    assert whole(np.eye(3), near, v, tolerance=1e-3)["rank"] == 1
    assert whole(np.eye(3), near, v, tolerance=1e-5)["rank"] == 2
    for rows, status in (([[1.0, 0.0]], border.CANCELLED), (np.eye(2), border.CANCELLED),
                         (np.zeros((0, 2)), border.COMPLETE)):
        assert whole(np.eye(2), rows, [-1e-300, 1e100])["status"] == status
    assert whole(np.eye(2), [[1.0, 0.0]], [-1.0, 0.0])["status"] == border.COMPLETE


def test_a_result_beyond_doubles_is_named_by_what_it_is() -> None:
    rows, huge = [[1.0, 0.0]], 1.7e308
    assert whole(np.eye(2), rows, [1.0, 1.0])["wrong"][0] == border.FINE
    away = whole([[1.0, 0.9], [0.9, 1.0]], rows, [huge, huge], 1.0)
    assert away["wrong"] == (border.VELOCITY_RANGE, 0, 0) and all(math.isnan(x) for x in away["energies"])
    assert whole(1e200 * np.eye(2), rows, [-1e200, 0.0])["wrong"] == (border.MOMENTUM_RANGE, 0, 0)
    assert whole(np.eye(2), [[1e-300, 0.0]], [-1e100, 0.0])["wrong"] == (border.IMPULSE_RANGE, 0, 0)
    assert whole(np.eye(2), rows, [-1e200, 0.0])["wrong"] == (border.ENERGY_RANGE, 0, 0)
    assert whole(np.eye(2), rows, [-1e153, 0.0])["wrong"] == (border.FINE, 0, 0)


@pytest.mark.parametrize("clamped", [True, False])
def test_scaling_back_clamps_again_what_it_rounds_upwards_and_only_then(clamped: bool) -> None:
    """A v⁺ that gains: with the clamp the step is shortened, its impulses by the same factor; without it stays."""
    mass, v = np.array([[2.0, 0.5], [0.5, 1.0]]), np.array([-1e-4, 0.75e-4])
    for gain, least, most in ((1.5, 0.4, 0.8), (0.5, 1.0, 1.0)):  # 1 / (1 + gain) takes all energy, 2 / … none
        work, _ = scaled(mass, np.array([[1.0, 0.5]]), v)
        direction = -v  # v⁺ = v − (1 + gain) v gains where |gain| > 1
        change = (1.0 + gain) * direction
        s, r, k = work.coordinate_exponent, int(work.row_exponent[0]), int(work.velocity_exponent[0])
        work.v_plus[:] = np.ldexp(v + change, -(s + k))
        work.momentum[:], work.impulses[:] = [3.0, 5.0], [7.0]
        v_plus, momentum, impulses = np.empty(2), np.empty(2), np.empty(1)
        found, energies = unscale_impact(mass, v, clamped, work, v_plus, momentum, impulses)
        assert least <= found <= most if clamped else found == 1.0
        np.testing.assert_allclose(v_plus, v + found * change, rtol=1e-15)
        np.testing.assert_allclose(momentum, found * np.ldexp([3.0, 5.0], k - s), rtol=1e-15)
        np.testing.assert_allclose(impulses, found * np.ldexp([7.0], r + k), rtol=1e-15)
        exact = exact_change(mass, v, v_plus)
        assert Fraction(energies[1]) <= exact <= Fraction(energies[2])
        assert abs(Fraction(energies[0]) - exact) <= Fraction(0.51 * math.ulp(energies[0]))
        assert energies[1] <= energies[0] <= energies[2] and (energies[2] <= 0.0) == (exact <= 0)


def test_many_are_each_by_itself_and_the_first_refused_is_told() -> None:
    n, d, c = 3, 4, 2
    masses, rows, v = (np.stack(arrays) for arrays in zip(*(problem(k, d, c, 2.0) for k in range(n)), strict=True))
    e, work = np.array([0.1, 0.9, -0.4]), block(make_border_work(d, c))
    v_plus, momentum, impulses = np.empty((n, d)), np.empty((n, d)), np.empty((n, c))
    counts, numbers = np.full((n, 2), -7), np.full((n, 4), NAN)

    def run() -> Any:
        return border.whole_impacts(masses, rows, v, e, 0.0, 1, True, work, v_plus, momentum, impulses, counts, numbers)

    assert run() == ((border.FINE, 0, 0), n)
    for k in range(n):
        one = whole(masses[k], rows[k], v[k], e[k], budget=1)
        assert counts[k].tolist() == [one["rank"], one["status"]] == [1, border.BUDGET]
        assert numbers[k].tolist() == [one["clamp"], *one["energies"]]
        for found, name in ((v_plus, "v"), (momentum, "momentum"), (impulses, "impulses")):
            assert np.array_equal(found[k], one[name])
    rows[1, 1, 2] = v[2, 0] = NAN
    assert run() == ((border.ROWS_NOT_FINITE, 1, 2), 1)


def test_bounds_of_energy_are_rounded_outwards_and_keep_their_sign() -> None:
    outward = border._outward
    for value, exponent in ((1.5, 0), (-1.5, 3), (3.0, -1074), (-3.0, -1074), (-1e-300, -100), (1e-300, -100)):
        exact = Fraction(value) * Fraction(2) ** exponent
        low, high = float(outward(value, exponent, -INF)), float(outward(value, exponent, INF))
        assert Fraction(low) <= exact <= Fraction(high)
        nearest = math.ldexp(value, exponent)
        assert low in (nearest, math.nextafter(nearest, -INF)) and high in (nearest, math.nextafter(nearest, INF))
        assert (high <= 0.0) == (value < 0.0) and (low >= 0.0) == (value > 0.0)
    assert outward(0.0, 5, INF) == outward(0.0, 5, -INF) == 0.0

"""The pieces of one impact, each against its formula in numpy: whitening, basis, least norm, refinement, clamp."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.compiled import block
from iapb.contact.kernels.collide import largest_share
from iapb.contact.kernels.impact import (
    RANK_TOLERANCE,
    apply_change,
    factored_impact,
    make_impact_work,
    rank_tolerance,
    refine_change,
    whiten_impact,
)
from iapb.contact.kernels.projector import (
    _next_direction,
    minimum_norm_impulses,
    orthonormal_basis,
    projected_change,
    unit_columns,
)


def masses(rng: np.random.Generator, d: int) -> tuple[np.ndarray, np.ndarray]:
    root = rng.normal(size=(d, d))
    mass = root @ root.T + np.eye(d)
    return mass, np.linalg.cholesky(mass)


def test_whitening_gives_unit_rows_their_lengths_and_the_velocity() -> None:
    """A = J L⁻ᵀ, u = Lᵀv, in scratch that is larger than the impact; a row of zeros stays one."""
    rng = np.random.default_rng(0)
    for d, count in ((3, 2), (5, 4), (6, 1)):
        work: Any = block(make_impact_work(6, 5))
        _, lower = masses(rng, d)
        J, v = rng.normal(size=(count, d)), rng.normal(size=d)
        J[-1] *= count == 1
        work.columns[:d, :count] = J.T
        whiten_impact(lower, v, count, work)
        A = np.linalg.solve(lower, J.T).T
        length = np.linalg.norm(A, axis=1)
        assert work.length[:count] == pytest.approx(length, abs=1e-13)
        unit = A / np.where(length > 0.0, length, 1.0)[:, None]
        assert work.columns[:d, :count] == pytest.approx(unit.T, abs=1e-13)
        assert np.array_equal(work.rows[:d, :count], work.columns[:d, :count])
        assert work.u[:d] == pytest.approx(lower.T @ v, abs=1e-13)


def test_the_tolerance_grows_with_the_spread_of_the_factor() -> None:
    """RANK_TOLERANCE, or 8 d ε/2 × largest over smallest diagonal entry of L, whichever is larger."""
    for diagonal in ([1.0, 2.0, 0.5], [1.0, 1e9, 3.0], [1e9, 1.0, 1.0], [2.0, 1.0, 1e-9], [1e-9, 4.0, 1.0]):
        expected = max(RANK_TOLERANCE, 8.0 * 3 * 2.0**-53 * max(diagonal) / min(diagonal))
        assert rank_tolerance(np.diag(diagonal)) == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize("clamped", [False, True])
def test_a_change_is_applied_up_to_where_it_would_gain_energy(clamped: bool) -> None:
    """v⁺ = v + α L⁻ᵀΔu, momentum α LΔu; also where some coordinates do not move, or none does."""
    rng, cut = np.random.default_rng(1), 0
    for trial in range(60):
        d = 4
        mass, lower = masses(rng, d)
        if trial % 2:  # a body without coupling between its coordinates
            mass, lower = np.diag(np.diag(mass)), np.diag(np.sqrt(np.diag(mass)))
        work: Any = block(make_impact_work(6, 1))
        v, change = rng.normal(size=d), rng.normal(size=d) * (rng.random(d) < 0.6)
        work.change[:d] = change
        v_plus, momentum = np.full(d, np.nan), np.full(d, np.nan)
        alpha = apply_change(mass, lower, v, clamped, work, v_plus, momentum)
        step = np.linalg.solve(lower.T, change)
        slope, square = v @ mass @ step, step @ mass @ step
        passive = 1.0 if square == 0.0 else max(0.0, min(1.0, -2.0 * slope / square))
        expected = passive if clamped else 1.0
        cut += expected < 1.0
        assert alpha == pytest.approx(expected, abs=1e-12)
        assert v_plus == pytest.approx(v + expected * step, abs=1e-12)
        assert momentum == pytest.approx(expected * lower @ change, abs=1e-12)
        assert work.change[:d] == pytest.approx(expected * change, abs=1e-12)
    assert (cut > 20) == clamped


@pytest.mark.parametrize("budget", [1, 2, 9])
@pytest.mark.parametrize("restitution", [-1.0, 0.0, 0.7])
def test_an_impact_takes_the_rows_that_close_fastest_and_reverses_those_speeds(restitution: float, budget: int) -> None:
    """Orthogonal rows: each of the `budget` fastest closing ones gets −e times its speed, the others keep theirs."""
    rng = np.random.default_rng(2)
    work: Any = block(make_impact_work(7, 4))
    mass, lower = masses(rng, 5)
    rows = (lower @ np.linalg.qr(rng.normal(size=(5, 3)))[0]).T * [[1.0], [20.0], [0.3]]
    v = rng.normal(size=5)
    work.columns[:5, :3] = rows.T
    v_plus, momentum = np.empty(5), np.empty(5)
    rank, clamp = factored_impact(mass, lower, v, restitution, 3, 1e-10, budget, True, work, v_plus, momentum)
    used = min(budget, 3)
    speeds = rows @ v
    fastest = np.argsort(-np.abs(speeds) / np.linalg.norm(np.linalg.solve(lower, rows.T), axis=0))[:used]
    expected = speeds.copy()
    expected[fastest] *= -restitution
    assert rank == used
    assert clamp == pytest.approx(1.0 if restitution > -1.0 else clamp)
    assert rows @ v_plus == pytest.approx(expected, abs=1e-11)
    assert mass @ (v_plus - v) == pytest.approx(momentum, abs=1e-11)


def test_the_share_for_the_device_is_the_largest_within_every_limit() -> None:
    """|share · p_i / Δt| <= limit in floating point too, one common factor, 1 where all are within."""
    rng, cut = np.random.default_rng(3), 0
    for _ in range(200):
        impulse, limit = rng.normal(size=4), rng.exponential(2.0, 7)
        limit[rng.integers(0, 7)] = np.inf
        dofs, dt = rng.permutation(7)[:4], float(rng.uniform(0.1, 2.0))
        share = largest_share(impulse, dofs, 3, dt, limit)
        forces = np.abs(impulse[:3]) / dt
        assert share == pytest.approx(min(1.0, float((limit[dofs[:3]] / forces).min())), rel=1e-14)
        assert np.all(share * np.abs(impulse[:3]) / dt <= limit[dofs[:3]])
        cut += share < 1.0
    assert 50 < cut < 200
    exact = np.array([2.0, 1.0]), np.array([0, 1]), 2, 0.5, np.array([4.0, 2.0])
    assert largest_share(*exact) == 1.0  # at the limits themselves


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


def impulses_of(rows: np.ndarray, basis: np.ndarray, change: np.ndarray) -> np.ndarray:
    """p of least norm with Aᵀ p = Δu; `rows` is A, one contact per row."""
    count, rank = len(rows), len(basis)
    length = np.linalg.norm(rows, axis=1)
    units = np.ascontiguousarray((rows / np.where(length > 0.0, length, 1.0)[:, None]).T)
    impulses, tall = np.full(count, np.nan), np.full((rank, count), np.nan)
    minimum_norm_impulses(
        units, length, count, basis, rank, change, impulses, tall, np.full((rank, rank), np.nan), np.full(rank, np.nan)
    )
    return impulses


@pytest.mark.parametrize("repeated", [0, 1, 3])
@pytest.mark.parametrize("rank", [1, 2, 4])
def test_they_are_the_least_squares_solution_of_least_norm(rank: int, repeated: int) -> None:
    rng = np.random.default_rng(10 * rank + repeated)
    rows = rng.normal(size=(rank, 5)) * 10.0 ** rng.uniform(-2, 2, (rank, 1))
    rows = np.vstack([rows, rng.normal(size=(repeated, rank)) @ rows])
    basis = np.linalg.qr(rows.T)[0].T[:rank].copy()
    change = basis.T @ rng.normal(size=rank)
    expected = np.linalg.lstsq(rows.T, change, rcond=None)[0]
    assert impulses_of(rows, basis, change) == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("order", [[0, 1, 2], [1, 0, 2], [2, 1, 0]])
def test_a_direction_that_no_row_reaches_gets_none_and_spoils_no_other(order: list[int]) -> None:
    rows = np.array([[2.0, 0.0, 0.0], [0.0, 0.5, 0.0]])
    assert impulses_of(rows, np.eye(3)[order], np.array([1.0, 3.0, 0.0])) == pytest.approx([0.5, 6.0], abs=0.0)


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

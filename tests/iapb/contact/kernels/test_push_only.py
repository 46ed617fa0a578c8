"""Impulses that push only: the optimality conditions themselves, and every subset of contacts as a judge."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import nnls

from iapb.compiled import block
from iapb.contact.kernels.impact import make_impact_work
from iapb.contact.kernels.unilateral import make_push_work, poisson_impact, poisson_impulses, push_only


def unit_columns_of(seed: int, d: int, c: int) -> np.ndarray:
    """Unit rows as columns, half of them copies or combinations of others."""
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(c, d))
    rows[c // 2 :] = rows[: c - c // 2] * np.where(rng.random(c - c // 2) < 0.5, 1.0, -1.0)[:, None]
    return np.ascontiguousarray((rows / np.linalg.norm(rows, axis=1)[:, None]).T)


@given(seed=st.integers(0, 100_000), d=st.integers(1, 8), c=st.integers(1, 20))
def test_the_optimality_conditions_hold(seed: int, d: int, c: int) -> None:
    """0 ≤ p ⟂ A (b + Aᵀp) ≥ 0, each to rounding."""
    columns = unit_columns_of(seed, d, c)
    b = np.random.default_rng(seed + 1).normal(size=d)
    p, residual = np.zeros(c), np.zeros(d)
    assert push_only(columns, c, b, p, residual, make_push_work(d, c))
    np.testing.assert_allclose(residual, b + columns @ p, atol=1e-12 * (1 + np.abs(p).max()))
    speeds = columns.T @ residual
    size = np.linalg.norm(b)
    assert p.min() >= 0.0
    assert speeds.min() >= -1e-12 * size * max(1, d)
    assert np.abs(p * speeds).max() <= 1e-11 * size * (1.0 + np.abs(p).max())


def least_of_all_subsets(columns: np.ndarray, b: np.ndarray) -> float:
    """½|b + Aᵀp|² at the best p ≥ 0, by trying every set of pushing contacts."""
    c = columns.shape[1]
    best = 0.5 * b @ b
    for size in range(1, c + 1):
        for chosen in combinations(range(c), size):
            p = np.linalg.lstsq(columns[:, chosen], -b)[0]
            if (p >= -1e-12).all():
                best = min(best, 0.5 * np.sum((b + columns[:, chosen] @ p) ** 2))
    return float(best)


@given(seed=st.integers(0, 100_000), d=st.integers(1, 4), c=st.integers(1, 5))
def test_no_set_of_contacts_does_better(seed: int, d: int, c: int) -> None:
    columns = unit_columns_of(seed, d, c)
    b = np.random.default_rng(seed + 1).normal(size=d)
    p, residual = np.zeros(c), np.zeros(d)
    assert push_only(columns, c, b, p, residual, make_push_work(d, c))
    assert 0.5 * residual @ residual <= least_of_all_subsets(columns, b) + 1e-12


def test_opposed_contacts_hold_a_body_still() -> None:
    columns = np.array([[1.0, -1.0], [0.0, 0.0]])
    p, residual = np.zeros(2), np.zeros(2)
    assert push_only(columns, 2, np.array([-2.0, 3.0]), p, residual, make_push_work(2, 2))
    assert np.array_equal(residual, [0.0, 3.0]) and np.array_equal(p, [2.0, 0.0])


def test_the_impulses_grow_with_the_speeds_bit_for_bit() -> None:
    """A power of two changes no rounding: what counts as closing is a share of the speed, not a speed."""
    columns, b = unit_columns_of(3, 5, 8), np.random.default_rng(4).normal(size=5)
    found = []
    for factor in (1.0, 2.0**-80, 2.0**80):
        p, residual = np.zeros(8), np.zeros(5)
        assert push_only(columns, 8, factor * b, p, residual, make_push_work(5, 8))
        found.append(np.concatenate([p, residual]) / factor)
    assert np.any(found[0][:8] > 0.0)
    np.testing.assert_array_equal(found[1:], found[:1] * 2)


def test_many_contacts_that_all_face_the_motion_are_settled() -> None:
    """Forty normals about one direction, struck along it: several rows stop pushing at once, the nearest goes first."""
    d, c = 10, 40
    for seed in (25, 90, 101, 103, 109, 110, 133):
        rng = np.random.default_rng(seed)
        rows = rng.normal(size=(c, d)) + rng.normal(size=d)
        columns = np.ascontiguousarray((rows / np.linalg.norm(rows, axis=1)[:, None]).T)
        b = -0.3 * columns.sum(axis=1) + rng.normal(size=d)
        p, residual = np.zeros(c), np.zeros(d)
        assert push_only(columns, c, b, p, residual, make_push_work(d, c))
        speeds, size = columns.T @ residual, np.linalg.norm(b)
        assert p.min() >= 0.0 and speeds.min() >= -1e-11 * size
        assert np.abs(p * speeds).max() <= 1e-10 * size * (1.0 + p.max())


@given(seed=st.integers(0, 100_000), d=st.integers(1, 6), c=st.integers(1, 8))
def test_poissons_law_is_two_least_squares_without_negative_parts(seed: int, d: int, c: int) -> None:
    """Aᵀp minimizes ½|b + Aᵀp|² over p ≥ 0: Lawson and Hanson's method gives the same Δu, rank by rank."""
    columns, rng = unit_columns_of(seed, d, c), np.random.default_rng(seed + 2)
    u, e = rng.normal(size=d), rng.uniform(0.0, 1.0, c)
    p, change = np.full(c, 9.0), np.zeros(d)
    assert poisson_impulses(columns, c, u, e, p, change, make_push_work(d, c))
    np.testing.assert_allclose(change, columns @ p, rtol=0.0, atol=1e-12 * (1.0 + np.abs(p).sum()))
    assert p.min() >= 0.0 and (columns.T @ (u + change)).min() >= -1e-12 * max(1, d) * np.linalg.norm(u)
    if np.linalg.matrix_rank(columns) == c:  # else compression's impulses are not unique, nor what they return
        compressed = nnls(columns, -u)[0]
        returned = compressed * (1.0 + e)
        expected = returned + nnls(columns, -(u + columns @ returned))[0]
        np.testing.assert_allclose(p, expected, rtol=0.0, atol=1e-9 * (1.0 + expected.sum()))


def test_a_poisson_impact_in_the_units_of_its_rows() -> None:
    """Impulses belong to the rows as given, whose lengths differ; a row of zeros takes none; the mass is any."""
    rng = np.random.default_rng(0)
    for d, c in ((3, 3), (4, 3), (5, 4)):
        root = rng.normal(size=(d, d))
        mass, rows, v, e = root @ root.T + np.eye(d), rng.normal(size=(c, d)), rng.normal(size=d), rng.uniform(size=c)
        rows *= 10.0 ** rng.uniform(-3.0, 3.0, (c, 1))
        rows[c - 1] = 0.0
        work: Any = block(make_impact_work(d, c))
        work.columns[:] = rows.T
        impulses, v_plus, momentum = np.full(c, 9.0), np.empty(d), np.empty(d)
        pushing, clamp = poisson_impact(mass, np.linalg.cholesky(mass), v, e, c, True, work, make_push_work(d, c),
                                        impulses, v_plus, momentum)
        whitened = np.linalg.solve(np.linalg.cholesky(mass), rows[:-1].T)
        u = np.linalg.cholesky(mass).T @ v
        first = nnls(whitened, -u)[0] * (1.0 + e[:-1])
        expected = first + nnls(whitened, -(u + whitened @ first))[0]
        np.testing.assert_allclose(impulses[:-1], expected, rtol=1e-9, atol=1e-12 * expected.max())
        assert impulses[-1] == 0.0 and pushing == np.count_nonzero(expected > 1e-12 * expected.max())
        assert clamp == 1.0
        np.testing.assert_allclose(momentum, rows.T @ impulses, atol=1e-12 * np.abs(momentum).max())
        np.testing.assert_allclose(v_plus, v + np.linalg.solve(mass, momentum), atol=1e-12 * (1 + np.abs(v).max()))

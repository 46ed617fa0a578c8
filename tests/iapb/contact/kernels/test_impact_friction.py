"""Pieces of the friction in an impact, each against its definition in numpy; limits that settle obey Coulomb's law."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb import resolve_frictional_impact, resolve_impact
from iapb.compiled import block
from iapb.contact.kernels.impact import make_impact_work
from iapb.contact.kernels.impact_friction import (
    combine,
    friction_sweeps,
    make_friction_work,
    passive_share,
    share_within_cone,
    split_tangents,
    tangent_inertia,
)

TANGENTS = pytest.mark.parametrize("size", [1, 2])


def problem(rng: np.random.Generator, size: int, count: int = 3, d: int = 7) -> tuple[np.ndarray, ...]:
    """Rows B (count·size, d) of unlike lengths, slips, and the largest eigenvalue of each B_i B_iᵀ."""
    rows = rng.normal(size=(count * size, d)) * 10.0 ** rng.uniform(-0.5, 0.5, (count * size, 1))
    blocks = rows.reshape(count, size, d)
    return rows, rng.normal(size=count * size), np.array([np.linalg.eigvalsh(b @ b.T)[-1] for b in blocks])


@TANGENTS
def test_swept_to_the_end_each_contact_sticks_within_its_disc_or_slides_against_its_limit(size: int) -> None:
    """w = slip + B Bᵀp: w_i = 0 where |p_i| < r_i, else |p_i| = r_i and p_i against w_i."""
    rng, seen = np.random.default_rng(size), set()
    for _ in range(20):
        rows, slip, inertia = problem(rng, size)
        radius, p = rng.exponential(0.3, 3) * (rng.random(3) < 0.8), np.zeros(3 * size)
        moved, velocity = np.zeros(7), np.zeros(size)
        left = friction_sweeps(rows, slip, radius, inertia, p, moved, velocity, 3000, 1e-13)
        assert left <= 1e-13
        assert moved == pytest.approx(rows.T @ p, abs=1e-9)
        for i in range(3):
            own, w = p[i * size : (i + 1) * size], (slip + rows @ (rows.T @ p))[i * size : (i + 1) * size]
            length = float(np.linalg.norm(own))
            assert length <= radius[i] * (1.0 + 1e-12)
            if length < radius[i] * (1.0 - 1e-9):
                assert w == pytest.approx(np.zeros(size), abs=1e-9)
                seen.add("sticks")
            elif radius[i] > 0.0:
                assert own * np.linalg.norm(w) == pytest.approx(-w * radius[i], abs=1e-8)
                seen.add("slides")
    assert seen == {"sticks", "slides"}


@TANGENTS
def test_one_sweep_is_each_contact_in_turn(size: int) -> None:
    """Stopped if its limit allows that (by the inverse of B_i B_iᵀ), else one projected step of length 1/ρ."""
    rng = np.random.default_rng(10 + size)
    for _ in range(30):
        rows, slip, inertia = problem(rng, size)
        radius, p = rng.exponential(0.5, 3), rng.normal(size=3 * size) * 0.1
        expected, fastest = p.copy(), 0.0
        for i in range(3):
            of = slice(i * size, (i + 1) * size)
            w = slip[of] + rows[of] @ (rows.T @ expected)
            stopped = expected[of] - np.linalg.solve(rows[of] @ rows[of].T, w)
            new, made = stopped, float(np.linalg.norm(w))
            if size == 1 or np.linalg.norm(stopped) > radius[i]:
                new = expected[of] - w / inertia[i]
                new *= min(1.0, radius[i] / np.linalg.norm(new))
                made = float(np.abs(inertia[i] * (new - expected[of])).max())
            expected[of], fastest = new, max(fastest, made)
        given = p.copy()
        told = friction_sweeps(rows, slip, radius, inertia, given, np.zeros(7), np.zeros(size), 1, 0.0)
        assert given == pytest.approx(expected, abs=1e-10)
        assert told == pytest.approx(fastest, abs=1e-10)
        friction_sweeps(rows, slip, radius, inertia, p, np.zeros(7), np.zeros(size), 5, fastest * (1.0 + 1e-9))
        assert np.array_equal(p, given)  # still enough after the first: no second sweep


def test_a_contact_that_friction_cannot_move_is_left_alone() -> None:
    p = np.array([0.3, 0.2])
    told = friction_sweeps(np.zeros((2, 4)), np.ones(2), np.ones(2), np.zeros(2), p, np.zeros(4), np.zeros(1), 4, 0.0)
    assert told == 0.0 and p.tolist() == [0.3, 0.2]


def test_two_tangents_along_one_line_are_moved_by_projected_steps() -> None:
    """B_i B_iᵀ singular: no impulse stops every slip; what it can stop, it stops."""
    row = np.array([1.0, 2.0, -1.0])
    rows, slip, p = np.array([row, 2.0 * row]), np.array([0.5, 1.0]), np.zeros(2)
    friction_sweeps(rows, slip, np.array([10.0]), np.array([5.0 * row @ row]), p, np.zeros(3), np.zeros(2), 50, 0.0)
    assert slip + rows @ (rows.T @ p) == pytest.approx([0.0, 0.0], abs=1e-12)


@TANGENTS
@pytest.mark.parametrize("factor", [2.0**-40, 2.0**40])
def test_the_unit_of_mass_changes_no_bit_of_a_sweep(size: int, factor: float) -> None:
    """Rows B and velocities grow by a, impulses fall by a: sticking, sliding and what is singular stay as they are."""
    rng = np.random.default_rng(12)
    for _ in range(10):
        rows, slip, inertia = problem(rng, size)
        radius, p = rng.exponential(0.5, 3), rng.normal(size=3 * size) * 0.1
        other = p / factor
        friction_sweeps(rows, slip, radius, inertia, p, np.zeros(7), np.zeros(size), 3, 0.0)
        friction_sweeps(factor * rows, factor * slip, radius / factor, factor**2 * inertia, other, np.zeros(7),
                        np.zeros(size), 3, 0.0)
        assert np.array_equal(p / factor, other)


@TANGENTS
def test_inertia_is_the_largest_eigenvalue_of_its_rows(size: int) -> None:
    rng = np.random.default_rng(3)
    rows, _, inertia = problem(rng, size, count=8)
    found = [tangent_inertia(rows, i * size, size) for i in range(8)]
    assert found == pytest.approx(inertia, rel=1e-12)
    out = np.full(7, np.nan)
    combine(rows, weight := rng.normal(size=8 * size), out)
    assert out == pytest.approx(rows.T @ weight, abs=1e-12)


def test_the_passive_share_is_the_largest_that_gains_nothing() -> None:
    """½|Δ_t|² α² + (u·Δ_t) α against what the normal part lost; slow and fast, along the motion and against it."""
    rng, cut = np.random.default_rng(4), 0
    for _ in range(300):
        u, moved = rng.normal(size=(2, 5)) * 10.0 ** rng.uniform(-1, 1, (2, 1))
        change = -rng.uniform(-0.2, 2.2) * u + 0.1 * rng.normal(size=5)
        lost = max(0.0, -(u @ change) - 0.5 * change @ change)
        alpha = passive_share(u, change, moved)
        gain = 0.5 * moved @ moved * alpha**2 + u @ moved * alpha
        assert 0.0 <= alpha <= 1.0
        assert gain <= lost + 1e-12 * (moved @ moved + abs(u @ moved))
        if alpha < 1.0:
            cut += 1
            assert gain == pytest.approx(lost, abs=1e-11 * (moved @ moved + abs(u @ moved)))
            assert alpha > 0.0 or lost == 0.0
            assert 0.5 * moved @ moved + u @ moved > lost  # the whole would gain
            if lost == 0.0 and u @ moved < 0.0:
                assert alpha == pytest.approx(-2.0 * (u @ moved) / (moved @ moved))
    assert 50 < cut < 250
    assert passive_share(np.ones(3), np.zeros(3), np.zeros(3)) == 1.0


@TANGENTS
def test_the_share_within_the_cones_is_the_largest_common_one(size: int) -> None:
    """β|p_t| ≤ μ p(β) with p(β) on the way from the impulses without friction to those with it."""
    rng, cut = np.random.default_rng(5), 0
    for _ in range(60):
        f: Any = block(make_friction_work(4, 3, size))
        f.p[:], f.coefficient[:] = rng.normal(size=3 * size) * 0.3, rng.uniform(0.1, 1.0, 3)
        f.without[:], f.wanted[:] = rng.exponential(1.0, 3), rng.normal(0.8, 0.5, 3)
        share = share_within_cone(3, f)

        def outside(beta: float, f: Any = f) -> float:
            normal = f.without + beta * (f.wanted - f.without)
            length = np.linalg.norm(f.p.reshape(3, size), axis=1)
            return float(np.max(beta * length - f.coefficient * normal))

        assert 0.0 < share <= 1.0
        assert outside(share) <= 1e-12
        if share < 1.0:
            cut += 1
            assert outside(share * (1.0 + 1e-6)) > 0.0
    assert 10 < cut < 60


@TANGENTS
def test_tangents_are_whitened_and_freed_of_the_normal_rows(size: int) -> None:
    """B = A_t (I − QᵀQ) and A_t Qᵀ, slip A_t (u + Δ_n), and the speed that a slip is summed from."""
    rng, d, count, rank = np.random.default_rng(6), 6, 3, 2
    root = rng.normal(size=(d, d))
    lower = np.linalg.cholesky(root @ root.T + np.eye(d))
    work, f = block(make_impact_work(d, count)), block(make_friction_work(d, count, size))
    basis = np.linalg.qr(rng.normal(size=(d, rank)))[0].T
    work.basis[:rank], work.u[:], work.change[:] = basis, rng.normal(size=d), rng.normal(size=d)
    rows = rng.normal(size=(count * size, d))
    rows[0] = (lower @ basis.T) @ [0.3, -0.7]  # a tangent that the normal rows hold already
    f.free[:] = rows
    speed = split_tangents(lower, count, rank, work, f, d)
    whitened = np.linalg.solve(lower, rows.T).T
    free = whitened - whitened @ basis.T @ basis
    free[0] = 0.0
    assert f.free == pytest.approx(free, abs=1e-13)
    assert np.array_equal(f.free[0], np.zeros(d))
    assert f.normal_part[:, :rank] == pytest.approx(whitened @ basis.T, abs=1e-13)
    assert f.slip == pytest.approx(whitened @ (work.u + work.change), abs=1e-13)
    assert speed == pytest.approx(np.linalg.norm(whitened, axis=1).max() * np.linalg.norm(work.u), rel=1e-13)


def drawn(seed: int) -> tuple[Any, ...]:
    """M, J, T, v, e, μ up to 1: large enough for limits that swing."""
    rng = np.random.default_rng(seed)
    d, c, m = int(rng.integers(2, 8)), int(rng.integers(1, 5)), int(rng.integers(1, 3))
    root = rng.normal(size=(d, d))
    rows, tangents, v = rng.normal(size=(c, d)), rng.normal(size=(c, m, d)), rng.normal(size=d)
    e, mu = float(rng.choice([0.0, 0.4, 1.0])), rng.uniform(0.0, 1.0, c)
    return root @ root.T + 0.1 * np.eye(d), rows, tangents, v, e, mu


def breach_of_coulomb(T: Any, mu: Any, found: Any) -> float:
    """Largest speed by which w_i = T_i v⁺ is not what friction leaves: 0 within the cone, against p_t on it [m/s]."""
    breach = 0.0
    for i, own in enumerate(found.tangential_impulses):
        w, limit, length = T[i] @ found.velocity, mu[i] * max(found.impulses[i], 0.0), float(np.linalg.norm(own))
        if length < limit * (1.0 - 1e-7):
            breach = max(breach, float(np.linalg.norm(w)))
        elif length > 0.0:
            breach = max(breach, float(np.linalg.norm(w + own / length * np.linalg.norm(w))))
    return breach


def test_where_it_is_complete_every_contact_sticks_or_slides_against_its_friction() -> None:
    complete = 0
    for seed in range(400):
        M, J, T, v, e, mu = drawn(seed)
        if len(J) * (1 + T.shape[1]) > len(v):
            continue  # normals that hold every motion leave friction nothing to stop
        found = resolve_frictional_impact(M, J, T, v, e, mu)
        pushing = resolve_impact(M, J, v, e).impulses.min() > 0.0  # what pulls carries no friction, by definition
        if pushing and found.status == "complete" and found.friction_share == 1.0:
            complete += 1
            # MET is 1e-10 of the speed that a slip is summed from; sliding directions lose digits with the slip.
            assert breach_of_coulomb(T, mu, found) <= 1e-7 * np.abs(T).max() * np.linalg.norm(v) * len(v)
    assert complete > 10


@pytest.mark.parametrize("seed", [12, 41, 45, 104, 133, 172, 233, 354, 369])
def test_limits_that_swing_at_first_settle(seed: int) -> None:
    """Without damping, or with another one than half and a fifth, these do not within the rounds."""
    M, J, T, v, e, mu = drawn(seed)
    found = resolve_frictional_impact(M, J, T, v, e, mu)
    assert found.status == "complete"

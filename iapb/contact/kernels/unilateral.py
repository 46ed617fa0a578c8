"""Impulses that only push: min ½|b + Aᵀp|² over p ≥ 0, and Poisson's law for unequal restitution based on it.

The minimizer is the solution of the LCP `0 ≤ p ⟂ A(b + Aᵀp) ≥ 0`. The solver is the active-set method of Lawson and
Hanson (Solving Least Squares Problems, 1974, chapter 23) on Gram-Schmidt factors.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from iapb.compiled import kernel
from iapb.contact.kernels.impact import apply_change, whiten_impact
from iapb.linalg import orthogonalize

# A row counts as closing if its speed exceeds this share of |b|, the rounding of a d-term sum of unit rows.
_CLOSING = 1e-13


class PushWork(NamedTuple):
    """Scratch of impulses that only push: d coordinates, up to c contacts."""

    q: np.ndarray  # (d + 1, d) orthonormal directions of the passive rows
    triangle: np.ndarray  # (d + 1, d + 1)
    solution: np.ndarray  # (d + 1,)
    passive: np.ndarray  # (d + 1,) int64: rows that push
    held: np.ndarray  # (c,) bool: the row is passive
    banned: np.ndarray  # (c,) bool: the row depends on the passive rows to rounding
    compressed: np.ndarray  # (d,) whitened velocity after compression
    final: np.ndarray  # (d,) after restitution
    more: np.ndarray  # (c,) impulses of the restitution phase beyond E p_c


def make_push_work(coordinates: int, contacts: int) -> PushWork:
    """Allocate the scratch for up to `contacts` rows on `coordinates` generalized velocities."""
    d, c = coordinates, contacts
    return PushWork(np.zeros((d + 1, d)), np.zeros((d + 1, d + 1)), np.zeros(d + 1), np.zeros(d + 1, np.int64),
                    np.zeros(c, np.bool_), np.zeros(c, np.bool_), np.zeros(d), np.zeros(d), np.zeros(c))


@kernel
def _solve_passive(rows, b, passive, known, size, q, triangle, solution):
    """Solve least squares on the passive rows: solution[j] for passive[j]; return how many rows are independent.

    The first `known` directions are reused from the call before, which had the same rows.
    """
    d = b.shape[0]
    for j in range(known, size):
        for k in range(d):
            q[j, k] = rows[k, passive[j]]
        square = orthogonalize(q, j, d, triangle)
        if square <= _CLOSING * _CLOSING:
            return j
        triangle[j, j] = math.sqrt(square)
        for k in range(d):
            q[j, k] /= triangle[j, j]
    for j in range(size - 1, -1, -1):
        total = 0.0
        for k in range(d):
            total -= q[j, k] * b[k]
        for m in range(j + 1, size):
            total -= triangle[j, m] * solution[m]
        solution[j] = total / triangle[j, j]
    return size


@kernel
def _most_closing(rows, count, residual, work):
    """Return the free row with the most negative rᵢ·residual, and this value."""
    best, speed = -1, 0.0
    for i in range(count):
        if not (work.held[i] or work.banned[i]):
            closing = 0.0
            for k in range(residual.shape[0]):
                closing += rows[k, i] * residual[k]
            if closing < speed:
                best, speed = i, closing
    return best, speed


@kernel
def push_only(rows, count, b, p, residual, work):
    """Solve `0 ≤ p ⟂ A(b + Aᵀp) ≥ 0`; write p and residual = b + Aᵀp. Return False if it did not converge.

    rows : (d, ≥count) unit rows of A as columns; p : (≥count,); residual : (d,); work : a `PushWork`.
    """
    d = b.shape[0]
    norm, size, known = 0.0, 0, 0
    for k in range(d):
        residual[k] = b[k]
        norm += b[k] * b[k]
    for i in range(count):
        p[i] = 0.0
        work.held[i] = work.banned[i] = False
    threshold = _CLOSING * math.sqrt(norm) * max(1, d)
    for _ in range(10 * (count + d) + 10):
        entering, speed = _most_closing(rows, count, residual, work)
        if entering < 0 or speed >= -threshold:
            return True
        work.passive[size] = entering
        size += 1
        if size <= d:
            known = _solve_passive(rows, b, work.passive, known, size, work.q, work.triangle, work.solution)
        if known < size:
            work.banned[entering] = True  # dependent on the passive rows: it cannot close alone
            size -= 1
            continue
        work.held[entering] = True
        size, known = _retreat(rows, b, size, p, work)
        _set_residual(rows, b, work.passive, size, p, residual)
        for i in range(count):
            work.banned[i] = False
    return False


@kernel
def _retreat(rows, b, size, p, work):
    """Move p towards the passive solution and release rows that would pull; return the number of passive rows, and
    how many of their directions are known."""
    passive, solution = work.passive, work.solution
    while True:
        step, blocking = 1.0, -1
        for j in range(size):
            if solution[j] <= 0.0:
                ratio = p[passive[j]] / (p[passive[j]] - solution[j]) if p[passive[j]] > 0.0 else 0.0
                if ratio < step or blocking < 0:
                    step, blocking = ratio, j
        for j in range(size):
            p[passive[j]] += step * (solution[j] - p[passive[j]])
        if blocking < 0:
            return size, size
        p[passive[blocking]] = 0.0
        work.held[passive[blocking]] = False
        for j in range(blocking, size - 1):
            passive[j] = passive[j + 1]
        size -= 1
        known = _solve_passive(rows, b, passive, blocking, size, work.q, work.triangle, solution)
        if known < size:
            return size, known


@kernel
def _set_residual(rows, b, passive, size, p, residual):
    """Write residual = b + Aᵀp."""
    for k in range(b.shape[0]):
        total = b[k]
        for j in range(size):
            total += rows[k, passive[j]] * p[passive[j]]
        residual[k] = total


@kernel
def poisson_impulses(rows, count, u, restitution, p, change, work):
    """Apply Poisson's law, eᵢ in [0, 1], by two LCPs; write p (unit rows) and Δu = Aᵀp. Return False if not converged.

    Compression `0 ≤ p_c ⟂ A(u + Aᵀp_c) ≥ 0`, then restitution `0 ≤ p_e − E p_c ⟂ A u⁺ ≥ 0`,
    p = p_c + p_e (docs/theory.md; Glocker and Pfeiffer 1995). Passive for every E in [0, 1] and any u.
    """
    d = u.shape[0]
    compressed, final, more = work.compressed[:d], work.final[:d], work.more
    if not push_only(rows, count, u, p, compressed, work):
        return False
    for i in range(count):
        returned = restitution[i] * p[i]
        for k in range(d):
            compressed[k] += rows[k, i] * returned
        p[i] += returned
    if not push_only(rows, count, compressed, more, final, work):
        return False
    for i in range(count):
        p[i] += more[i]
    for k in range(d):
        change[k] = final[k] - u[k]
    return True


# An impact with unequal restitution: Poisson's law by two LCPs, then the energy clamp.


@kernel
def poisson_impact(mass_matrix, lower, v, restitution, count, clamped, work, push, impulses, v_plus, momentum):
    """Resolve `count` rows, given as columns of `work.columns`, each with its own e in [0, 1].

    Writes v⁺, the generalized impulse M(v⁺ − v⁻) and the impulses along the rows; returns (number of rows that
    push, clamp). If the active-set method does not converge, it returns (−1, 1) and v⁺ is not written.
    """
    d = v.shape[0]
    whiten_impact(lower, v, count, work)
    if not poisson_impulses(work.rows, count, work.u[:d], restitution, impulses, work.change[:d], push):
        return -1, 1.0
    clamp = apply_change(mass_matrix, lower, v, clamped, work, v_plus, momentum)
    pushing = 0
    for i in range(count):
        pushing += impulses[i] > 0.0
        impulses[i] = clamp * impulses[i] / work.length[i] if work.length[i] > 0.0 else 0.0
    return pushing, clamp

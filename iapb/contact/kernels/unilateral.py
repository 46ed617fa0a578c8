"""Impulses that only push: min ½|b + Aᵀp|² over p ≥ 0, and Poisson's law for unequal restitution
based on it.

The minimizer is the solution of the LCP `0 ≤ p ⟂ A(b + Aᵀp) ≥ 0`. The solver is the active-set
method of Lawson and Hanson (Solving Least Squares Problems, 1974, chapter 23) on Gram-Schmidt
factors.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from iapb.compiled import copy_into, kernel
from iapb.contact.kernels.impact import apply_change
from iapb.linalg import dot_of, from_whitened, orthogonalize
from iapb.schema import Booleans, Floats, Integers

# A row counts as closing if its speed exceeds this share of |b|, the rounding of a d-term sum of
# unit rows.
_CLOSING = 1e-13


class PushWork(NamedTuple):
    """Scratch of impulses that only push."""

    q: Annotated[Floats, "velocity velocity"]  # orthonormal directions of the passive rows
    triangle: Annotated[Floats, "velocity velocity"]
    solution: Annotated[Floats, "velocity"]
    passive: Annotated[Integers, "velocity"]  # rows that push
    held: Annotated[Booleans, "row"]  # the row is passive
    banned: Annotated[Booleans, "row"]  # the row depends on the passive rows to rounding
    more: Annotated[Floats, "row"]  # impulses of the restitution phase beyond E p_c


@kernel
def push_only(rows, count, b, p, residual, work):
    """Solve `0 ≤ p ⟂ A(b + Aᵀp) ≥ 0`; write p and residual = b + Aᵀp. Return False if it did not
    converge.

    rows : (d, ≥count) unit rows of A as columns; p : (≥count,); residual : (d,); work : a
        `PushWork`.
    """
    d, size, known = b.shape[0], 0, 0
    copy_into(residual, b)
    p[:count] = 0.0
    work.held[:count] = False
    work.banned[:count] = False
    threshold = _CLOSING * math.sqrt(dot_of(b, b)) * max(1, d)
    for _ in range(10 * (count + d) + 10):
        entering, speed = -1, 0.0
        for i in range(count):
            if not (work.held[i] or work.banned[i]):
                closing = dot_of(rows[:, i], residual)
                if closing < speed:
                    entering, speed = i, closing
        if entering < 0 or speed >= -threshold:
            return True
        if size < d:
            work.passive[size] = entering
            known = _solve_passive(rows, b, known, size + 1, work)
        if known <= size:
            work.banned[entering] = True  # dependent on the passive rows: it cannot close alone
            continue
        work.held[entering] = True
        size, known = _retreat(rows, b, size + 1, p, work)
        for k in range(d):
            residual[k] = b[k]
            for j in range(size):
                residual[k] += rows[k, work.passive[j]] * p[work.passive[j]]
        work.banned[:count] = False
    return False


@kernel
def _solve_passive(rows, b, known, size, work):
    """Solve least squares on the passive rows, with `known` directions given; return how many are
    independent."""
    q, triangle, solution = work.q, work.triangle, work.solution
    for j in range(known, size):
        copy_into(q[j, : b.shape[0]], rows[:, work.passive[j]])
        square = orthogonalize(q[j, : b.shape[0]], q, j, triangle[:, j])
        if square <= _CLOSING * _CLOSING:
            return j
        triangle[j, j] = math.sqrt(square)
        for k in range(b.shape[0]):
            q[j, k] /= triangle[j, j]
    for j in range(size - 1, -1, -1):
        total = -dot_of(q[j], b)
        for m in range(j + 1, size):
            total -= triangle[j, m] * solution[m]
        solution[j] = total / triangle[j, j]
    return size


@kernel
def _retreat(rows, b, size, p, work):
    """Move p towards the passive solution and release rows that would pull; return the number of
    passive rows, and how many of their directions are known."""
    passive, solution = work.passive, work.solution
    while True:
        step, blocking = 1.0, -1
        for j in range(size):
            if solution[j] <= 0.0:
                ratio = (
                    p[passive[j]] / (p[passive[j]] - solution[j]) if p[passive[j]] > 0.0 else 0.0
                )
                if ratio < step or blocking < 0:
                    step, blocking = ratio, j
        for j in range(size):
            p[passive[j]] += step * (solution[j] - p[passive[j]])
        if blocking < 0:
            return size, size
        p[passive[blocking]] = 0.0
        work.held[passive[blocking]] = False
        size -= 1
        for j in range(blocking, size):
            passive[j] = passive[j + 1]
        known = _solve_passive(rows, b, blocking, size, work)
        if known < size:
            return size, known


@kernel
def poisson_impact(d, count, restitution, clamped, work, push, impulses):
    """Resolve `count` rows, after `whiten_impact`, by Poisson's law with e in [0, 1] for each, by
    two LCPs.

    Compression `0 ≤ p_c ⟂ A(u + Aᵀp_c) ≥ 0`, then restitution `0 ≤ p_e − E p_c ⟂ A u⁺ ≥ 0`,
    p = p_c + p_e (docs/theory.md; Glocker and Pfeiffer 1995). Passive for every E in [0, 1] and any
    u. Writes v⁺, the generalized impulse M(v⁺ − v⁻) and the impulses along the rows; returns
    (number of rows that push, clamp). If the active-set method does not converge, it returns (−1,
    1) and v⁺ is not written.
    """
    rows, u = work.rows, work.u[:d]
    compressed, final = (
        work.target[:d],
        work.along[:d],
    )  # whitened velocities after compression and after restitution
    if not push_only(rows, count, u, impulses, compressed, push):
        return -1, 1.0
    for i in range(count):
        returned = restitution[i] * impulses[i]
        for k in range(d):
            compressed[k] += rows[k, i] * returned
        impulses[i] += returned
    if not push_only(rows, count, compressed, push.more, final, push):
        return -1, 1.0
    for k in range(d):
        work.change[k] = final[k] - u[k]
    from_whitened(work.lower, work.change[:d], work.v_change)
    clamp, pushing = apply_change(d, clamped, work), 0
    for i in range(count):
        impulses[i] += push.more[i]
        pushing += impulses[i] > 0.0
        impulses[i] = clamp * impulses[i] / work.length[i] if work.length[i] > 0.0 else 0.0
    return pushing, clamp

"""Impulses that only push: min ½|b + Aᵀp|² over p ≥ 0, and Poisson's law for unequal restitution
based on it.

The minimizer is the solution of the LCP `0 ≤ p ⟂ A(b + Aᵀp) ≥ 0`. The solver is the active-set
method of Lawson and Hanson (Solving Least Squares Problems, 1974, chapter 23) on Gram-Schmidt
factors.
"""

from __future__ import annotations

from math import sqrt
from typing import Annotated, NamedTuple

from iapb.contact.kernels.impact import apply_change, write_change
from iapb.contact.kernels.row_basis import along_given_row, minimum_norm_factors, orthonormal_basis
from iapb.numerics.compiled import copy_into, kernel
from iapb.numerics.linalg import add_multiple, dot_of, norm_of, orthogonalize, write_difference
from iapb.numerics.schema import (
    Booleans,
    FloatPerRow,
    FloatPerVelocity,
    NumberPerVelocity,
    VelocityMatrix,
    VelocityRows,
)

# A row counts as closing if its speed exceeds this share, times d, of the terms that it is summed
# from: some times their rounding.
_CLOSING = 2e-15
# A row closes no more at this share of its terms. Rows that are dependent up to a noise of 1e-13
# count; a contact that separates does not, where it would share the impulse of others.
_TOUCHING = 1e-12
# A unit row that others determine up to this share is dependent on them.
_DEPENDENT = 1e-13
# An entry of the least impulses below this share of their length is rounding.
_NO_IMPULSE = 1e-13


class PushWork(NamedTuple):
    """Scratch of impulses that only push."""

    q: VelocityMatrix  # orthonormal directions of the passive rows
    triangle: VelocityMatrix
    solution: FloatPerVelocity
    passive: NumberPerVelocity  # rows that push
    held: Annotated[Booleans, "row"]  # the row is passive
    banned: Annotated[Booleans, "row"]  # the row depends on the passive rows to rounding
    more: FloatPerRow  # impulses of the restitution phase beyond E p_c
    earlier: FloatPerVelocity  # terms that b was summed from, with their rounding
    terms: FloatPerVelocity  # of the residual: earlier + |b| + p of each row in it


class ShareWork(NamedTuple):
    """Scratch of `share_compression`; `velocity` is the number of rows and one more."""

    tall: VelocityRows
    aim: FloatPerVelocity
    residual: FloatPerVelocity
    weight: FloatPerRow  # 1/√(number of equal rows); 0 where p_c = 0 for certain
    shared: FloatPerRow
    slack: FloatPerRow
    push: PushWork


@kernel
def push_only(rows, count, b, p, residual, work):
    """Solve `0 ≤ p ⟂ A(b + Aᵀp) ≥ 0`; write p and residual = b + Aᵀp. Return False if it did not
    converge.

    rows : (d, ≥count) unit rows of A as columns; p : (≥count,); residual : (d,); work : a
        `PushWork`.
    """
    d = len(b)
    size = known = 0
    terms = work.terms[:d]
    copy_into(residual, b)
    for k in range(d):
        terms[k] = work.earlier[k] + abs(b[k])
    p[:count] = 0.0
    work.held[:count] = work.banned[:count] = False
    for _ in range(10 * (count + d) + 10):
        entering = -1
        speed = 0.0
        for i in range(count):
            if not (work.held[i] or work.banned[i]):
                closing = dot_of(rows[:, i], residual)
                if closing < speed and closing < -_CLOSING * d * _size_of(rows[:, i], terms):
                    entering = i
                    speed = closing
        if entering < 0:
            for j in range(size):  # pushing rows still move by the rounding of their impulses
                moving = dot_of(work.q[j], residual)
                add_multiple(residual, -moving, work.q[j])
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
            terms[k] = work.earlier[k] + abs(b[k])
            for j in range(size):
                entry = rows[k, work.passive[j]]
                residual[k] += entry * p[work.passive[j]]
                terms[k] += p[work.passive[j]] if entry != 0.0 else 0.0
        if p[entering] > 0.0:  # else rounding alone made it enter, and would again
            work.banned[:count] = False
        else:
            work.banned[entering] = True
    return False


@kernel
def _size_of(row, terms):
    """Return the sum of the terms that a unit row meets. Rounding of a row is a share of its length,
    not of its entries."""
    total = 0.0
    for k in range(len(terms)):
        total += terms[k] if row[k] != 0.0 else 0.0
    return total


@kernel
def _solve_passive(rows, b, known, size, work):
    """Solve least squares on the passive rows, with `known` directions given; return how many are
    independent."""
    q = work.q
    triangle = work.triangle
    solution = work.solution
    for j in range(known, size):
        copy_into(q[j, : len(b)], rows[:, work.passive[j]])
        square = orthogonalize(q[j, : len(b)], q, j, triangle[:, j])
        if square <= _DEPENDENT * _DEPENDENT:
            return j
        triangle[j, j] = sqrt(square)
        for k in range(len(b)):
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
    passive = work.passive
    solution = work.solution
    while True:
        step = 1.0
        blocking = -1
        for j in range(size):
            if solution[j] <= 0.0:
                ratio = (
                    p[passive[j]] / (p[passive[j]] - solution[j]) if p[passive[j]] > 0.0 else 0.0
                )
                if ratio < step or blocking < 0:
                    step = ratio
                    blocking = j
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
def share_compression(d, count, restitution, tolerance, compressed, impulses, work, push, share):
    """Replace p_c by the one of least Σ p_c² along unit rows of A, of all p_c ≥ 0 with the same
    Aᵀp_c.

    Without this, v⁺ would depend on the rows that the active set happens to choose. Rows that are
    equal, up to a positive factor, with equal e count as one. So v⁺ does not depend on the order of
    the rows, on their scale, or on copies. Where all e are equal or p_c is unique, it stays.
    With the projector Π on {x : Aᵀx = 0} and p₀ = p_c − Πp_c, the least is p₀ + Πs with 0 ≤ s ⟂
    p₀ + Πs ≥ 0. `push_only` finds 0 ≤ w ⟂ Πw + ρ p₀ ≥ 0, ρ = 1 + p₀·w/|p_c|² ≥ ½, and s = w/ρ.
    """
    rows = work.rows
    tight = push.banned
    kinds = 0.0
    lowest = 1.0
    highest = -1.0
    for i in range(count):  # by complementarity p_c = 0 at every contact that separates
        speed = dot_of(rows[:, i], compressed)
        rounding = _TOUCHING * _size_of(rows[:, i], push.terms[:d])
        tight[i] = work.length[i] > 0.0 and speed <= rounding
        if tight[i]:
            lowest = min(lowest, restitution[i])
            highest = max(highest, restitution[i])
        for k in range(d):
            work.columns[k, i] = rows[k, i] if tight[i] else 0.0
    if lowest >= highest:
        return
    rank = orthonormal_basis(d, count, tolerance, d, work)
    shared = share.shared[:count]
    left = share.slack[:count]
    tall = share.tall
    weight = share.weight
    for i in range(count):
        equal = 0
        for j in range(count):
            apart = 0.0
            for k in range(d):
                apart += (rows[k, i] - rows[k, j]) ** 2
            equal += restitution[i] == restitution[j] and apart <= tolerance * tolerance
        weight[i] = 1.0 / sqrt(equal) if tight[i] else 0.0
        kinds += weight[i] * weight[i]
        shared[i] = left[i] = impulses[i] / weight[i] if tight[i] else 0.0
    norm = norm_of(shared)
    if norm == 0.0 or kinds < rank + 0.5:
        return
    minimum_norm_factors(d, count, rank, weight, work)
    aim = share.aim[: count + 1]
    residual = share.residual[: count + 1]
    orthogonalize(left, work.columns, rank, aim)
    for i in range(count):
        shared[i] -= left[i]
        for k in range(count):
            tall[k, i] = 1.0 if k == i else 0.0
            for j in range(rank):
                tall[k, i] -= work.columns[j, k] * work.columns[j, i]
        tall[count, i] = shared[i] / norm if abs(shared[i]) > _NO_IMPULSE * norm else 0.0
    aim[:count] = 0.0
    aim[count] = 1.0
    found = push_only(tall, count, aim, share.slack, residual, share.push)
    if found and residual[count] > 0.25:
        for i in range(count):
            impulses[i] = weight[i] * max(shared[i] + norm * residual[i] / residual[count], 0.0)
        for k in range(d):
            compressed[k] = work.u[k] + dot_of(rows[k], impulses[:count])


@kernel
def poisson_impact(d, count, restitution, tolerance, clamped, work, push, share, impulses):
    """Resolve `count` rows, after `whiten_impact`, by Poisson's law with e in [0, 1] for each, by
    two LCPs.

    Compression `0 ≤ p_c ⟂ A(u + Aᵀp_c) ≥ 0`, then restitution `0 ≤ p_e − E p_c ⟂ A u⁺ ≥ 0`,
    p = p_c + p_e (docs/theory.md; Glocker and Pfeiffer 1995). Passive for every E in [0, 1] and any
    u. Writes v⁺, the generalized impulse M(v⁺ − v⁻) and the impulses along the rows; returns
    (number of rows that push, clamp). If the active-set method does not converge, it returns (−1,
    1) and v⁺ is not written.
    """
    rows = work.rows
    u = work.u[:d]
    # whitened velocities after compression and after restitution
    compressed = work.deviation[:d]
    final = work.along[:d]
    if not push_only(rows, count, u, impulses, compressed, push):
        return -1, 1.0
    copy_into(push.earlier[:d], push.terms[:d])
    share_compression(d, count, restitution, tolerance, compressed, impulses, work, push, share)
    for k in range(d):  # as before, for what follows
        copy_into(work.columns[k, :count], rows[k])
    lowest = 1.0
    for i in range(count):
        if impulses[i] > 0.0:
            lowest = min(lowest, restitution[i])
    # Aᵀp_c without the rounding of p_c, which is large where rows are nearly opposed
    for k in range(d):
        compressed[k] += lowest * (compressed[k] - u[k])
    for i in range(count):
        returned = (restitution[i] - lowest) * impulses[i]
        for k in range(d if returned > 0.0 else 0):
            compressed[k] += rows[k, i] * returned
        impulses[i] += restitution[i] * impulses[i]
    solved = push_only(rows, count, compressed, push.more, final, push)
    push.earlier[:d] = 0.0
    if not solved:
        return -1, 1.0
    write_difference(work.change[:d], final, u)
    write_change(d, work)
    clamp = apply_change(d, clamped, work)
    pushing = 0
    for i in range(count):
        impulses[i] += push.more[i]
        pushing += impulses[i] > 0.0
        impulses[i] = along_given_row(work, i, clamp * impulses[i])
    return pushing, clamp

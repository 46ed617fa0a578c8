"""One impact on plain arrays: whiten, project, return to v, clamp. Allocation-free given an
`ImpactWork`."""

from __future__ import annotations

from math import sqrt
from typing import Annotated, NamedTuple

from iapb.contact.kernels.passive import UNIT, passive_step, write_step
from iapb.contact.kernels.row_basis import orthonormal_basis
from iapb.numerics.compiled import copy_into, kernel
from iapb.numerics.double_double import add_product, row_times, symmetric_entry
from iapb.numerics.linalg import (
    add_multiple,
    cholesky,
    dot_of,
    from_whitened,
    to_momentum,
    to_whitened,
    whiten_columns,
    write_difference,
)
from iapb.numerics.schema import (
    Booleans,
    FloatPerRow,
    FloatPerVelocity,
    VelocityMatrix,
    VelocityRows,
)

# Two rows that differ by less than this (rows of unit length in the kinetic metric) count as one.
# The error of restitution is then at most (1 + e) · tolerance · |u|. A larger tolerance would
# violate restitution at real contacts (the kit requires 1e-8); a smaller one would treat rounding
# of a Jacobian (1e-16, amplified by √κ(M)) as a contact.
RANK_TOLERANCE = 1e-10
# rounding of a whitened row is below d · ε · κ(L) in all families tried; 8 is its margin
_NOISE_FACTOR = 8.0


class ImpactWork(NamedTuple):
    """One impact, with up to as many rows as there are contacts, or two for each.

    An impact of fewer coordinates than there is room for uses the first d.
    """

    mass: VelocityMatrix  # M, symmetric to rounding
    lower: VelocityMatrix  # the Cholesky factor of its symmetric part
    correction: VelocityMatrix  # C with M = L C Cᵀ Lᵀ, where `corrected`
    corrected: Annotated[Booleans, "1"]
    v: FloatPerVelocity  # v⁻
    v_plus: FloatPerVelocity
    momentum: FloatPerVelocity  # generalized impulse M(v⁺ − v⁻)
    # rows of J as columns, then of A, then their residuals
    columns: VelocityRows
    rows: VelocityRows  # unit rows of A as columns, kept for impulses
    length: FloatPerRow  # lengths of the rows of A
    basis: VelocityMatrix  # rows are the orthonormal basis Q
    triangle: VelocityMatrix  # T of the impulses of least norm
    closing: FloatPerRow
    size: FloatPerRow
    overlap: FloatPerRow
    u: FloatPerVelocity  # whitened velocity
    change: FloatPerVelocity  # Δu; after an impact L⁻¹ of the generalized impulse
    v_change: FloatPerVelocity  # Δv
    target: FloatPerVelocity
    deviation: FloatPerVelocity
    along: FloatPerVelocity
    shifted: FloatPerVelocity


@kernel
def rank_tolerance(lower):
    """Return the rank tolerance for rows whitened by L: RANK_TOLERANCE, or the rounding of the rows
    if it is larger."""
    d = len(lower)
    largest = smallest = lower[0, 0]
    for k in range(1, d):
        largest = max(largest, lower[k, k])
        smallest = min(smallest, lower[k, k])
    return max(RANK_TOLERANCE, _NOISE_FACTOR * d * UNIT * largest / smallest)


@kernel
def whiten_impact(d, count, exact, work):
    """Prepare an impact from v and `count` rows of J in `work.columns`: write u, unit rows of A,
    and their lengths.

    The unit rows go to `work.rows` and, in place of those of J, to `work.columns`.
    exact : whether to whiten by L C (`correct_factor`) where L alone is felt; else `refine_change`
        corrects the result.
    """
    columns = work.columns
    length = work.length
    u = work.u[:d]
    to_whitened(work.lower, work.v[:d], u)
    whiten_columns(work.lower[:d, :d], columns, count)
    work.corrected[0] = exact and correct_factor(d, work)
    if work.corrected[0]:
        to_whitened(work.correction, u, u)
        whiten_columns(work.correction[:d, :d], columns, count)
    length[:count] = 0.0
    for k in range(d):
        for i in range(count):
            length[i] += columns[k, i] * columns[k, i]
    for i in range(count):
        length[i] = sqrt(length[i])
    for k in range(d):
        for i in range(count):
            if length[i] > 0.0:  # rows of zeros stay
                columns[k, i] /= length[i]
            work.rows[k, i] = columns[k, i]


@kernel
def factored_impact(d, count, restitution, tolerance, budget, clamped, work):
    """Resolve `count` rows, after `whiten_impact`, by (21) in factored form; return (rank, clamp).

    Writes v⁺ and the generalized impulse M(v⁺ − v⁻) = −(1 + e) L Q Qᵀ u.
    Every row is an equality J v⁺ = −e J v⁻, whatever the sign of its velocity; the caller chooses
    the rows.
    """
    rank = orthonormal_basis(d, count, tolerance, budget, work)
    u = work.u[:d]
    change = work.change[:d]
    change[:] = 0.0
    for j in range(rank):
        add_multiple(change, -((1.0 + restitution) * dot_of(work.basis[j], u)), work.basis[j])
    write_change(d, work)
    if clamped and not work.corrected[0]:
        refine_change(d, rank, work)
    return rank, apply_change(d, clamped, work)


@kernel
def write_change(d, work):
    """Write Δv = work.v_change of Δu = work.change."""
    step = work.v_change[:d]
    copy_into(step, work.change[:d])
    if work.corrected[0]:
        from_whitened(work.correction, step, step)
    from_whitened(work.lower, step, step)


@kernel
def apply_change(d, clamped, work):
    """Write v⁺ = v + α Δv and the generalized impulse α L Δu of `work`, where M Δv = L Δu (9);
    return α.

    With the clamp, v⁺ has no more kinetic energy than v in real arithmetic; α = 0 if no other α is
    found.
    """
    v = work.v[:d]
    v_change = work.v_change[:d]
    v_plus = work.v_plus[:d]
    alpha = 1.0
    if clamped:
        alpha = passive_step(work.mass, v, v_change, alpha, v_plus)
    else:
        write_step(v, v_change, alpha, v_plus)
    for k in range(d):
        work.change[k] *= alpha
        work.shifted[k] = work.change[k]
    if work.corrected[0]:
        to_momentum(work.correction, work.change[:d], work.shifted)
    to_momentum(work.lower, work.shifted[:d], work.momentum)
    return alpha


@kernel
def factored_impacts(
    masses, columns, velocities, restitution, budget, clamped, times, work, v_plus, clamps
):
    """Resolve n impacts in factored form, in their own units, as a step does, each `times` times.

    masses (n, d, d), columns (n, d, c): rows of J as columns, velocities (n, d), restitution (n,).
    Writes v⁺ (n, d) and the clamps (n,): where M is not positive definite, v⁺ = v and −1.
    """
    n, d, c = columns.shape
    for m in range(n):
        for _ in range(times):
            clamps[m] = -1.0
            for i in range(d):
                copy_into(work.mass[i], masses[m, i])
                copy_into(work.columns[i], columns[m, i])
                work.v[i] = work.v_plus[i] = velocities[m, i]
            if cholesky(work.mass, work.lower) == 0:
                whiten_impact(d, c, False, work)
                least = rank_tolerance(work.lower)
                _, clamps[m] = factored_impact(d, c, restitution[m], least, budget, clamped, work)
        copy_into(v_plus[m], work.v_plus)


# Refinement of an impact for M itself, where Cholesky's backward error L Lᵀ ≠ M affects the result.

# An error |E| of the factor below this share is left to the energy clamp; its effect is as small.
_FELT = 1e-12
# above this share the fixed-point iteration below may not converge; the clamp then ensures
# passivity
_CONTRACTS = 0.1
_PASSES = 3  # each multiplies the remaining error by |E|, about d ε κ(M): 1e-3 at κ(M) = 1e12


@kernel
def correct_factor(d, work):
    """Write C with M = L C Cᵀ Lᵀ to `work.correction`; return whether it is felt: else it is as
    good as I.

    C is the Cholesky factor of I + E, E = L⁻¹ (M − L Lᵀ) L⁻ᵀ with the residual in double-double.
    All that follows then sees M itself: LCPs and friction, whose limits depend on it, too.
    """
    lower = work.lower[:d, :d]
    correction = work.correction[:d, :d]
    felt = 0.0
    for i in range(d):
        for j in range(i + 1):
            high, low = symmetric_entry(work.mass, i, j)
            for k in range(j + 1):
                if lower[i, k] != 0.0:
                    high, low = add_product(high, low, -lower[i, k], 0.0, lower[j, k])
            correction[i, j] = correction[j, i] = high + low
    for _ in range(2):
        whiten_columns(lower, correction, d)
        for i in range(d):
            for j in range(i):
                correction[i, j], correction[j, i] = correction[j, i], correction[i, j]
    for i in range(d):
        for j in range(d):
            felt = max(felt, abs(correction[i, j]))
        correction[i, i] += 1.0
    return felt > _FELT and cholesky(correction, correction) == 0


@kernel
def refine_change(d, rank, work):
    """Correct Δu = work.change of (21), in the span of the basis, and Δv = work.v_change for M
    instead of L Lᵀ.

    In whitened coordinates M is I + E with |E| about d ε κ(M). The corrected Δu has the given part
    in the row space (restitution), and its impulse (I + E) Δu lies in the row space. The iteration
    is Δu ← Δu₀ − (I − Q Qᵀ) E Δu, with E Δu = L⁻¹ M Δv − Δu and M Δv summed in double-double.
    Without it the clamp alone would compensate E, which reduces restitution. On return work.change
    is L⁻¹ of the generalized impulse.
    """
    change = work.change[:d]
    deviation = work.deviation[:d]
    inside = work.along[:d]
    shifted = work.shifted[:d]
    copy_into(shifted, change)
    inside[:] = 0.0
    size = dot_of(change, change)
    lower = work.lower
    for _ in range(_PASSES):
        for i in range(d):
            high, low = row_times(work.mass, i, work.v_change[:d])
            total = high + low
            for j in range(i):
                total -= lower[i, j] * (deviation[j] + shifted[j])
            deviation[i] = total / lower[i, i] - shifted[i]
        felt = sqrt(dot_of(deviation, deviation) / size) if size > 0.0 else 0.0
        if not _FELT < felt < _CONTRACTS:
            break
        inside[:] = 0.0
        for j in range(rank):
            overlap = dot_of(work.basis[j], deviation)
            add_multiple(inside, overlap, work.basis[j])
            add_multiple(deviation, -overlap, work.basis[j])
        write_difference(shifted, change, deviation)
        from_whitened(lower, shifted, work.v_change)
    add_multiple(change, 1.0, inside)

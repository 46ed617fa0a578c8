"""Whole impacts in one call: scale by powers of two, resolve, scale back, bound the energy.

Scaling every coordinate to a unit diagonal of M, every row to a largest entry near one and the
velocity to a largest entry near one is exact in binary arithmetic. So no intermediate result over-
or underflows, and a change of units or of row scale by a power of two changes no bit of the result.
"""

from __future__ import annotations

from math import frexp, inf, isfinite
from typing import Annotated, NamedTuple

import numpy as np

from iapb.contact.kernels.impact import (
    ImpactWork,
    factored_impact,
    rank_tolerance,
    whiten_impact,
)
from iapb.contact.kernels.impact_friction import FrictionWork, add_impact_friction
from iapb.contact.kernels.passive import gain_enclosure, passive_step
from iapb.contact.kernels.row_basis import minimum_norm_impulses
from iapb.contact.kernels.unilateral import PushWork, ShareWork, poisson_impact
from iapb.numerics.compiled import copy_into, kernel
from iapb.numerics.double_double import kinetic_energies
from iapb.numerics.linalg import (
    add_multiple,
    all_finite,
    cholesky,
    dot_of,
    multiply_by,
    write_difference,
)
from iapb.numerics.schema import FloatPerRow, Floats, Integers, NumberPerVelocity

# |M − Mᵀ| up to this share of √(Mᵢᵢ Mⱼⱼ) counts as rounding of the given M. Energies use M as
# given, in which the skew part cancels; the Cholesky factor is that of the symmetric part.
SYMMETRY_TOLERANCE = 1e-9
LARGEST_ENTRY = 2.0  # of the scaled M: |Mᵢⱼ| < √(Mᵢᵢ Mⱼⱼ) holds where M is positive definite
_LOWEST_EXPONENT = -100_000  # exponent given to zeros, so that they never decide a maximum
# Where a contact still closes faster than this share of the largest |J v⁻|, or the energy clamp
# takes more than this, the two LCPs of Poisson's law were not solved. Rounding leaves 1e-13 √κ(M);
# rows that push against each other more.
_UNSOLVED = 1e-6
_ROUNDED = 1e-14  # share of the terms of a contact velocity: some times their rounding

# Friction below this share of what Coulomb's law asks for is scaled; above, the rest is rounding.
_WHOLE = 1.0 - 1e-9
# Largest difference of the binary exponents of rows with friction that are not scaled.
_EVEN = 20
# The p of least norm is corrected until it misses less than this share of Δu, or this many times.
_MISSED = 1e-12
_CORRECTIONS = 4

# How an impact ends; the last two have no result.
COMPLETE, BUDGET, CANCELLED, REDUCED, NOT_SOLVED, SCALED, REFUSED, NOT_CONVERGED = range(8)


class Results(NamedTuple):
    """What n impacts write: d coordinates, c contacts, m tangents each."""

    velocity: Annotated[Floats, "impact velocity"]  # v⁺
    generalized_impulse: Annotated[Floats, "impact velocity"]
    impulses: Annotated[Floats, "impact contact"]
    tangential: Annotated[Floats, "impact slip"]
    # rank, status, energy change, its lower and its upper bound, clamp, share of friction
    numbers: Annotated[Floats, "impact 7"]


class ResolveWork(NamedTuple):
    """Scratch of one whole impact."""

    coordinate_exponent: NumberPerVelocity  # s
    row_exponent: Annotated[Integers, "row"]  # r
    # ratio of the caller's rows to the scaled rows, up to one common factor
    size: FloatPerRow
    length: FloatPerRow
    impact: ImpactWork  # scaled
    push: PushWork
    friction: FrictionWork


class Batch(NamedTuple):
    """n impacts of equal size, scratch for one, and what they write."""

    masses: Annotated[Floats, "impact velocity velocity"]
    jacobians: Annotated[Floats, "impact contact velocity"]
    velocities: Annotated[Floats, "impact velocity"]
    restitution: Annotated[Floats, "impact"]  # for (21) in factored form
    # of each contact, for Poisson's law in place of (21); or empty
    unequal: Annotated[Floats, "unequal contact"]
    # for Coulomb's friction, added to (21); or empty
    tangents: Annotated[Floats, "rubbing slip velocity"]
    friction: Annotated[Floats, "rubbing contact"]
    work: ResolveWork
    share: ShareWork  # empty without Poisson's law
    out: Results


@kernel
def resolve_each(batch, tolerance, budget, clamped):
    """Resolve n impacts in the caller's units; return the number of the first without a result, n
    if there is none.

    tolerance : rank tolerance of the rows; 0 selects the default.
    """
    n, c, d = batch.jacobians.shape
    work = batch.work
    out = batch.out
    rubs = len(batch.tangents) > 0
    impact = work.impact
    f = work.friction
    pushes = len(batch.unequal) > 0
    for m in range(n):
        M = batch.masses[m]
        J = batch.jacobians[m]
        v = batch.velocities[m]
        v_plus = out.velocity[m]
        momentum = out.generalized_impulse[m]
        p = out.impulses[m]
        p_t = out.tangential[m]
        out.numbers[m, 1] = REFUSED
        sound, k = scale_impact(M, J, v, not rubs, work)
        if not sound:
            return m
        whiten_impact(d, c, rubs or pushes, impact)
        share = 1.0
        status = COMPLETE
        least = tolerance if tolerance > 0.0 else rank_tolerance(impact.lower)
        if pushes:
            rank, clamp = poisson_impact(
                d, c, batch.unequal[m], least, clamped, impact, work.push, batch.share, p
            )
            if rank < 0:
                out.numbers[m, 1] = NOT_CONVERGED
                return m
            status = COMPLETE if clamp >= 1.0 - _UNSOLVED else NOT_SOLVED
        else:
            rank, clamp = factored_impact(
                d, c, batch.restitution[m], least, budget, clamped, impact
            )
            for i in range(c if rank == budget and rank < d else 0):
                status = BUDGET if impact.size[i] > least * least else status
            if not rubs:
                least_norm_impulses(d, c, rank, work, p)
            else:
                for j in range(len(p_t)):
                    for i in range(d):
                        f.rows[j, i] = np.ldexp(
                            batch.tangents[m, j, i],
                            work.coordinate_exponent[i] + work.row_exponent[j * c // len(p_t)],
                        )
                copy_into(f.coefficient[:c], batch.friction[m])
                share, factor, met = add_impact_friction(d, c, rank, impact, work.push, f, False, p)
                clamp *= factor
                status = (COMPLETE if share > _WHOLE else SCALED) if met else REDUCED
                copy_into(p_t, f.p)
        factor, rounded = unscale_impact(
            M,
            J,
            v,
            clamped,
            k,
            work,
            v_plus,
            momentum,
            p,
            p_t,
            out.numbers[m],
        )
        clamp *= factor
        if not (
            all_finite(v_plus)
            and all_finite(momentum)
            and all_finite(p)
            and all_finite(p_t)
            and isfinite(out.numbers[m, 2])
        ):
            return m
        if pushes and not separates(J, v, v_plus):
            status = NOT_SOLVED
        if clamp == 0.0:
            moving = is_moving(J, v, pushes)
            status = CANCELLED if moving else COMPLETE
        out.numbers[m, 0] = rank
        out.numbers[m, 1] = CANCELLED if rounded else status
        out.numbers[m, 5] = clamp
        out.numbers[m, 6] = share
    return n


@kernel
def scale_impact(mass_matrix, jacobian, velocity, scales_rows, work):
    """Scale: v' = 2^−(s + k) v, M' = 2^(s + s) M, J' = 2^(s + r) J; factor M'.

    Returns whether all is finite and M symmetric and positive definite, and k.
    scales_rows : False takes r = 0, unless the rows differ in size by more than 2^_EVEN: the
        normal impulses of friction depend on the scale where they are not unique.
    """
    d = len(velocity)
    s = work.coordinate_exponent
    r = work.row_exponent
    impact = work.impact
    for i in range(d):
        if not (mass_matrix[i, i] > 0.0 and isfinite(mass_matrix[i, i]) and isfinite(velocity[i])):
            return False, 0
        s[i] = -(frexp(mass_matrix[i, i])[1] // 2)
    for i in range(d):
        for j in range(d):
            impact.mass[i, j] = np.ldexp(mass_matrix[i, j], s[i] + s[j])
    for i in range(d):
        for j in range(d):
            a = impact.mass[i, j]
            b = impact.mass[j, i]
            if not (abs(a) <= LARGEST_ENTRY and abs(a - b) <= SYMMETRY_TOLERANCE):
                return False, 0
            impact.lower[i, j] = a if a == b else 0.5 * (a + b)
    if cholesky(impact.lower, impact.lower) != 0:
        return False, 0
    k = _LOWEST_EXPONENT
    for i in range(d):
        k = max(k, _exponent(velocity[i]) - s[i])
    k = 0 if k <= _LOWEST_EXPONENT // 2 else k
    for i in range(d):
        impact.v[i] = np.ldexp(velocity[i], -(s[i] + k))
    longest = -_LOWEST_EXPONENT
    shortest = _LOWEST_EXPONENT
    for i in range(len(jacobian)):
        r[i] = -_LOWEST_EXPONENT  # of a row of zeros
        for j in range(d):
            if not isfinite(jacobian[i, j]):
                return False, 0
            r[i] = min(r[i], -_exponent(jacobian[i, j]) - s[j])
        if r[i] < -_LOWEST_EXPONENT // 2:
            longest = min(longest, r[i])
            shortest = max(shortest, r[i])
    for i in range(len(jacobian)):
        if not scales_rows and (shortest - longest <= _EVEN or r[i] > shortest):
            r[i] = 0
        for j in range(d):
            impact.columns[j, i] = np.ldexp(jacobian[i, j], r[i] + s[j])
    return True, k


@kernel
def _exponent(value):
    """Return the binary exponent; for zero, one that is never the maximum."""
    return frexp(value)[1] if value != 0.0 else _LOWEST_EXPONENT


@kernel
def separates(jacobian, v, v_plus):
    """Whether no contact closes after Poisson's law, by more than _UNSOLVED of the largest contact
    velocity before, or than the rounding of its own."""
    largest = 0.0
    separate = True
    for i in range(len(jacobian)):
        largest = max(largest, abs(dot_of(jacobian[i], v)))
    for i in range(len(jacobian)):
        closing = -dot_of(jacobian[i], v_plus)
        separate = separate and closing <= max(_UNSOLVED * largest, _rounding(jacobian[i], v_plus))
    return separate


@kernel
def is_moving(jacobian, v, pushes):
    """Whether a contact moves by more than rounding, or closes if contacts only push; else v⁺ = v is
    right."""
    moving = False
    for i in range(len(jacobian)):
        speed = dot_of(jacobian[i], v)
        moving = moving or (-speed if pushes else abs(speed)) > _rounding(jacobian[i], v)
    return moving


@kernel
def _rounding(row, v):
    """Return a bound of the rounding of row · v, some times as large."""
    total = 0.0
    for k in range(len(v)):
        total += abs(row[k] * v[k])
    return _ROUNDED * total


@kernel
def least_norm_impulses(d, count, rank, work, impulses):
    """Write the p of least norm along the *caller's* rows with Aᵀp = Δu, as p' = 2^−r p for the
    scaled rows.

    If row sizes differ, the p of least norm is computed first. Its rounding leaves a residual of
    Δu, which a p' of least norm then corrects; this second solve does not depend on the row sizes.
    """
    impact = work.impact
    r = work.row_exponent
    least = -_LOWEST_EXPONENT
    even = True
    for i in range(count):
        least = min(least, r[i])
    for i in range(count):
        work.size[i] = np.ldexp(1.0, max(least - r[i], -1000))
        even = even and (r[i] == least or r[i] > -_LOWEST_EXPONENT // 2)
        work.length[i] = impact.length[i] * work.size[i]
    minimum_norm_impulses(d, count, rank, work.length, impact.change[:d], impulses, impact)
    if even:
        return
    for i in range(count):
        impulses[i] *= work.size[i]
    missed = impact.v_change[:d]
    change = impact.change[:d]
    for turn in range(_CORRECTIONS):
        for k in range(d):
            total = 0.0
            for i in range(count):
                total += impact.rows[k, i] * impact.length[i] * impulses[i]
            missed[k] = change[k] - total
        if turn > 0 and dot_of(missed, missed) <= _MISSED * _MISSED * dot_of(change, change):
            break
        minimum_norm_impulses(d, count, rank, impact.length, missed, work.length, impact)
        add_multiple(impulses, 1.0, work.length)


@kernel
def unscale_impact(
    mass_matrix,
    jacobian,
    velocity,
    clamped,
    k,
    work,
    v_plus,
    momentum,
    impulses,
    tangential,
    numbers,
):
    """Return to the caller's units in place; clamp the step again if this rounding raised the
    energy.

    Writes the energy change, its lower and upper bound, unless v⁺ overflows; returns the factor of
    this clamp, and whether scaling rounded an entry of v that a row or the impact touches.
    """
    d = len(velocity)
    s = work.coordinate_exponent
    factor = 1.0
    impact = work.impact
    rounded = False
    for i in range(d):
        touched = impact.v_plus[i] != impact.v[i]
        v_plus[i] = np.ldexp(impact.v_plus[i], s[i] + k) if touched else velocity[i]
        for m in range(len(jacobian)):
            touched = touched or jacobian[m, i] != 0.0
        rounded = rounded or touched and np.ldexp(impact.v[i], s[i] + k) != velocity[i]
        momentum[i] = np.ldexp(impact.momentum[i], k - s[i])
    for i in range(len(impulses)):
        impulses[i] = np.ldexp(impulses[i], work.row_exponent[i] + k)
    for j in range(len(tangential)):
        r = work.row_exponent[j * len(impulses) // len(tangential)]
        tangential[j] = np.ldexp(tangential[j], r + k)
    if not all_finite(v_plus):
        return factor, rounded
    lower, upper, exponent = gain_enclosure(mass_matrix, velocity, v_plus)
    if clamped and not upper <= 0.0:
        step = impact.v_change[:d]
        write_difference(step, v_plus, velocity)
        factor = passive_step(mass_matrix, velocity, step, 1.0, v_plus)
        for i in range(d):
            impact.v_plus[i] = np.ldexp(v_plus[i], -(s[i] + k))
        for scaled in (momentum, impulses, tangential):
            multiply_by(scaled, factor)
        lower, upper, exponent = gain_enclosure(mass_matrix, velocity, v_plus)
    change = np.ldexp(kinetic_energies(impact.mass, impact.v, impact.v_plus)[1], 2 * k)
    low = _outward(lower, exponent - 2, -inf)
    high = _outward(upper, exponent - 2, inf)
    change = low if low > change else change
    numbers[2] = high if high < change else change
    numbers[3] = low
    numbers[4] = high
    return factor, rounded


@kernel
def _outward(value, exponent, towards):
    """Return value · 2^exponent, rounded one step outwards; a bound that shows no gain (or no loss)
    still shows it."""
    bound = np.nextafter(np.ldexp(value, exponent), towards)
    if towards > 0.0:
        return min(bound, 0.0) if value <= 0.0 else bound
    return max(bound, 0.0) if value >= 0.0 else bound

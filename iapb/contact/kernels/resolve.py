"""Whole impacts in one call: scale by powers of two, resolve, scale back, bound the energy.

Scaling every coordinate to a unit diagonal of M, every row to a largest entry near one and the
velocity to a largest entry near one is exact in binary arithmetic. So no intermediate result over-
or underflows, and a change of units or of row scale by a power of two changes no bit of the result.
"""

from __future__ import annotations

import math
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
from iapb.numerics.linalg import add_multiple, all_finite, cholesky, dot_of
from iapb.numerics.schema import Floats, Integers

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

    velocity: np.ndarray  # (n, d) v⁺
    generalized_impulse: np.ndarray  # (n, d)
    impulses: np.ndarray  # (n, c)
    tangential: np.ndarray  # (n, c m)
    # (n, 7) rank, status, energy change, its lower and its upper bound, clamp, share of friction
    numbers: np.ndarray


class ResolveWork(NamedTuple):
    """Scratch of one whole impact."""

    coordinate_exponent: Annotated[Integers, "velocity"]  # s
    row_exponent: Annotated[Integers, "row"]  # r
    # ratio of the caller's rows to the scaled rows, up to one common factor
    size: Annotated[Floats, "row"]
    length: Annotated[Floats, "row"]
    impact: ImpactWork  # scaled
    push: PushWork
    friction: FrictionWork


class Batch(NamedTuple):
    """n impacts of equal size, scratch for one, and what they write."""

    masses: np.ndarray  # (n, d, d)
    jacobians: np.ndarray  # (n, c, d)
    velocities: np.ndarray  # (n, d)
    restitution: np.ndarray  # (n,) for (21) in factored form
    unequal: np.ndarray  # (n, c) of each contact, for Poisson's law in place of (21), or (0, c)
    tangents: np.ndarray  # (n, c m, d) for Coulomb's friction, added to (21), or (0, c m, d)
    friction: np.ndarray  # (n, c) likewise
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
    masses = batch.masses
    jacobians = batch.jacobians
    velocities = batch.velocities
    work = batch.work
    out = batch.out
    rubs = batch.tangents.shape[0] > 0
    impact = work.impact
    f = work.friction
    pushes = batch.unequal.shape[0] > 0
    for m in range(n):
        v_plus = out.velocity[m]
        momentum = out.generalized_impulse[m]
        p = out.impulses[m]
        p_t = out.tangential[m]
        out.numbers[m, 1] = REFUSED
        sound, k = scale_impact(masses[m], jacobians[m], velocities[m], not rubs, work)
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
                for j in range(p_t.shape[0]):
                    for i in range(d):
                        f.rows[j, i] = np.ldexp(
                            batch.tangents[m, j, i],
                            work.coordinate_exponent[i] + work.row_exponent[j * c // p_t.shape[0]],
                        )
                copy_into(f.coefficient[:c], batch.friction[m])
                share, factor, met = add_impact_friction(d, c, rank, impact, work.push, f, False, p)
                clamp *= factor
                status = (COMPLETE if share > _WHOLE else SCALED) if met else REDUCED
                copy_into(p_t, f.p)
        factor, rounded = unscale_impact(
            masses[m],
            jacobians[m],
            velocities[m],
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
            and math.isfinite(out.numbers[m, 2])
        ):
            return m
        if pushes and not separates(jacobians[m], velocities[m], v_plus):
            status = NOT_SOLVED
        if clamp == 0.0:
            moving = is_moving(jacobians[m], velocities[m], pushes)
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
    d = velocity.shape[0]
    s = work.coordinate_exponent
    r = work.row_exponent
    impact = work.impact
    for i in range(d):
        if not (
            mass_matrix[i, i] > 0.0
            and math.isfinite(mass_matrix[i, i])
            and math.isfinite(velocity[i])
        ):
            return False, 0
        s[i] = -(math.frexp(mass_matrix[i, i])[1] // 2)
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
    for i in range(jacobian.shape[0]):
        r[i] = -_LOWEST_EXPONENT  # of a row of zeros
        for j in range(d):
            if not math.isfinite(jacobian[i, j]):
                return False, 0
            r[i] = min(r[i], -_exponent(jacobian[i, j]) - s[j])
        if r[i] < -_LOWEST_EXPONENT // 2:
            longest = min(longest, r[i])
            shortest = max(shortest, r[i])
    for i in range(jacobian.shape[0]):
        if not scales_rows and (shortest - longest <= _EVEN or r[i] > shortest):
            r[i] = 0
        for j in range(d):
            impact.columns[j, i] = np.ldexp(jacobian[i, j], r[i] + s[j])
    return True, k


@kernel
def _exponent(value):
    """Return the binary exponent; for zero, one that is never the maximum."""
    return math.frexp(value)[1] if value != 0.0 else _LOWEST_EXPONENT


@kernel
def separates(jacobian, v, v_plus):
    """Whether no contact closes after Poisson's law, by more than _UNSOLVED of the largest contact
    velocity before, or than the rounding of its own."""
    largest = 0.0
    separate = True
    for i in range(jacobian.shape[0]):
        largest = max(largest, abs(dot_of(jacobian[i], v)))
    for i in range(jacobian.shape[0]):
        closing = -dot_of(jacobian[i], v_plus)
        separate = separate and closing <= max(_UNSOLVED * largest, _rounding(jacobian[i], v_plus))
    return separate


@kernel
def is_moving(jacobian, v, pushes):
    """Whether a contact moves by more than rounding, or closes if contacts only push; else v⁺ = v is
    right."""
    moving = False
    for i in range(jacobian.shape[0]):
        speed = dot_of(jacobian[i], v)
        moving = moving or (-speed if pushes else abs(speed)) > _rounding(jacobian[i], v)
    return moving


@kernel
def _rounding(row, v):
    """Return a bound of the rounding of row · v, some times as large."""
    total = 0.0
    for k in range(v.shape[0]):
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
    d = velocity.shape[0]
    s = work.coordinate_exponent
    factor = 1.0
    impact = work.impact
    rounded = False
    for i in range(d):
        touched = impact.v_plus[i] != impact.v[i]
        v_plus[i] = np.ldexp(impact.v_plus[i], s[i] + k) if touched else velocity[i]
        for m in range(jacobian.shape[0]):
            touched = touched or jacobian[m, i] != 0.0
        rounded = rounded or touched and np.ldexp(impact.v[i], s[i] + k) != velocity[i]
        momentum[i] = np.ldexp(impact.momentum[i], k - s[i])
    for i in range(impulses.shape[0]):
        impulses[i] = np.ldexp(impulses[i], work.row_exponent[i] + k)
    for j in range(tangential.shape[0]):
        r = work.row_exponent[j * impulses.shape[0] // tangential.shape[0]]
        tangential[j] = np.ldexp(tangential[j], r + k)
    if not all_finite(v_plus):
        return factor, rounded
    lower, upper, exponent = gain_enclosure(mass_matrix, velocity, v_plus)
    if clamped and not upper <= 0.0:
        step = impact.v_change
        for i in range(d):
            step[i] = v_plus[i] - velocity[i]
        factor = passive_step(mass_matrix, velocity, step[:d], 1.0, v_plus)
        for i in range(d):
            impact.v_plus[i] = np.ldexp(v_plus[i], -(s[i] + k))
        for scaled in (momentum, impulses, tangential):
            for i in range(scaled.shape[0]):
                scaled[i] *= factor
        lower, upper, exponent = gain_enclosure(mass_matrix, velocity, v_plus)
    change = np.ldexp(kinetic_energies(impact.mass, impact.v, impact.v_plus)[1], 2 * k)
    low = _outward(lower, exponent - 2, -math.inf)
    high = _outward(upper, exponent - 2, math.inf)
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

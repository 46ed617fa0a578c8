"""A whole impact in one call: check the input, scale by powers of two, resolve, scale back, bound the energy.

Scaling every coordinate to a unit diagonal of M, every row to a largest entry near one and the velocity to a largest
entry near one is exact in binary arithmetic. So no intermediate result over- or underflows, and a change of units or
of row scale by a power of two changes no bit of the result.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from iapb.compiled import kernel
from iapb.contact.kernels.impact import ImpactWork, factored_impact, make_impact_work, rank_tolerance
from iapb.contact.kernels.passive import gain_enclosure, passive_step
from iapb.contact.kernels.projector import minimum_norm_impulses
from iapb.double_double import kinetic_energies
from iapb.linalg import cholesky

# |M − Mᵀ| up to this share of √(Mᵢᵢ Mⱼⱼ) counts as rounding of the given M. Energies use M as given, in which the skew
# part cancels; the Cholesky factor is that of the symmetric part.
_SYMMETRY_TOLERANCE = 1e-9
_LOWEST_EXPONENT = -100_000  # exponent given to zeros, so that they never decide a maximum
_EXACT = 1000  # largest difference of binary exponents from the largest entry that still scales exactly

# Reasons to refuse an impact, returned with their place: (reason, i, j).
FINE, MASS_NOT_FINITE, VELOCITY_NOT_FINITE, ROWS_NOT_FINITE, DIAGONAL, ENTRY, ASYMMETRIC, NOT_DEFINITE = range(8)
VELOCITY_RANGE, MOMENTUM_RANGE, IMPULSE_RANGE, ENERGY_RANGE = range(8, 12)
# How an impact ends.
COMPLETE, BUDGET, CANCELLED = range(3)


class BorderWork(NamedTuple):
    """Scratch of one whole impact: d coordinates, c contacts."""

    mass: np.ndarray  # (d, d) scaled, symmetric to rounding
    symmetric: np.ndarray  # (d, d) its symmetric part
    lower: np.ndarray  # (d, d) the Cholesky factor of `symmetric`
    rows: np.ndarray  # (d, c) scaled rows as columns
    velocity: np.ndarray  # (d,) scaled
    coordinate_exponent: np.ndarray  # s (d,)
    row_exponent: np.ndarray  # r (c,)
    velocity_exponent: np.ndarray  # k (1,)
    underflows: np.ndarray  # (1,) entries of v are so far apart that scaling rounds the small ones
    v_plus: np.ndarray  # (d,) scaled
    momentum: np.ndarray  # (d,) scaled
    candidate: np.ndarray  # (d,)
    size: np.ndarray  # (c,) ratio of the caller's rows to the scaled rows, up to one common factor
    length: np.ndarray  # (c,)
    impulses: np.ndarray  # (c,)
    triangle: np.ndarray  # (d, d)
    target: np.ndarray  # (d,)
    impact: ImpactWork


def make_border_work(coordinates: int, contacts: int) -> BorderWork:
    """Allocate the scratch for `contacts` rows on `coordinates` generalized velocities."""
    d, c = coordinates, contacts
    return BorderWork(
        mass=np.zeros((d, d)), symmetric=np.zeros((d, d)), lower=np.zeros((d, d)), rows=np.zeros((d, c)),
        velocity=np.zeros(d), coordinate_exponent=np.zeros(d, np.int64), row_exponent=np.zeros(c, np.int64),
        velocity_exponent=np.zeros(1, np.int64), underflows=np.zeros(1, np.bool_), v_plus=np.zeros(d),
        momentum=np.zeros(d), candidate=np.zeros(d), size=np.zeros(c), length=np.zeros(c), impulses=np.zeros(c),
        triangle=np.zeros((d, d)), target=np.zeros(d), impact=make_impact_work(d, max(1, c)))


@kernel
def scale_impact(mass_matrix, jacobian, velocity, work):
    """Check and scale: v' = 2^−(s + k) v, M' = 2^(s + s) M = L Lᵀ, J' = 2^(s + r) J. Return (reason, i, j)."""
    d, c = velocity.shape[0], jacobian.shape[0]
    reason, i, j = _not_finite(mass_matrix, jacobian, velocity)
    if reason != FINE:
        return reason, i, j
    least = 0
    for i in range(d):
        if mass_matrix[i, i] < mass_matrix[least, least]:
            least = i
    if not mass_matrix[least, least] > 0.0:
        return DIAGONAL, least, least
    s, row = work.coordinate_exponent, work.row_exponent
    for i in range(d):
        s[i] = -(math.frexp(mass_matrix[i, i])[1] // 2)
    reason, i, j = _scale_mass(mass_matrix, work)
    if reason != FINE:
        return reason, i, j
    k = _LOWEST_EXPONENT
    for i in range(d):
        k = max(k, _exponent(velocity[i]) - s[i])
    k = 0 if k <= _LOWEST_EXPONENT // 2 else k
    work.velocity_exponent[0] = k
    work.underflows[0] = False
    for i in range(d):
        size = _exponent(velocity[i]) - s[i]
        if _LOWEST_EXPONENT // 2 < size < k - _EXACT:
            work.underflows[0] = True
        work.velocity[i] = np.ldexp(velocity[i], -(s[i] + k))
    for i in range(c):
        largest = _LOWEST_EXPONENT
        for j in range(d):
            largest = max(largest, _exponent(jacobian[i, j]) + s[j])
        row[i] = 0 if abs(largest) > -_LOWEST_EXPONENT // 2 else -largest  # a row of zeros
        for j in range(d):
            work.rows[j, i] = np.ldexp(jacobian[i, j], row[i] + s[j])
    return FINE, 0, 0


@kernel
def _not_finite(mass_matrix, jacobian, velocity):
    """Return the first entry that is not finite: (reason, i, j)."""
    d, c = velocity.shape[0], jacobian.shape[0]
    for i in range(d):
        for j in range(d):
            if not math.isfinite(mass_matrix[i, j]):
                return MASS_NOT_FINITE, i, j
    for i in range(d):
        if not math.isfinite(velocity[i]):
            return VELOCITY_NOT_FINITE, i, 0
    for i in range(c):
        for j in range(d):
            if not math.isfinite(jacobian[i, j]):
                return ROWS_NOT_FINITE, i, j
    return FINE, 0, 0


@kernel
def _exponent(value):
    """Return the binary exponent; for zero, one that is never the maximum."""
    return math.frexp(value)[1] if value != 0.0 else _LOWEST_EXPONENT


@kernel
def _scale_mass(mass_matrix, work):
    """Write the scaled M, its symmetric part and the Cholesky factor of this part; return (reason, i, j)."""
    s, d = work.coordinate_exponent, work.mass.shape[0]
    row, column, largest = 0, 0, -1.0
    for i in range(d):
        for j in range(d):
            entry = np.ldexp(mass_matrix[i, j], s[i] + s[j])
            work.mass[i, j] = entry
            if abs(entry) > largest:
                row, column, largest = i, j, abs(entry)
    if not largest <= 2.0:  # |Mᵢⱼ| < √(Mᵢᵢ Mⱼⱼ) holds where M is positive definite
        return ENTRY, row, column
    largest = 0.0
    for i in range(d):
        for j in range(d):
            a, b = work.mass[i, j], work.mass[j, i]
            work.symmetric[i, j] = a if a == b else 0.5 * (a + b)
            if abs(a - b) > largest:
                row, column, largest = i, j, abs(a - b)
    if largest > _SYMMETRY_TOLERANCE:
        return ASYMMETRIC, row, column
    pivot = cholesky(work.symmetric, work.lower)
    return (NOT_DEFINITE, pivot, 0) if pivot != 0 else (FINE, 0, 0)


@kernel
def whole_impact(mass_matrix, jacobian, velocity, restitution, tolerance, budget, clamped, work, v_plus, momentum,
                 impulses):
    """Resolve an impact in the caller's units by (21) in factored form.

    tolerance : rank tolerance of the rows; 0 selects the default.  v_plus, momentum (d,), impulses (c,) : output.
    Returns (reason, i, j), (rank, status), clamp, (energy change, its lower and upper bound).
    """
    wrong = scale_impact(mass_matrix, jacobian, velocity, work)
    if wrong[0] != FINE:
        return wrong, (0, COMPLETE), 0.0, (0.0, 0.0, 0.0)
    d, c, impact = velocity.shape[0], jacobian.shape[0], work.impact
    for i in range(d):
        for j in range(c):
            impact.columns[i, j] = work.rows[i, j]
    share = tolerance if tolerance > 0.0 else rank_tolerance(work.lower)
    rank, clamp = factored_impact(work.mass, work.lower, work.velocity, restitution, c, share, budget, clamped, impact,
                                  work.v_plus, work.momentum)
    status = COMPLETE
    if rank == budget and rank < d:
        for i in range(c):
            if impact.size[i] > share * share:
                status = BUDGET
    least_norm_impulses(work, rank)
    factor, energies = unscale_impact(mass_matrix, velocity, clamped, work, v_plus, momentum, impulses)
    clamp *= factor
    if clamp == 0.0 or work.underflows[0] and c > 0:
        status = CANCELLED
    return (_out_of_range(v_plus, momentum, impulses, energies[0]), 0, 0), (rank, status), clamp, energies


@kernel
def least_norm_impulses(work, rank):
    """Write the p of least norm along the *caller's* rows with Aᵀp = Δu, as p' = 2^−r p for the scaled rows.

    If row sizes differ, the p of least norm is computed first. Its rounding leaves a residual of Δu, which a p' of
    least norm then corrects; this second solve does not depend on the row sizes.
    """
    d, c, impact = work.velocity.shape[0], work.row_exponent.shape[0], work.impact
    even = row_sizes(work)
    for i in range(c):
        work.length[i] = impact.length[i] * work.size[i]
    minimum_norm_impulses(impact.rows, work.length, c, impact.basis, rank, impact.change, work.impulses,
                          impact.columns, work.triangle, work.target)
    if even:
        return
    for i in range(c):
        work.impulses[i] *= work.size[i]
    for k in range(d):
        total = 0.0
        for i in range(c):
            total += impact.rows[k, i] * impact.length[i] * work.impulses[i]
        work.candidate[k] = impact.change[k] - total
    minimum_norm_impulses(impact.rows, impact.length, c, impact.basis, rank, work.candidate, work.length,
                          impact.columns, work.triangle, work.target)
    for i in range(c):
        work.impulses[i] += work.length[i]


@kernel
def row_sizes(work):
    """Write the sizes 2^−r (c,), scaled to a largest of 1; return whether all are 1. A row of zeros has size 1."""
    c, d, row = work.row_exponent.shape[0], work.velocity.shape[0], work.row_exponent
    least, even = -_LOWEST_EXPONENT, True
    for i in range(c):
        work.size[i] = 0.0  # whether any entry is not zero
        for k in range(d):
            if work.rows[k, i] != 0.0:
                work.size[i] = 1.0
        if work.size[i] > 0.0:
            least = min(least, row[i])
    for i in range(c):
        work.size[i] = np.ldexp(1.0, max(least - row[i], -1000)) if work.size[i] > 0.0 else 1.0
        even = even and work.size[i] == 1.0
    return even


@kernel
def unscale_impact(mass_matrix, velocity, clamped, work, v_plus, momentum, impulses):
    """Write the impact in the caller's units; clamp the step again if this rounding raised the energy.

    Returns the factor of this clamp, and (energy change, its lower and upper bound); they are NaN if v⁺ overflows.
    """
    d, s, k = velocity.shape[0], work.coordinate_exponent, work.velocity_exponent[0]
    for i in range(d):
        v_plus[i] = np.ldexp(work.v_plus[i], s[i] + k)
        momentum[i] = np.ldexp(work.momentum[i], k - s[i])
    for i in range(impulses.shape[0]):
        impulses[i] = np.ldexp(work.impulses[i], work.row_exponent[i] + k)
    for i in range(d):
        if not math.isfinite(v_plus[i]):
            return 1.0, (math.nan, math.nan, math.nan)
    factor = 1.0
    lower, upper, exponent = gain_enclosure(mass_matrix, velocity, v_plus)
    if clamped and not upper <= 0.0:
        for i in range(d):
            work.candidate[i] = v_plus[i] - velocity[i]
        factor = passive_step(mass_matrix, velocity, work.candidate, 1.0, v_plus)
        for i in range(d):
            work.v_plus[i] = np.ldexp(v_plus[i], -(s[i] + k))
        lower, upper, exponent = gain_enclosure(mass_matrix, velocity, v_plus)
        if factor != 1.0:
            for i in range(d):
                momentum[i] *= factor
            for i in range(impulses.shape[0]):
                impulses[i] *= factor
    change = np.ldexp(kinetic_energies(work.mass, work.velocity, work.v_plus)[1], 2 * k)
    low, high = _outward(lower, exponent - 2, -math.inf), _outward(upper, exponent - 2, math.inf)
    change = low if low > change else change
    return factor, (high if high < change else change, low, high)


@kernel
def _outward(value, exponent, towards):
    """Return value · 2^exponent, rounded one step outwards; a bound that shows no gain (or no loss) still shows it."""
    bound = np.nextafter(np.ldexp(value, exponent), towards)
    if towards > 0.0 and value <= 0.0:
        return min(bound, 0.0)
    if towards < 0.0 and value >= 0.0:
        return max(bound, 0.0)
    return bound


@kernel
def _out_of_range(v_plus, momentum, impulses, energy):
    """Return which result is not finite, FINE if all are."""
    for i in range(v_plus.shape[0]):
        if not math.isfinite(v_plus[i]):
            return VELOCITY_RANGE
    for i in range(momentum.shape[0]):
        if not math.isfinite(momentum[i]):
            return MOMENTUM_RANGE
    for i in range(impulses.shape[0]):
        if not math.isfinite(impulses[i]):
            return IMPULSE_RANGE
    return FINE if math.isfinite(energy) else ENERGY_RANGE


@kernel
def whole_impacts(masses, jacobians, velocities, restitution, tolerance, budget, clamped, work, v_plus, momentum,
                  impulses, counts, numbers):
    """Do `whole_impact` for n problems; counts (n, 2): rank, status; numbers (n, 4): clamp, energy change, its bounds.

    Returns (reason, i, j) and the index of the first impact that is refused; FINE and n if none is.
    """
    n = velocities.shape[0]
    for m in range(n):
        wrong, ranks, clamp, energies = whole_impact(
            masses[m], jacobians[m], velocities[m], restitution[m], tolerance, budget, clamped, work, v_plus[m],
            momentum[m], impulses[m])
        if wrong[0] != FINE:
            return wrong, m
        counts[m, 0], counts[m, 1] = ranks
        numbers[m, 0] = clamp
        numbers[m, 1], numbers[m, 2], numbers[m, 3] = energies
    return (FINE, 0, 0), n

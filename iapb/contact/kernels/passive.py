"""Last step of every impact: prevent a gain of kinetic energy in real arithmetic; the enclosure
that proves it.

Let s = w + v, Δ = w − v and A = M + Mᵀ, each an exact pair of doubles. Four times the gain of
kinetic energy is

    Γ = Δᵀ A s = 2 (wᵀMw − vᵀMv)

for the mass matrix M as given. A skew part of M cancels, and M is not replaced by a rounded
symmetric part. (Δᵀ M s, without the transpose, differs from Γ/2 if M is asymmetric in the last
bit.) A candidate w is accepted if an upper bound of Γ is not positive. Two functions bound Γ:
`gain` in double-double, and `wide_gain` for numbers of any size. Coq proves both bounds for d ≤ 2¹⁵
(verification/proofs/coq). u = 2⁻⁵³ and η = 2⁻¹⁰⁷⁴. Operations round to nearest, without fastmath
and without contraction.
"""

from __future__ import annotations

from math import copysign, frexp, inf, isfinite, ldexp, sqrt

import numpy as np

from iapb.numerics.compiled import copy_into, kernel
from iapb.numerics.double_double import least_energy, two_product, two_sum

UNIT = 2.0**-53
# 2⁵⁴ η: a normal number, since each operation with a subnormal one takes 0.1 µs
_UNDERFLOW = 2.0**-1020
_DROPPED = -800  # exponent relative to the largest term below which `wide_gain` omits a term
_MOVES = 24  # of last places; four in ten candidates need none, most others one or two
_GROWTH = 4.0  # of what is taken off a step, from one attempt to the next, should moves fail


@kernel
def gain(mass_matrix, v, w):
    """Evaluate Γ in double-double: return (high, low, radius, underflow) with |Γ − (high + low)| ≤
    radius + underflow.

    The pairs s, Δ and A are exact (TwoSum), products of high parts too (TwoProduct); `low` collects
    what both leave. In units of u² S, S = Σᵢⱼ |dhᵢ ahᵢⱼ shⱼ|, the error is about 2d² + 17d + 26,
    and `radius` 2 (d+6)² = 2d² + 24d + 72. Coq proves the bound for every d ≤ 2¹⁵, with the
    rounding of S, of `radius` and of the sum that callers form, and `underflow` for products below
    2⁻⁹⁶⁹. Overflow, also in Dekker's splitting, makes high + (low + radius) NaN or infinite, which
    `gain_enclosure` refuses (verification/proofs/coq/Accepted.v, never_gains_in_binary64).
    """
    d = len(v)
    high = low = size = moved = 0.0
    for i in range(d):
        h = l = row_size = 0.0
        for j in range(d):
            a_hi, a_lo = two_sum(mass_matrix[i, j], mass_matrix[j, i])
            s_hi, s_lo = two_sum(w[j], v[j])
            h, l, p = _add_pairs(h, l, a_hi, a_lo, s_hi, s_lo)
            row_size += abs(p)
        d_hi, d_lo = two_sum(w[i], -v[i])
        high, low, _ = _add_pairs(high, low, d_hi, d_lo, h, l)
        size += abs(d_hi) * row_size
        moved += abs(d_hi)
    if moved == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    margin = d + 6.0
    return high, low, 2.0 * margin * margin * UNIT * UNIT * size, d * _UNDERFLOW * (1.0 + moved)


@kernel
def _add_pairs(high, low, a_hi, a_lo, b_hi, b_lo):
    """Return high and low with the product of two pairs added, and the product of their high parts."""
    p, e = two_product(a_hi, b_hi)
    c = a_hi * b_lo + a_lo * b_hi
    high, t = two_sum(high, p)
    return high, low + ((t + e) + c), p


@kernel
def wide_gain(mass_matrix, v, w):
    """Return Γ for numbers of any size: (high, low, radius, exponent) with |Γ/2^exponent − (high +
    low)| ≤ radius.

    Γ = Σᵢⱼ Mᵢⱼ (Δᵢ sⱼ + sᵢ Δⱼ) has n = 8d² products x M y of doubles, x and y the halves of the
    pairs Δ and s. Each is evaluated on mantissas in [½, 1), so that nothing under- or overflows,
    and scaled to the largest exponent among them by a power of two. Products below 2⁻⁸⁰⁰ are
    omitted.

    Proof of the bound: with p + e = x M and q + f = p y exactly, the low part fl(f + fl(e y)) errs
    by 3u² of the product; the sum is the compensated one of `gain`. With the rounding of S = Σ|q|
    and of low + radius this is below (n + 5)² u² S; the omitted terms, at most n 2⁻⁸⁰⁰, are added.
    Coq proves it, and that no number overflows, if frexp and ldexp are exact
    (verification/proofs/coq/Wide.v, wide_never_gains_in_binary64).
    """
    d = len(v)
    top = -100_000
    count = 0
    high = low = size = 0.0
    for summing in range(2):
        for i in range(d):
            for j in range(d):
                if mass_matrix[i, j] == 0.0:
                    continue
                m, m_exponent = frexp(mass_matrix[i, j])
                for choice in range(8):
                    x, x_exponent = _half(v[i], w[i], choice < 4, choice % 2 == 1)
                    y, y_exponent = _half(v[j], w[j], choice >= 4, choice % 4 >= 2)
                    if x == 0.0 or y == 0.0:
                        continue
                    exponent = x_exponent + m_exponent + y_exponent
                    if not summing:
                        top = max(top, exponent)
                        count += 1
                    elif exponent - top >= _DROPPED:
                        unit = ldexp(1.0, exponent - top)
                        p, e = two_product(x, m)
                        q, f = two_product(p, y)
                        f += e * y
                        high, t = two_sum(high, q * unit)
                        low += t + f * unit
                        size += abs(q * unit)
    if count == 0:
        return 0.0, 0.0, 0.0, 0
    n = count + 5.0
    return high, low, n * n * UNIT * UNIT * size + n * 2.0**_DROPPED, top


@kernel
def _half(v, w, difference, is_low):
    """Return mantissa and exponent of the high or the low half of w − v or of w + v.

    The sum of quarters cannot overflow, and they are exact; where one of the two is below 2⁹⁰⁰,
    neither can w ± v.
    """
    scale, shift = (0.25, 2) if min(abs(v), abs(w)) > 2.0**900 else (1.0, 0)
    high, low = two_sum(scale * w, -scale * v if difference else scale * v)
    mantissa, exponent = frexp(low if is_low else high)
    return mantissa, exponent + shift


@kernel
def gain_enclosure(mass_matrix, v, w):
    """Return (lower, upper, exponent): Γ lies in [lower, upper] · 2^exponent, up to one rounding of
    each end.

    If upper ≤ 0, then Γ ≤ 0 is certain: the last sum rounds once and keeps its sign. An infinite
    one can be wrong: the halves of a product near 2¹⁰²⁴ can overflow where it does not.
    """
    high, low, radius, underflow = gain(mass_matrix, v, w)
    radius += underflow
    upper = high + (low + radius)
    if radius == 0.0 or isfinite(upper) and (3.0 * underflow <= radius or upper <= 0.0):
        return high + (low - radius), upper, 0
    high, low, radius, exponent = wide_gain(mass_matrix, v, w)
    return high + (low - radius), high + (low + radius), exponent


@kernel
def gain_signs(masses, v, w, signs):
    """Write −1 (no gain), 1 (a gain) or 0 (undecided by the bound) for each of n steps; `masses`:
    n, or one for all."""
    for k in range(len(v)):
        lower, upper, _ = gain_enclosure(masses[k] if len(masses) > 1 else masses[0], v[k], w[k])
        signs[k] = -1 if upper <= 0.0 else (1 if lower > 0.0 else 0)


@kernel
def write_step(v, change, factor, w):
    """Write w = v + factor · change."""
    for k in range(len(v)):
        w[k] = v[k] + factor * change[k]


@kernel
def passive_step(mass_matrix, v, change, alpha, w):
    """Write w with no more energy than v in real arithmetic, and return β ≤ α: w is v + β change up
    to last places.

    If v + α change gains energy by its rounding, single entries of it are moved by last places
    (`_moved`); β = α. If that fails, β decreases in growing steps towards −x/y, x = vᵀM change, y =
    changeᵀM change, where the loss is largest. If no β > 0 is found, w = v and β = 0.
    """
    if _moved(mass_matrix, v, change, alpha, w):
        return alpha
    longest = alpha - least_energy(mass_matrix, v, change)
    step = 2.0**-52 * alpha
    while longest > 0.0:
        step = min(step, longest)
        write_step(v, change, alpha - step, w)
        if gain_enclosure(mass_matrix, v, w)[1] <= 0.0:
            return alpha - step
        if step >= longest:
            break
        step *= _GROWTH
    copy_into(w, v)
    return 0.0


@kernel
def _moved(mass_matrix, v, change, alpha, w):
    """Write v + α change, with single entries moved against their momentum; return whether it gains
    no energy.

    A move takes as many whole last places as lower the energy by the upper bound of its gain, of
    the entry for which this is the shortest way in the kinetic metric, √Mᵢᵢ |δ|: restitution
    changes least. Entries that the impact does not change stay.
    """
    write_step(v, change, alpha, w)
    for _ in range(_MOVES):
        _, upper, exponent = gain_enclosure(mass_matrix, v, w)
        if upper <= 0.0:
            return True
        wanted = ldexp(0.25 * upper, exponent)
        moved = -1
        to = 0.0
        shortest = inf
        for i in range(len(w)):
            slope = 0.0
            mass = mass_matrix[i, i]
            for j in range(len(w)):
                slope += 0.5 * (mass_matrix[i, j] + mass_matrix[j, i]) * w[j]
            place = abs(np.nextafter(w[i], -inf if slope > 0.0 else inf) - w[i])
            square = slope * slope - 2.0 * mass * wanted
            if change[i] == 0.0 or slope == 0.0 or not square >= 0.0:
                continue
            length = place * max(np.ceil(2.0 * wanted / (abs(slope) + sqrt(square)) / place), 1.0)
            if (abs(slope) - 0.5 * mass * length) * length >= wanted and sqrt(
                mass
            ) * length < shortest:
                moved = i
                to = w[i] - copysign(length, slope)
                shortest = sqrt(mass) * length
        if moved < 0:
            return False
        w[moved] = to
    return False

"""Last step of every impact: prevent a gain of kinetic energy in real arithmetic; the enclosure that proves it.

Let s = w + v, Δ = w − v and A = M + Mᵀ, each an exact pair of doubles. Four times the gain of kinetic energy is

    Γ = Δᵀ A s = 2 (wᵀMw − vᵀMv)

for the mass matrix M as given. A skew part of M cancels, and M is not replaced by a rounded symmetric part. (Δᵀ M s,
without the transpose, differs from Γ/2 if M is asymmetric in the last bit.) A candidate w is accepted if an upper bound
of Γ is not positive. Three functions bound Γ, each with a proof of its bound: `plainly_loses` in plain doubles, `gain`
in double-double, `wide_gain` for numbers of any size. u = 2⁻⁵³ and η = 2⁻¹⁰⁷⁴. Operations round to nearest, without
fastmath and without contraction. d ≤ 2¹⁵, so that (1 + u) to the power 8d² + 9 is below θ = 1 + 2⁻¹⁶.
"""

from __future__ import annotations

import math

import numpy as np

from iapb.compiled import copy_into, kernel
from iapb.double_double import add_product, in_range, passive_range, symmetric_entry, two_product, two_sum

UNIT = 2.0**-53
_CLEAR = 2.0**-40  # share of T that makes a loss clear: far above rounding, far below the loss at e < 1
_PLAIN_UNDERFLOW = 2.0**-1000
_UNDERFLOW = 2.0**-1070  # 16 η
_DROPPED = -800  # exponent relative to the largest term below which `wide_gain` omits a term
# Shortening of a step: the first attempt takes off what the upper bound requires, each further one four times as much.
# A reduction beyond the share _GENTLE would affect restitution (the kit requires 1e-8); roundings are changed first.
_GROWTH, _GENTLE, _TURNS = 4.0, 2.0**-27, 3


@kernel
def plainly_loses(mass_matrix, v, w):
    """Return whether plain doubles prove that w has less energy than v, by a margin; this settles half of all impacts.

    G is Γ in plain doubles, T = Σ tᵢ |Aᵢⱼ| tⱼ with tᵢ = |vᵢ| + |wᵢ|; accepted where G + (2⁻⁴⁰ + 4 (d+4) u) T ≤ 0.

    Bound. Δᵢ, sⱼ and Aᵢⱼ are rounded once each. A term passes through two products and at most 2d sums, so G is off by
    at most (2d + 5) u θ T. T has as many roundings, with positive terms only; 4 (d+4) covers them too. Underflow in a
    product is at most η/2. It occurs d² times with a factor |Δᵢ| ≤ 2tᵢ and d times without: in sum below
    d² 2⁻¹⁰⁷² (1 + Σ tᵢ), which `_PLAIN_UNDERFLOW` exceeds by 2⁷⁰. An overflow gives an infinity or NaN, which fails
    the comparison.

    Margin. With w = fl(v + δ) the energy clamp would not change δ: its x = vᵀMδ and y = δᵀMδ, each rounded once, differ
    from x + y/2 = Γ/4 by the rounding of w, |w − v − δ| ≤ u|w|, and by their own: less than 8 u T < 2⁻⁴² T in all.
    """
    d, total, size, sum_t = v.shape[0], 0.0, 0.0, 0.0
    for i in range(d):
        row = row_size = 0.0
        for j in range(d):
            entry = mass_matrix[i, j] + mass_matrix[j, i]
            row += entry * (w[j] + v[j])
            row_size += abs(entry) * (abs(w[j]) + abs(v[j]))
        t = abs(w[i]) + abs(v[i])
        total += (w[i] - v[i]) * row
        size += t * row_size
        sum_t += t
    return total + (_CLEAR + 4.0 * (d + 4) * UNIT) * size + d * d * (1.0 + sum_t) * _PLAIN_UNDERFLOW <= 0.0


@kernel
def gain(mass_matrix, v, w):
    """Evaluate Γ in double-double: return (high, low, radius, underflow) with |Γ − (high + low)| ≤ radius + underflow.

    Proof of the bound, with Rᵢ = Σⱼ |ah sh| and S = Σᵢ |dhᵢ| Rᵢ. The pairs s = sh + sl, Δ = dh + dl, A = ah + al are
    exact (TwoSum), |sl| ≤ u|sh| and so on. In row i, h + l approximates Σⱼ Aᵢⱼ sⱼ; step j adds p + e = ah·sh, exact
    (TwoProduct), and c = fl(fl(ah·sl) + fl(al·sh)); TwoSum(h, p) = h' + t is exact. Errors, in units of u² θ
    Rᵢ over the row: omitted al·sl 1; the two products in c 2; their sum 2; fl(t + e) d + 1, as |t| ≤ u|h'| and |e| ≤
    u|p|; adding c to it d + 3; adding that to l, |l| ≤ u(k + 3) Rᵢ after k steps, d²/2 + 7d/2. Together d²/2 + 11d/2 +
    9. The sum over i goes the same way with the row's (h, l), |l| ≤ u(d + 3) Rᵢ, in place of (sh, sl), in units of u² θ
    S: omitted dl·l d + 3; the products 1 + (d + 3); their sum d + 4; fl(t + e) d + 1; adding c 2d + 5; adding to l,
    now |l| ≤ u(k + d + 5) S, 3d²/2 + 11d/2. Together with the rows 2d² + 17d + 26. `radius` is 2 (d+6)² u² S = (2d² +
    24d + 72) u² S. The excess of 7d + 46 covers θ, the rounding of S and of the radius, and that of low + radius, which
    callers add first: u|low| ≤ (2d + 5) u² S.

    Underflow: the error of TwoProduct is then at most 7η/2 (Boldo 2006), of the other products η/2: in sum at most
    6dη Σ|dhᵢ| + 6dη, with the underflow in S; `underflow` is 16 d η (1 + Σ|dhᵢ|). Overflow, also in Dekker's splitting,
    makes high + (low + radius) NaN or infinite, which fails every comparison.
    """
    d = v.shape[0]
    high = low = size = moved = 0.0
    for i in range(d):
        h = l = row_size = 0.0
        for j in range(d):
            a_hi, a_lo = two_sum(mass_matrix[i, j], mass_matrix[j, i])
            s_hi, s_lo = two_sum(w[j], v[j])
            p, e = two_product(a_hi, s_hi)
            c = a_hi * s_lo + a_lo * s_hi
            h, t = two_sum(h, p)
            l += (t + e) + c
            row_size += abs(p)
        d_hi, d_lo = two_sum(w[i], -v[i])
        p, e = two_product(d_hi, h)
        c = d_hi * l + d_lo * h
        high, t = two_sum(high, p)
        low += (t + e) + c
        size += abs(d_hi) * row_size
        moved += abs(d_hi)
    if moved == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    margin = d + 6.0
    return high, low, 2.0 * margin * margin * UNIT * UNIT * size, d * _UNDERFLOW * (1.0 + moved)


@kernel
def wide_gain(mass_matrix, v, w):
    """Return Γ for numbers of any size: (high, low, radius, exponent) with |Γ/2^exponent − (high + low)| ≤ radius.

    Γ = Σᵢⱼ Mᵢⱼ (Δᵢ sⱼ + sᵢ Δⱼ) has n = 8d² products x M y of doubles, x and y the halves of the pairs Δ and s. Each is
    evaluated on mantissas in [½, 1), so that nothing under- or overflows, and scaled to the largest exponent among them
    by a power of two. Scaling is exact: products are multiples of 2⁻¹⁶⁰, and those below 2⁻⁸⁰⁰ are omitted.

    Proof of the bound: with p + e = x M and q + f = p y exactly, the low part fl(f + fl(e y)) errs by 3u² of the
    product; the sum is the compensated one of `gain`: with S = Σ|q|, (n + 3) u² for fl(t + f) and (n²/2 + 7n/2) u² for
    low. Together this is below (n + 5)² u² S, whose excess covers θ and the rounding of S and of low + radius. The
    omitted terms, at most n 2⁻⁸⁰⁰, are added. If w ± v could overflow, both are divided by 4 first. Bits of the smaller
    one that this loses are below 2⁻²⁰⁰⁰ of the larger one, whose products are in the sum too.
    """
    d, top, count = v.shape[0], -100_000, 0
    high = low = size = 0.0
    for summing in range(2):
        for i in range(d):
            for j in range(d):
                if mass_matrix[i, j] == 0.0:
                    continue
                m, m_exponent = math.frexp(mass_matrix[i, j])
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
                        unit = math.ldexp(1.0, exponent - top)
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
    """Return mantissa and exponent of the high or the low half of w − v or of w + v."""
    scale, shift = (0.25, 2) if max(abs(v), abs(w)) > 2.0**1020 else (1.0, 0)
    high, low = two_sum(scale * w, -scale * v if difference else scale * v)
    mantissa, exponent = math.frexp(low if is_low else high)
    return mantissa, exponent + shift


@kernel
def gain_enclosure(mass_matrix, v, w):
    """Return (lower, upper, exponent): Γ lies in [lower, upper] · 2^exponent, up to one rounding of each end.

    If upper ≤ 0, then Γ ≤ 0 is certain: the last sum rounds once and keeps its sign.
    """
    high, low, radius, underflow = gain(mass_matrix, v, w)
    radius += underflow
    upper = high + (low + radius)
    if math.isfinite(upper) and 3.0 * underflow <= radius or radius == 0.0 or upper <= 0.0:
        return high + (low - radius), upper, 0
    high, low, radius, exponent = wide_gain(mass_matrix, v, w)
    return high + (low - radius), high + (low + radius), exponent


@kernel
def gain_signs(masses, v, w, signs):
    """Write −1 (no gain), 1 (a gain) or 0 (undecided by the bound) for each of n steps; `masses`: n, or one for all."""
    for k in range(v.shape[0]):
        lower, upper, _ = gain_enclosure(masses[k] if masses.shape[0] > 1 else masses[0], v[k], w[k])
        signs[k] = -1 if upper <= 0.0 else (1 if lower > 0.0 else 0)


@kernel
def write_step(v, change, factor, w):
    """Write w = v + factor · change."""
    for k in range(v.shape[0]):
        w[k] = v[k] + factor * change[k]


@kernel
def passive_step(mass_matrix, v, change, alpha, w):
    """Write w = v + β change with no more energy than v in real arithmetic; return β ≤ α. If no β > 0 is found, it
    writes w = v and returns 0.

    β = α if this candidate passes. Otherwise β decreases in growing steps towards −x/y, x = vᵀM change,
    y = changeᵀM change, where the loss is largest. Before a shorter step would affect restitution, the entries of
    v + α change are moved by last-place units that lower the energy. Both cost an energy of the order of one rounding
    of v⁺.
    """
    write_step(v, change, alpha, w)
    if gain_enclosure(mass_matrix, v, w)[1] <= 0.0:
        return alpha
    longest, step, turned = alpha - passive_range(mass_matrix, v, change)[0], 2.0**-52 * alpha, False
    while longest > 0.0:
        if not turned and step > _GENTLE * alpha:
            turned = True
            if _turned(mass_matrix, v, change, alpha, w):
                return alpha
        step = min(step, longest)
        write_step(v, change, alpha - step, w)
        if gain_enclosure(mass_matrix, v, w)[1] <= 0.0:
            return alpha - step
        if step >= longest:
            break
        step *= _GROWTH
    if not turned and _turned(mass_matrix, v, change, alpha, w):
        return alpha
    copy_into(w, v)
    return 0.0


@kernel
def _turned(mass_matrix, v, change, alpha, w):
    """Write v + α change, moved by last-place units against its momentum; return whether it gains no energy."""
    write_step(v, change, alpha, w)
    for _ in range(_TURNS):
        for i in range(w.shape[0]):
            momentum = 0.0
            for j in range(w.shape[0]):
                momentum += (mass_matrix[i, j] + mass_matrix[j, i]) * w[j]
            if change[i] != 0.0 and momentum != 0.0:
                w[i] = np.nextafter(w[i], -math.inf if momentum > 0.0 else math.inf)
        if gain_enclosure(mass_matrix, v, w)[1] <= 0.0:
            return True
    return False


@kernel
def clamped_step(mass_matrix, v, change, w, on_v, on_change, size):
    """Do `passive_step` from the largest α in [0, 1] that gains no energy before w is rounded; sums over d²
    entries are computed once.

    With H = ½ (M + Mᵀ) and ρ = w − v − α change, the rounding of w, a quarter of Γ is

        αx + ½α²y + ρᵀ(Hv + αH change) + ½ρᵀHρ,   x = vᵀH change, y = changeᵀH change.

    x and y are summed in double-double. ρ is exact for each α, and so small that plain doubles suffice for its terms.

    Proof of the bound, with X = Σ|vᵢ||Hᵢⱼ||δⱼ|, Y = Σ|δᵢ||Hᵢⱼ||δⱼ|, Pᵢ = Σ|Hᵢⱼ|(|vⱼ| + |δⱼ|), Q = Σ|ρᵢ|Pᵢ, δ = change,
    α ≤ 1. A step of `add_product` rounds a low product and its sum, 5u²|p|, then lo + r, t + (lo + r) and, where |s| <
    |t|, the last difference, together u²(8R + 9|p|) for partial sums up to R: a row errs by (8d + 14) u² R, x by (16d +
    28) u² X, y by as much of Y. z = x + ½αy, αz and the last additions cost below 40 u² (X + ½αY). `rounding` is (16d +
    96) u² α (X + ½αY), whose excess covers its own roundings and θ. t + e is −ρᵢ up to u. The entry of H, its product
    and d sums, α· and the next sum, the product with ρᵢ and d sums, the last additions make (2d + 11) u θ Q at most,
    ½ρᵀHρ another u θ Q, as |ρⱼ| ≤ 2u(|vⱼ| + |δⱼ|): (4d + 16) u Q holds them. Underflow: with σ = Σ(|vᵢ| + |δᵢ|) the
    products of x and y err by at most 22 d η (1 + σ)², those with Hv, Hδ and in X, Y, Q by less, and ρ by 4η, which
    counts Pᵢ times: `lost` is 2¹⁴ η (d (1 + σ)² + Σ Pᵢ). An overflow accepts no candidate.
    """
    d, sigma, weight = v.shape[0], 1.0, 0.0
    cross_hi = cross_lo = square_hi = square_lo = cross_size = square_size = 0.0
    for i in range(d):
        row_hi = row_lo = sum_v = size_v = size_change = 0.0
        for j in range(d):
            entry, rest = symmetric_entry(mass_matrix, i, j)
            row_hi, row_lo = add_product(row_hi, row_lo, entry, rest, change[j])
            sum_v += entry * v[j]
            size_v += abs(entry * v[j])
            size_change += abs(entry * change[j])
        cross_hi, cross_lo = add_product(cross_hi, cross_lo, row_hi, row_lo, v[i])
        square_hi, square_lo = add_product(square_hi, square_lo, row_hi, row_lo, change[i])
        cross_size += abs(v[i]) * size_change
        square_size += abs(change[i]) * size_change
        on_v[i], on_change[i], size[i] = sum_v, row_hi, size_v + size_change
        sigma += abs(v[i]) + abs(change[i])
        weight += size[i]
    cross, square = cross_hi + cross_lo, square_hi + square_lo
    if not in_range(cross, square):
        return passive_step(mass_matrix, v, change, min(1.0, passive_range(mass_matrix, v, change)[1]), w)
    lost = (d * sigma * sigma + weight) * 2.0**-1060
    alpha, best, step = min(1.0, -2.0 * cross / square), -cross / square, 0.0
    while True:
        factor = alpha - step
        total = spread = 0.0
        for i in range(d):
            q, e = two_product(factor, change[i])
            w[i], t = two_sum(v[i], q)
            total -= (t + e) * (on_v[i] + factor * on_change[i])
            spread += abs(t + e) * size[i]
        p, e = two_product(0.5 * factor, square_hi)
        s, t = two_sum(cross_hi, p)
        t += cross_lo + (e + 0.5 * factor * square_lo)
        p, e = two_product(factor, s)
        rounding = (16.0 * d + 96.0) * UNIT * UNIT * factor * (cross_size + 0.5 * factor * square_size)
        upper = p + ((e + factor * t) + total + (rounding + (4.0 * d + 16.0) * UNIT * spread + lost))
        if upper <= 0.0:
            return factor
        step = max(_GROWTH * step, 2.0**-52 * alpha)
        step = max(step, 2.0 * upper / (square * max(alpha - best, 0.25 * alpha)))
        if not step <= _GENTLE * alpha or alpha - step < best:
            return passive_step(mass_matrix, v, change, alpha, w)

"""Double-double arithmetic for energies: a number is an unevaluated pair hi + lo of about 32
digits.

Sources: Dekker (1971), Knuth (TAOCP 2, 4.2.2), Hida, Li and Bailey (2001). The error bounds hold as
long as no intermediate value leaves the range of doubles; callers scale first
(`iapb.contact.impact`).
"""

from __future__ import annotations

from math import frexp, ldexp

from iapb.numerics.compiled import kernel

_SPLITTER = 134217729.0  # 2^27 + 1: halves a 53-bit significand (Dekker)


@kernel
def two_sum(a, b):
    """Return s and r with a + b = s + r exactly (Knuth)."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@kernel
def two_product(a, b):
    """Return p and r with a b = p + r exactly (Dekker)."""
    p = a * b
    t = _SPLITTER * a
    a_hi = t - (t - a)
    a_lo = a - a_hi
    t = _SPLITTER * b
    b_hi = t - (t - b)
    b_lo = b - b_hi
    return p, ((a_hi * b_hi - p) + a_hi * b_lo + a_lo * b_hi) + a_lo * b_lo


@kernel
def add_product(hi, lo, a_hi, a_lo, b):
    """Return the pair (hi, lo) + (a_hi, a_lo) · b."""
    p, r = two_product(a_hi, b)
    r += a_lo * b
    s, t = two_sum(hi, p)
    t += lo + r
    total = s + t
    return total, t - (total - s)


@kernel
def symmetric_entry(matrix, i, j):
    """Return entry (i, j) of ½ (M + Mᵀ) as an exact pair, which is M[i, j] and 0 if M is
    symmetric."""
    entry = matrix[i, j]
    mirrored = matrix[j, i]
    if entry == mirrored:
        return entry, 0.0
    return two_sum(0.5 * entry, 0.5 * mirrored)


@kernel
def row_times(matrix, i, v, unit=1.0):
    """Return row i of the symmetric part of a matrix times unit · v, as a pair."""
    high = low = 0.0
    for j in range(len(v)):
        entry, rest = symmetric_entry(matrix, i, j)
        high, low = add_product(high, low, entry, rest, unit * v[j])
    return high, low


@kernel
def quadratic_forms(mass_matrix, v, change, v_unit=1.0, change_unit=1.0):
    """Return vᵀ M Δv and Δvᵀ M Δv of the symmetric part of M, each evaluated in double-double and
    rounded once.

    v and Δv are first scaled by their units, which are powers of two.
    """
    d = len(v)
    cross_hi = cross_lo = square_hi = square_lo = 0.0
    for i in range(d):
        row_hi, row_lo = row_times(mass_matrix, i, change, change_unit)
        cross_hi, cross_lo = add_product(cross_hi, cross_lo, row_hi, row_lo, v_unit * v[i])
        square_hi, square_lo = add_product(
            square_hi, square_lo, row_hi, row_lo, change_unit * change[i]
        )
    return cross_hi + cross_lo, square_hi + square_lo


@kernel
def unit_of(vector):
    """Return the power of two, at most 2^±1000, that scales the largest entry into [½, 1) or
    towards it."""
    largest = 0.0
    for entry in vector:
        largest = max(largest, abs(entry))
    return ldexp(1.0, min(1000, max(-1000, -frexp(largest)[1])))


@kernel
def least_energy(mass_matrix, v, change):
    """Return the α at which v + α Δv has the least energy, −vᵀMΔv / ΔvᵀMΔv; 0 if every α > 0 gains
    energy.

    The vectors are scaled first, so that their squares neither under- nor overflow.
    """
    v_unit = unit_of(v)
    change_unit = unit_of(change)
    cross, square = quadratic_forms(mass_matrix, v, change, v_unit, change_unit)
    return -cross / square * (change_unit / v_unit) if square > 0.0 and cross < 0.0 else 0.0


@kernel
def kinetic_energies(mass_matrix, v_minus, v_plus):
    """Return ½ v⁻ᵀ M v⁻ and ½ (v⁺ᵀ M v⁺ − v⁻ᵀ M v⁻), both in double-double, rounded once.

    The difference is formed before rounding, so it is accurate even if the two energies agree in
    all digits.
    """
    before_hi = before_lo = change_hi = change_lo = 0.0
    for i in range(len(v_minus)):
        minus_hi, minus_lo = row_times(mass_matrix, i, v_minus)
        plus_hi, plus_lo = row_times(mass_matrix, i, v_plus)
        before_hi, before_lo = add_product(before_hi, before_lo, minus_hi, minus_lo, v_minus[i])
        change_hi, change_lo = add_product(change_hi, change_lo, plus_hi, plus_lo, v_plus[i])
        change_hi, change_lo = add_product(change_hi, change_lo, -minus_hi, -minus_lo, v_minus[i])
    return 0.5 * (before_hi + before_lo), 0.5 * (change_hi + change_lo)

"""Double-double sums for energies: a number is an unevaluated pair hi + lo of about 32 digits.

Source: Dekker (1971), Knuth (TAOCP 2, 4.2.2), Hida, Li and Bailey (2001). Exact as long as no intermediate
leaves the range of doubles; callers scale first (`iapb.contact.impact`).
"""

from __future__ import annotations

from iapb.compiled import kernel

_SPLITTER = 134217729.0  # 2^27 + 1: halves a 53-bit significand (Dekker)


@kernel
def two_sum(a, b):
    """a + b = s + r exactly (Knuth)."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@kernel
def two_product(a, b):
    """a b = p + r exactly (Dekker)."""
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
    """(hi, lo) + (a_hi, a_lo) · b."""
    p, r = two_product(a_hi, b)
    r += a_lo * b
    s, t = two_sum(hi, p)
    t += lo + r
    total = s + t
    return total, t - (total - s)


@kernel
def quadratic_forms(mass_matrix, v, change):
    """Return vᵀ M Δv and Δvᵀ M Δv, each evaluated in double-double and rounded once."""
    d = v.shape[0]
    cross_hi = cross_lo = square_hi = square_lo = 0.0
    for i in range(d):
        row_hi = row_lo = 0.0
        for j in range(d):
            row_hi, row_lo = add_product(row_hi, row_lo, mass_matrix[i, j], 0.0, change[j])
        cross_hi, cross_lo = add_product(cross_hi, cross_lo, row_hi, row_lo, v[i])
        square_hi, square_lo = add_product(square_hi, square_lo, row_hi, row_lo, change[i])
    return cross_hi + cross_lo, square_hi + square_lo


@kernel
def kinetic_energies(mass_matrix, v_minus, v_plus):
    """Return ½ v⁻ᵀ M v⁻ and ½ (v⁺ᵀ M v⁺ − v⁻ᵀ M v⁻), both in double-double, rounded once.

    The difference is formed before rounding: it is right even where the two energies agree in all digits.
    """
    d = v_minus.shape[0]
    before_hi = before_lo = change_hi = change_lo = 0.0
    for i in range(d):
        minus_hi = minus_lo = plus_hi = plus_lo = 0.0
        for j in range(d):
            minus_hi, minus_lo = add_product(minus_hi, minus_lo, mass_matrix[i, j], 0.0, v_minus[j])
            plus_hi, plus_lo = add_product(plus_hi, plus_lo, mass_matrix[i, j], 0.0, v_plus[j])
        before_hi, before_lo = add_product(before_hi, before_lo, minus_hi, minus_lo, v_minus[i])
        change_hi, change_lo = add_product(change_hi, change_lo, plus_hi, plus_lo, v_plus[i])
        change_hi, change_lo = add_product(change_hi, change_lo, -minus_hi, -minus_lo, v_minus[i])
    return 0.5 * (before_hi + before_lo), 0.5 * (change_hi + change_lo)

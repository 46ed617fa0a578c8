"""Relative energy gain of many impacts, in double-double arithmetic with a running error bound.

2 (KE⁺ − KE⁻) = (v⁺ − v⁻)ᵀ M (v⁺ + v⁻): the difference and the sum are exact double-doubles, so nothing cancels
before it is known to 106 bits. The bound says how sure the result is; `reference.exact` is the exact judge.
Source: Dekker, Numerische Mathematik 18 (1971); Ogita, Rump, Oishi, SIAM J. Sci. Comput. 26 (2005).
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.errors import ArgumentError

Floats = NDArray[np.float64]

_SPLITTER = 134217729.0  # 2^27 + 1: splits a double into two halves whose products are exact
_ROUNDING = 2.0**-100  # error of one double-double operation is below 2^-102; with room
# Beyond these magnitudes the halves or the error terms leave the range of doubles; the caller goes exact then.
_SMALLEST, _LARGEST = 1e-60, 1e60


def bulk_energy_gain(mass_matrix: ArrayLike, v_minus: ArrayLike, v_plus: ArrayLike) -> tuple[Floats, Floats]:
    """Return (gain, bound), each (n,): (KE⁺ − KE⁻)/KE⁻ per impact and a bound of its error.

    Shapes: M (n, d, d) or (d, d), v⁻ and v⁺ (n, d). NaN, with bound infinity, where KE⁻ is not positive.
    """
    before = np.atleast_2d(np.asarray(v_minus, dtype=np.float64))
    after = np.atleast_2d(np.asarray(v_plus, dtype=np.float64))
    masses = np.asarray(mass_matrix, dtype=np.float64)
    n, d = before.shape
    if after.shape != before.shape:
        raise ArgumentError("v_plus", after.shape, f"shape {before.shape}, as v_minus")
    if masses.shape not in ((d, d), (n, d, d)):
        raise ArgumentError("mass_matrix", masses.shape, f"shape ({d}, {d}) or ({n}, {d}, {d})")
    _check_magnitudes(masses, before, after)
    gain, bound = np.empty(n), np.empty(n)
    _gains(np.ascontiguousarray(np.broadcast_to(masses, (n, d, d))), before, after, gain, bound)
    return gain, bound


def _check_magnitudes(masses: Floats, before: Floats, after: Floats) -> None:
    for argument, array in (("mass_matrix", masses), ("v_minus", before), ("v_plus", after)):
        size = np.abs(array[array != 0.0])
        if not np.isfinite(array).all() or (size.size and (size.max() > _LARGEST or size.min() < _SMALLEST)):
            expected = f"magnitudes in [{_SMALLEST:g}, {_LARGEST:g}] or 0; use reference.exact beyond"
            raise ArgumentError(argument, array, expected)


@numba.njit(cache=True, fastmath=False)
def _two_sum(a, b):  # type: ignore[no-untyped-def]
    """a + b as an exact pair (sum, error)."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@numba.njit(cache=True, fastmath=False)
def _two_product(a, b):  # type: ignore[no-untyped-def]
    """a b as an exact pair (product, error)."""
    p = a * b
    c = _SPLITTER * a
    a1 = c - (c - a)
    a2 = a - a1
    c = _SPLITTER * b
    b1 = c - (c - b)
    b2 = b - b1
    return p, a2 * b2 - (((p - a1 * b1) - a2 * b1) - a1 * b2)


@numba.njit(cache=True, fastmath=False)
def _add(ah, al, bh, bl):  # type: ignore[no-untyped-def]
    """Double-double sum, the accurate variant (both low parts kept)."""
    sh, sl = _two_sum(ah, bh)
    th, tl = _two_sum(al, bl)
    sh, sl = _two_sum(sh, sl + th)
    return _two_sum(sh, sl + tl)


@numba.njit(cache=True, fastmath=False)
def _multiply(ah, al, bh, bl):  # type: ignore[no-untyped-def]
    """Double-double product."""
    ph, pl = _two_product(ah, bh)
    return _two_sum(ph, pl + (ah * bl + al * bh))


@numba.njit(cache=True, fastmath=False)
def _bilinear(mass, ah, al, bh, bl):  # type: ignore[no-untyped-def]
    """Return aᵀ M b as a double-double, and the sum of |a_i M_ij b_j|, for double-double vectors a and b."""
    high, low, size = 0.0, 0.0, 0.0
    for i in range(len(ah)):
        rh, rl = 0.0, 0.0
        for j in range(len(bh)):
            th, tl = _multiply(bh[j], bl[j], mass[i, j], 0.0)
            rh, rl = _add(rh, rl, th, tl)
            size += abs(ah[i] * th)
        th, tl = _multiply(ah[i], al[i], rh, rl)
        high, low = _add(high, low, th, tl)
    return high, low, size


@numba.njit(cache=True, fastmath=False)
def _gains(masses, before, after, gain, bound):  # type: ignore[no-untyped-def]
    """Write the relative gain and its bound for each impact."""
    n, d = before.shape
    difference, difference_low = np.empty(d), np.empty(d)
    total, total_low, zero = np.empty(d), np.empty(d), np.zeros(d)
    for k in range(n):
        for i in range(d):
            difference[i], difference_low[i] = _two_sum(after[k, i], -before[k, i])
            total[i], total_low[i] = _two_sum(after[k, i], before[k, i])
        change, _, size = _bilinear(masses[k], difference, difference_low, total, total_low)
        energy, _, energy_size = _bilinear(masses[k], before[k], zero, before[k], zero)
        if not energy > d * d * _ROUNDING * energy_size:
            gain[k], bound[k] = np.nan, np.inf
            continue
        gain[k] = change / energy
        rounding = 4.0 * abs(gain[k]) * 2.0**-53  # the final division and the dropped low parts
        bound[k] = 2.0 * d * _ROUNDING * (size + abs(gain[k]) * energy_size) / energy + rounding

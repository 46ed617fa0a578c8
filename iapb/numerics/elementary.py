"""Elementary functions that return the same bits on every processor, without libm and numpy's
vectorised loops.

The C library uses different code for sin, cos and atan2 on processors with FMA, and numpy uses its
own for AVX-512, so their last bits differ. The functions here use only +, −, ×, ÷ and √, whose
rounding IEEE 754 fixes. They compute about 70 bits and round once, so nearly every result is
correctly rounded.
"""

from __future__ import annotations

import math

from iapb.numerics.compiled import kernel
from iapb.numerics.double_double import add_product, two_product, two_sum

# π/2 as an unevaluated sum, and 1/n! as pairs
_QUARTER = (1.5707963267948966, 6.123233995736766e-17, -1.4973849048591698e-33)
_THIRD = (0.16666666666666666, 9.25185853854297e-18)
_FOURTH = (0.041666666666666664, 2.3129646346357427e-18)
_FIFTH = (0.008333333333333333, 1.1564823173178714e-19)
_SIXTH = (0.001388888888888889, -5.300543954373577e-20)
_SEVENTH = (0.0001984126984126984, 1.7209558293420705e-22)

# beyond this, doubles are 1e-7 rad apart, and the angle is first reduced by the rounded 2π
_LARGEST_ANGLE = 2.0**30
_TAN_22_5_DEGREES_TERMS = 10  # of the arc tangent's series below tan(22.5°): 4e-10


@kernel
def _multiply_add(c_hi, c_lo, a_hi, a_lo, b_hi, b_lo):
    """Return c + a b for three pairs."""
    hi, lo = add_product(c_hi, c_lo, a_hi, a_lo, b_hi)
    return hi, lo + a_hi * b_lo


@kernel
def _near_zero(h, l):
    """Return sine and cosine, as pairs, of an angle h + l of at most about 45 degrees."""
    z, w = two_product(h, h)
    w += 2.0 * h * l
    tail = 1.0 / 355687428096000.0 - z * (1.0 / 121645100408832000.0)  # 1/17! − z/19!
    tail = 1.0 / 362880.0 - z * (
        1.0 / 39916800.0 - z * (1.0 / 6227020800.0 - z * (1.0 / 1307674368000.0 - z * tail))
    )
    s, t = add_product(-_SEVENTH[0], -_SEVENTH[1], z, w, tail)
    s, t = _multiply_add(_FIFTH[0], _FIFTH[1], z, w, s, t)
    s, t = _multiply_add(-_THIRD[0], -_THIRD[1], z, w, s, t)
    s, t = _multiply_add(0.0, 0.0, z, w, s, t)
    s, t = _multiply_add(h, l, s, t, h, l)
    tail = 1.0 / 20922789888000.0 - z * (1.0 / 6402373705728000.0)  # 1/16! − z/18!
    tail = 1.0 / 40320.0 - z * (
        1.0 / 3628800.0 - z * (1.0 / 479001600.0 - z * (1.0 / 87178291200.0 - z * tail))
    )
    c, d = add_product(-_SIXTH[0], -_SIXTH[1], z, w, tail)
    c, d = _multiply_add(_FOURTH[0], _FOURTH[1], z, w, c, d)
    c, d = _multiply_add(-0.5, 0.0, z, w, c, d)
    c, d = _multiply_add(1.0, 0.0, z, w, c, d)
    return s, t, c, d


@kernel
def _sine_cosine_pairs(angle):
    """Return sine and cosine of an angle [rad] as pairs hi + lo."""
    if not abs(angle) <= _LARGEST_ANGLE:
        # the rounded 2π changes the angle by less than its own rounding error
        angle = math.copysign(abs(angle) % (4.0 * _QUARTER[0]), angle)
    turns = math.floor(angle / _QUARTER[0] + 0.5) if abs(angle) > 0.5 * _QUARTER[0] else 0
    h = angle
    l = 0.0
    if turns != 0:
        for part in _QUARTER:
            h, l = add_product(h, l, part, 0.0, -float(turns))
    s, t, c, d = _near_zero(h, l)
    if turns & 1:
        s, t, c, d = c, d, -s, -t
    if turns & 2:
        s = -s
        t = -t
        c = -c
        d = -d
    return s, t, c, d


@kernel
def sine_cosine(angle):
    """Return (sin, cos) of an angle [rad]; NaN for an angle that is not finite."""
    if not math.isfinite(angle):
        return math.nan, math.nan
    s, t, c, d = _sine_cosine_pairs(angle)
    return s + t, c + d


@kernel
def _power_of_two(largest):
    """Return a power of two that scales a number so that its square neither over- nor
    underflows."""
    return 2.0**600 if largest < 2.0**-400 else (2.0**-600 if largest > 2.0**400 else 1.0)


@kernel
def arc_tangent(y, x):
    """Return the angle [rad] in [−π, π] of the point (x, y), as math.atan2 does; the angle of (0,
    0) is 0.

    A series gives nine digits. One step of Newton's method on y cos a − x sin a gives the others.
    """
    across = abs(y)
    along = abs(x)
    if across < 2.0**-30 * along and x > 0.0:
        return y / x  # the cubic term is below the rounding error
    if not (across > 0.0 or along > 0.0):
        return 0.0 * y
    # tangent of half the angle from the nearer axis, at most tan 22.5°
    small = min(across, along) / max(across, along)
    large = 1.0
    small = small / (1.0 + math.sqrt(1.0 + small * small))
    square = small * small
    series = 0.0
    for n in range(_TAN_22_5_DEGREES_TERMS, -1, -1):
        series = large / (2.0 * n + 1.0) - square * series
    first = 2.0 * small * series
    if across > along:
        first = _QUARTER[0] - first
    if x < 0.0:
        first = 2.0 * _QUARTER[0] - first
    first = math.copysign(first, y)
    s, t, c, d = _sine_cosine_pairs(first)
    scale = _power_of_two(max(across, along))
    rise = scale * y
    run = scale * x
    off, rest = add_product(0.0, 0.0, c, d, rise)
    off, rest = add_product(off, rest, s, t, -run)
    return first + (off + rest) / (run * c + rise * s)


@kernel
def hypotenuse(x, y):
    """Return √(x² + y²), as math.hypot does, without intermediate overflow or underflow."""
    largest = max(abs(x), abs(y))
    if not (largest > 0.0 and math.isfinite(largest)):
        return largest + abs(x) + abs(y)
    scale = _power_of_two(largest)
    x = scale * x
    y = scale * y
    square, rest = two_product(x, x)
    square, rest = add_product(square, rest, y, 0.0, y)
    root = math.sqrt(square)
    p, r = two_product(root, root)
    s, t = two_sum(square, -p)
    return (root + (s + (t + (rest - r))) / (2.0 * root)) / scale

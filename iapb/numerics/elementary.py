"""Elementary functions that return the same bits on every processor, without libm and numpy's
vectorised loops.

The C library uses different code for sin, cos and atan2 on processors with FMA, and numpy uses its
own for AVX-512, so their last bits differ. The functions here use only +, −, ×, ÷ and √, whose
rounding IEEE 754 fixes. They compute about 70 bits and round once, so nearly every result is
correctly rounded.
"""

from __future__ import annotations

from math import copysign, floor, isfinite, nan, sqrt

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
def _tails(z):
    """Return 1/9! − z/11! + … of the sine and 1/8! − z/10! + … of the cosine, z the square of the
    angle."""
    sine = 1.0 / 355687428096000.0 - z * (1.0 / 121645100408832000.0)  # 1/17! − z/19!
    sine = 1.0 / 362880.0 - z * (
        1.0 / 39916800.0 - z * (1.0 / 6227020800.0 - z * (1.0 / 1307674368000.0 - z * sine))
    )
    cosine = 1.0 / 20922789888000.0 - z * (1.0 / 6402373705728000.0)  # 1/16! − z/18!
    cosine = 1.0 / 40320.0 - z * (
        1.0 / 3628800.0 - z * (1.0 / 479001600.0 - z * (1.0 / 87178291200.0 - z * cosine))
    )
    return sine, cosine


@kernel
def _near_zero(h, l):
    """Return sine and cosine, as pairs, of an angle h + l of at most about 45 degrees."""
    z, w = two_product(h, h)
    w += 2.0 * h * l
    sine_tail, cosine_tail = _tails(z)
    s, t = add_product(-_SEVENTH[0], -_SEVENTH[1], z, w, sine_tail)
    s, t = _multiply_add(_FIFTH[0], _FIFTH[1], z, w, s, t)
    s, t = _multiply_add(-_THIRD[0], -_THIRD[1], z, w, s, t)
    s, t = _multiply_add(0.0, 0.0, z, w, s, t)
    s, t = _multiply_add(h, l, s, t, h, l)
    c, d = add_product(-_SIXTH[0], -_SIXTH[1], z, w, cosine_tail)
    c, d = _multiply_add(_FOURTH[0], _FOURTH[1], z, w, c, d)
    c, d = _multiply_add(-0.5, 0.0, z, w, c, d)
    c, d = _multiply_add(1.0, 0.0, z, w, c, d)
    return s, t, c, d


@kernel
def _reduced(angle):
    """Return an angle [rad] less a whole number of quarter turns, as a pair hi + lo, and that
    number."""
    if not abs(angle) <= _LARGEST_ANGLE:
        # the rounded 2π changes the angle by less than its own rounding error
        angle = copysign(abs(angle) % (4.0 * _QUARTER[0]), angle)
    turns = floor(angle / _QUARTER[0] + 0.5) if abs(angle) > 0.5 * _QUARTER[0] else 0
    h = angle
    l = 0.0
    if turns != 0:
        for part in _QUARTER:
            h, l = add_product(h, l, part, 0.0, -float(turns))
    return h, l, turns


@kernel
def _sine_cosine_pairs(angle):
    """Return sine and cosine of an angle [rad] as pairs hi + lo."""
    h, l, turns = _reduced(angle)
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
def _quickly(h, l):
    """Return sine and cosine of an angle h + l of at most about 45 degrees, rounded, and whether the
    error cannot have changed the rounding.

    Sine h (1 + z (−1/6 + z/120 − …)) and cosine 1 + z (−1/2 + z/24 − …), z = h², have terms of
    at most 0.005 and 0.001 that are not pairs: errors below 2^-59 z and 2^-61 z².
    """
    z, w = two_product(h, h)
    w += 2.0 * h * l
    sine_tail, cosine_tail = _tails(z)
    a, b = two_sum(-_THIRD[0], z * (_FIFTH[0] - z * (_SEVENTH[0] - z * sine_tail)))
    p, r = two_product(z, a)
    r += w * a + z * (b - _THIRD[1])
    m, e = two_product(h, p)
    s, t = two_sum(h, m)
    t += e + h * r + l * (1.0 + p)
    a, b = two_sum(_FOURTH[0], -z * (_SIXTH[0] - z * cosine_tail))
    p, r = two_product(z, a)
    r += w * a + z * (b + _FOURTH[1])
    a, b = two_sum(-0.5, p)
    p, e = two_product(z, a)
    e += w * a + z * (b + r)
    c, d = two_sum(1.0, p)
    d += e
    sine_error = 2.0**-57 * z * abs(s)
    cosine_error = 2.0**-59 * z * z
    sine = s + (t + sine_error)
    cosine = c + (d + cosine_error)
    sure = sine == s + (t - sine_error) and cosine == c + (d - cosine_error)
    return sine, cosine, sure


@kernel
def sine_cosine(angle):
    """Return (sin, cos) of an angle [rad]; NaN for an angle that is not finite."""
    if not isfinite(angle):
        return nan, nan
    h, l, turns = _reduced(angle)
    s, c, sure = _quickly(h, l)
    if not sure:
        s, t, c, d = _near_zero(h, l)
        s += t
        c += d
    if turns & 1:
        s, c = c, -s
    return (-s, -c) if turns & 2 else (s, c)


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
    small = small / (1.0 + sqrt(1.0 + small * small))
    square = small * small
    series = 0.0
    for n in range(_TAN_22_5_DEGREES_TERMS, -1, -1):
        series = large / (2.0 * n + 1.0) - square * series
    first = 2.0 * small * series
    if across > along:
        first = _QUARTER[0] - first
    if x < 0.0:
        first = 2.0 * _QUARTER[0] - first
    first = copysign(first, y)
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
    if not (largest > 0.0 and isfinite(largest)):
        return largest + abs(x) + abs(y)
    scale = _power_of_two(largest)
    x = scale * x
    y = scale * y
    square, rest = two_product(x, x)
    square, rest = add_product(square, rest, y, 0.0, y)
    root = sqrt(square)
    p, r = two_product(root, root)
    s, t = two_sum(square, -p)
    return (root + (s + (t + (rest - r))) / (2.0 * root)) / scale

"""Elementary functions against 100-digit arithmetic: the correctly rounded result, at all sizes."""

from __future__ import annotations

import math
from collections.abc import Callable

import mpmath
import numpy as np
import pytest

from iapb.elementary import arc_tangent, cosine, hypotenuse, sine, sine_cosine

NUMBERS = np.random.default_rng(8)
ANGLES = np.concatenate([
    NUMBERS.uniform(-4.0, 4.0, 2000), NUMBERS.uniform(-1e6, 1e6, 500), NUMBERS.uniform(-1.0, 1.0, 200) * 2.0**30,
    10.0 ** NUMBERS.uniform(-300.0, 0.0, 200), np.arange(-60, 61) * (math.pi / 4), [5e-324, 0.0, 1e-8],
])
POINTS = np.concatenate([
    NUMBERS.normal(size=(2000, 2)), NUMBERS.normal(size=(400, 2)) * 10.0 ** NUMBERS.uniform(-20.0, 20.0, (400, 2)),
    NUMBERS.normal(size=(50, 2)) * 1e-320, NUMBERS.normal(size=(50, 2)) * 1e300,
    [[0.0, -1.0], [1.0, 0.0], [-1.0, 0.0], [1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [0.0, 1.0]],
])


def _rounded(function: Callable[..., object], *values: float) -> float:
    with mpmath.workdps(100):
        return float(function(*(mpmath.mpf(float(value)) for value in values)))


@pytest.mark.parametrize(("own", "exact"), [(sine, mpmath.sin), (cosine, mpmath.cos)])
def test_sine_and_cosine_are_rounded_correctly(own: Callable[[float], float], exact: Callable[..., object]) -> None:
    assert [own(x) for x in ANGLES] == [_rounded(exact, x) for x in ANGLES]


def test_arc_tangent_is_rounded_correctly() -> None:
    assert [arc_tangent(y, x) for y, x in POINTS] == [_rounded(mpmath.atan2, y, x) for y, x in POINTS]


def test_hypotenuse_is_rounded_correctly() -> None:
    assert [hypotenuse(x, y) for x, y in POINTS] == [_rounded(mpmath.hypot, x, y) for x, y in POINTS]


def test_signs_of_zero_are_those_of_the_c_library() -> None:
    for y, x in ((0.0, -1.0), (-0.0, -1.0), (-0.0, 1.0), (0.0, 0.0), (-0.0, 0.0)):
        assert math.copysign(1.0, arc_tangent(y, x)) == math.copysign(1.0, math.atan2(y, x))
        assert arc_tangent(y, x) == math.atan2(y, x)


def test_an_angle_beyond_all_turns_is_one_within_its_rounding() -> None:
    for angle in (1e12, -3e15, 1e300):
        reduced = math.fmod(angle, 2.0 * math.pi)
        assert sine_cosine(angle) == (sine(reduced), cosine(reduced))


def test_what_is_not_finite_stays_so() -> None:
    assert all(math.isnan(value) for x in (math.inf, -math.inf, math.nan) for value in sine_cosine(x))
    assert hypotenuse(-math.inf, 1.0) == math.inf
    assert math.isnan(hypotenuse(math.nan, 1.0))

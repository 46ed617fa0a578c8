"""Arithmetic without libm and BLAS against exact numbers: functions, double-double sums, small
matrices."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.numerics.double_double import (
    add_product,
    two_product,
    two_sum,
)
from iapb.numerics.elementary import arc_tangent, hypotenuse, sine_cosine

NUMBERS = np.random.default_rng(8)
ANGLES = np.concatenate(
    [
        NUMBERS.uniform(-4.0, 4.0, 2000),
        NUMBERS.uniform(-1e6, 1e6, 500),
        NUMBERS.uniform(-1.0, 1.0, 200) * 2.0**30,
        10.0 ** NUMBERS.uniform(-300.0, 0.0, 200),
        np.arange(-60, 61) * (math.pi / 4),
        [5e-324, 0.0, 1e-8],
    ]
)
POINTS = np.concatenate(
    [
        NUMBERS.normal(size=(2000, 2)),
        NUMBERS.normal(size=(400, 2)) * 10.0 ** NUMBERS.uniform(-20.0, 20.0, (400, 2)),
        NUMBERS.normal(size=(50, 2)) * 1e-320,
        NUMBERS.normal(size=(50, 2)) * 1e300,
        [
            [0.0, -1.0],
            [1.0, 0.0],
            [-1.0, 0.0],
            [1.0, 1.0],
            [-1.0, 1.0],
            [1.0, -1.0],
            [-1.0, -1.0],
            [0.0, 1.0],
        ],
    ]
)


def _rounded(function: Callable[..., object], *values: float) -> float:
    with mpmath.workdps(100):
        return float(function(*(mpmath.mpf(float(value)) for value in values)))


@pytest.mark.parametrize(
    ("own", "exact", "inputs"),
    [
        (lambda x: sine_cosine(x)[0], mpmath.sin, ANGLES[:, None]),
        (lambda x: sine_cosine(x)[1], mpmath.cos, ANGLES[:, None]),
        (arc_tangent, mpmath.atan2, POINTS),
        (hypotenuse, mpmath.hypot, POINTS),
    ],
)
def test_functions_are_rounded_correctly(
    own: Any, exact: Callable[..., object], inputs: np.ndarray
) -> None:
    assert [own(*given) for given in inputs] == [_rounded(exact, *given) for given in inputs]


def test_signs_of_zero_are_those_of_the_c_library() -> None:
    for y, x in ((0.0, -1.0), (-0.0, -1.0), (-0.0, 1.0), (0.0, 0.0), (-0.0, 0.0)):
        assert math.copysign(1.0, arc_tangent(y, x)) == math.copysign(1.0, math.atan2(y, x))
        assert arc_tangent(y, x) == math.atan2(y, x)


def test_angles_beyond_all_turns_and_what_is_not_finite() -> None:
    for angle in (1e12, -3e15, 1e300):
        assert sine_cosine(angle) == sine_cosine(math.fmod(angle, 2.0 * math.pi))
    assert all(
        math.isnan(value) for x in (math.inf, -math.inf, math.nan) for value in sine_cosine(x)
    )
    assert hypotenuse(-math.inf, 1.0) == math.inf and math.isnan(hypotenuse(math.nan, 1.0))


DOUBLES = st.floats(-1e100, 1e100, allow_nan=False).filter(lambda x: x == 0.0 or abs(x) > 1e-100)


@given(DOUBLES, DOUBLES)
def test_sum_and_product_are_exact(a: float, b: float) -> None:
    assert sum(map(Fraction, two_sum(a, b))) == Fraction(a) + Fraction(b)
    assert sum(map(Fraction, two_product(a, b))) == Fraction(a) * Fraction(b)


@given(DOUBLES, DOUBLES, DOUBLES)
def test_accumulation_keeps_a_hundred_bits(a: float, b: float, c: float) -> None:
    high, low = add_product(a, 0.0, b, 0.0, c)
    exact = Fraction(a) + Fraction(b) * Fraction(c)
    size = abs(Fraction(a)) + abs(Fraction(b) * Fraction(c))
    assert abs(Fraction(high) + Fraction(low) - exact) <= size * Fraction(1, 2**100)

"""Double-double sums against exact fractions."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from iapb.double_double import (
    add_product,
    kinetic_energies,
    quadratic_forms,
    two_product,
    two_sum,
)

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


def exact_form(mass: np.ndarray, x: np.ndarray, y: np.ndarray) -> Fraction:
    d = len(x)
    return sum(Fraction(x[i]) * Fraction(mass[i, j]) * Fraction(y[j]) for i in range(d) for j in range(d))


def graded(seed: int, d: int = 6) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """κ(M) = 1e14 and two velocities that differ in the last digits: what cancels in plain doubles."""
    rng = np.random.default_rng(seed)
    basis = np.linalg.qr(rng.normal(size=(d, d)))[0]
    mass = basis * np.logspace(0, -14, d) @ basis.T
    v = basis[:, -1] + 1e-9 * rng.normal(size=d)
    return 0.5 * (mass + mass.T), v, v * (1.0 + 1e-13 * rng.normal(size=d))


@given(st.integers(0, 10_000))
def test_energies_are_right_to_the_last_digits(seed: int) -> None:
    mass, before, after = graded(seed)
    energy, change = kinetic_energies(mass, before, after)
    exact_energy = exact_form(mass, before, before) / 2
    exact_change = exact_form(mass, after, after) / 2 - exact_energy
    assert abs(Fraction(energy) - exact_energy) <= exact_energy * Fraction(1, 2**51)
    # What remains is 2^-100 of the terms that cancelled, here up to 1e14 times the energy.
    assert abs(Fraction(change) - exact_change) <= abs(exact_change) / 2**51 + Fraction(1, 2**90)


@given(st.integers(0, 10_000))
def test_quadratic_forms_against_fractions(seed: int) -> None:
    mass, v, other = graded(seed)
    change = other - v
    cross, square = quadratic_forms(mass, v, change)
    for value, exact in ((cross, exact_form(mass, v, change)), (square, exact_form(mass, change, change))):
        assert abs(Fraction(value) - exact) <= abs(exact) / 2**50 + Fraction(1, 2**95)


def test_plain_doubles_would_not_do() -> None:
    """The wrong twin: the same change of energy in doubles has no right digit."""
    mass, before, after = graded(1)
    exact = exact_form(mass, after, after) - exact_form(mass, before, before)
    plain = after @ mass @ after - before @ mass @ before
    assert abs(Fraction(float(plain)) - exact) > abs(exact) / 10

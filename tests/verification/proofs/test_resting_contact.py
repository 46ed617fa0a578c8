"""Implicit resting contact: the energies that its page compares are those of one mass on its spring, by hand."""

from fractions import Fraction

from verification.proofs.numbers import spring_energy_after


def test_the_explicit_force_creates_energy_where_the_implicit_one_does_not() -> None:
    assert spring_energy_after(implicit=True) == Fraction(4, 9) and spring_energy_after(implicit=False) == 32

"""The family against the printed formula is exact."""

from fractions import Fraction

import numpy as np

from verification.proofs.numbers import energy_factor, energy_factor_above_cutoff


def test_the_family_against_the_printed_formula_is_what_doubles_compute() -> None:
    """The exact factors are those of numpy's own rounding of J Jᵀ."""
    a, t = 1.0 - 2.0**-40, 2.0**-28
    w = np.array([[1.0, a], [a, a * a + t * t]])
    assert w[1, 1] == 1.0 - 2.0**-39
    assert energy_factor(40) == (1 + Fraction(2) ** 25) ** 2
    assert energy_factor_above_cutoff(19) > 1

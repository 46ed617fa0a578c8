"""Every statement is proved, its twins are refuted, and its printed form lists all of it."""

from fractions import Fraction

import numpy as np
import pytest

from verification.proofs import all_proofs, check
from verification.proofs.numbers import (
    energy_factor,
    energy_factor_above_cutoff,
    spring_energy_after,
)


@pytest.mark.parametrize("name", all_proofs())
def test_statement_is_proved_and_printed(name: str) -> None:
    record = check(name)
    assert record.problems == () and record.holds and record.sympy == "yes"
    assert record.twins, "a statement without a wrong twin shows nothing"
    assert all(refutation.refuted for refutation in (*record.twins, *record.needed))
    text = record.as_text()
    assert "\\" not in text, "LaTeX that a terminal cannot show"
    for line in (*record.hypotheses, *(row for step in record.steps for row in step.certificate)):
        assert line.words in text and line.text in text


def test_numbers_on_the_pages_of_proofs_are_those_of_doubles_and_of_one_mass_on_its_spring() -> (
    None
):
    """The exact factors are those of numpy's own rounding of J Jᵀ; the explicit force creates
    energy."""
    a = 1.0 - 2.0**-40
    t = 2.0**-28
    w = np.array([[1.0, a], [a, a * a + t * t]])
    assert w[1, 1] == 1.0 - 2.0**-39
    assert energy_factor(40) == (1 + Fraction(2) ** 25) ** 2 and energy_factor_above_cutoff(19) > 1
    assert (
        spring_energy_after(implicit=True) == Fraction(4, 9)
        and spring_energy_after(implicit=False) == 32
    )

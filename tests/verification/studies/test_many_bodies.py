"""The cost of a step grows about linearly with the number of free bodies."""

from __future__ import annotations

from verification.studies.many_bodies import StepCost, growth_exponent, study_many_bodies

# All pairs give 2 in the limit; linear work with growing caches and the rare impacts stays clearly below.
STEEPEST = 1.5


def test_step_cost_grows_about_linearly() -> None:
    assert growth_exponent(study_many_bodies((20, 50, 100, 200))) < STEEPEST


def test_exponent_is_the_slope() -> None:
    assert abs(growth_exponent([StepCost(n, 3e-6 * n**2, 0.0, 0) for n in (20, 40, 80)]) - 2.0) < 1e-12

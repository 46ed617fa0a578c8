"""The work of a step grows about linearly with the number of free bodies: counted, not timed."""

from __future__ import annotations

from verification.cost.many_bodies import StepCost, growth_exponent, study_many_bodies

# All pairs give 2 in the limit; the density of the field, and with it the neighbours of a disc, changes a little.
STEEPEST = 1.2


def test_pairs_tested_grow_linearly_where_all_pairs_grow_quadratically() -> None:
    costs = study_many_bodies((20, 50, 100, 200))
    assert growth_exponent(costs, "tested") < STEEPEST
    assert growth_exponent(costs, "pairs") > 1.9


def test_exponent_is_the_slope() -> None:
    assert abs(growth_exponent([StepCost(n, 3e-6 * n**2, 0.0, 0, n, n) for n in (20, 40, 80)]) - 2.0) < 1e-12

"""The work of a step grows about linearly with the number of free bodies: counted, not timed."""

from __future__ import annotations

from verification.cost.growth import power_law
from verification.cost.many_bodies import study_many_bodies

# All pairs give 2 in the limit; the density of the field, and with it the neighbours of a disc, changes a little.
STEEPEST = 1.2


def test_pairs_tested_grow_linearly_where_all_pairs_grow_quadratically() -> None:
    costs = study_many_bodies((20, 50, 100, 200))
    assert power_law(costs.column("bodies"), costs.column("pairs tested")) < STEEPEST
    assert power_law(costs.column("bodies"), costs.column("pairs of shapes")) > 1.9

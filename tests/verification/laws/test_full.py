"""The long verification: the laws of an impact share its one call; the dearer ones see their fair
part of all."""

from __future__ import annotations

import numpy as np
import pytest

from iapb import resolve_impact
from verification.impacts import Floats
from verification.laws import full as study
from verification.laws.bounds import FACTORED
from verification.laws.equality import LAWS, UNEQUAL_LAWS
from verification.laws.planted import wrong_sign


@pytest.mark.parametrize(("part", "laws"), [(study.IMPACTS, LAWS), (study.UNEQUAL, UNEQUAL_LAWS)])
def test_every_law_has_its_part_of_the_impacts(part: str, laws: dict[str, object]) -> None:
    cases = 5000
    tried = [frozenset(study.tried_laws(part, index)) for index in range(cases)]
    for name in laws:
        count = sum(name in one for one in tried)
        if name.removeprefix("unequal_") in study.OF_ONE_CALL:
            assert count == cases
        else:  # five standard deviations of a fair draw
            assert abs(count - cases / study.ONE_IN) < 5.0 * np.sqrt(cases / study.ONE_IN)


@pytest.mark.parametrize("index", [41452, 57210])
def test_a_grazing_cradle_may_lose_an_impulse_below_rounding_in_another_frame(index: int) -> None:
    """Found by the long run: the clamp cuts an impulse of 1e-8 |u| that moves less energy than
    rounding does."""
    engine = study.subject_of(resolve_impact)
    case = study.drawn(study.UNEQUAL, index, engine)
    law = UNEQUAL_LAWS["unequal_momentum"].check
    residual = law(case, resolve_impact, FACTORED)
    assert (
        residual is not None
        and residual.passed
        and 2.0 * np.sqrt(FACTORED.energy_gain(case)) < 1e-5
    )

    def per_body(M: Floats, J: Floats, v: Floats, e: Floats) -> object:
        return resolve_impact(
            M, np.vstack([np.maximum(J, 0.0), np.minimum(J, 0.0)]), v, np.concatenate([e, e])
        )

    broken = law(case, per_body, FACTORED)
    assert broken is not None and not broken.passed


def test_the_sum_over_batches_does_not_depend_on_how_the_cases_are_cut() -> None:
    subject = study.subject_of(wrong_sign)
    cut = [study.judge_batch(study.Batch(study.IMPACTS, first, 10), subject) for first in (0, 10)]
    whole = study.judge_batch(study.Batch(study.IMPACTS, 0, 20), subject)
    (counts, found) = study.summed(cut)
    (expected, first) = study.summed([whole])
    assert counts == expected and counts[study.IMPACTS]["kinetic_energy"].failures > 0
    assert [(one.law, one.index) for one in sorted(found, key=lambda one: one.law)] == [
        (one.law, one.index) for one in sorted(first, key=lambda one: one.law)
    ]

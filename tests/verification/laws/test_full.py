"""The long verification: the laws of an impact share its one call; the dearer ones see their fair
part of all."""

from __future__ import annotations

import numpy as np
import pytest

from verification.laws import full as study
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

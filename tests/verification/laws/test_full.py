"""The long verification: the sum over batches counts every case once."""

from __future__ import annotations

from verification.laws import full as study
from verification.laws.planted import wrong_sign


def test_batches_of_impacts_are_judged_by_the_kit_and_summed() -> None:
    batches = study.plan(30, 0, (study.IMPACTS,))
    assert batches == (study.Batch(study.IMPACTS, 0, 30),)
    assert sum(batch.count for batch in study.plan(600, 0, (study.IMPACTS,))) == 600
    two = [study.judge_batch(study.Batch(study.IMPACTS, n, 10), wrong_sign, 0) for n in (0, 10)]
    counts, found = study.summed(two)
    energy = [one.counts[0] for one in two]
    summed = counts[study.IMPACTS]["kinetic_energy"]
    assert summed.failures == sum(one.failures for one in energy) > 0
    assert summed.checked == sum(one.checked for one in energy)
    assert [one.law for one in found] == ["kinetic_energy"]
    assert "def test_kinetic_energy" in found[0].test


def test_the_sum_over_batches_of_scenes_does_not_depend_on_how_the_cases_are_cut() -> None:
    cut = [study.Batch("truncation", first, 10) for first in (0, 10)]
    whole = study.Batch("truncation", 0, 20)
    parts, one = (
        study.summed(study.judge_batch(batch, wrong_sign, 0) for batch in batches)
        for batches in (cut, [whole])
    )
    assert parts == one

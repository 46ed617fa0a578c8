"""The laws' table and the counterexamples that the page of energy shows."""

from __future__ import annotations

from verification.finding import REFUTED, REPRODUCED
from verification.laws.topic import CAUGHT, LAW_TABLE
from verification.table import HOLDS


def test_a_broken_law_and_a_fault_that_no_check_catches_are_missed_targets() -> None:
    row = {"law": "KE", "cases": 10, "worst": 0.0, "bound": 1.0, HOLDS: True, CAUGHT: True}
    sound = LAW_TABLE.judge(LAW_TABLE.table_of([row]))
    assert [part.verdict for part in sound] == [REPRODUCED] * 2
    for key in (HOLDS, CAUGHT):
        wrong = LAW_TABLE.judge(LAW_TABLE.table_of([row, row | {key: False}]))
        assert sorted(part.verdict for part in wrong) == sorted([REPRODUCED, REFUTED])

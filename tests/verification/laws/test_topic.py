"""The laws' table and the counterexamples that the page of energy shows."""

from __future__ import annotations

import ast

import numpy as np

from reference.exact import relative_energy_gain
from verification.check import Study
from verification.finding import REFUTED, REPRODUCED
from verification.laws.topic import CAUGHT, COUNTEREXAMPLES, LAW_TABLE
from verification.methods import gram_pinv
from verification.table import HOLDS


def test_a_broken_law_and_a_fault_that_no_check_catches_are_missed_targets() -> None:
    row = {"law": "KE", "cases": 10, "worst": 0.0, "bound": 1.0, HOLDS: True, CAUGHT: True}
    sound = LAW_TABLE.judge(LAW_TABLE.table_of([row]))
    assert [part.verdict for part in sound] == [REPRODUCED] * 2
    for key in (HOLDS, CAUGHT):
        wrong = LAW_TABLE.judge(LAW_TABLE.table_of([row, row | {key: False}]))
        assert sorted(part.verdict for part in wrong) == sorted([REPRODUCED, REFUTED])


def test_the_counterexample_to_the_printed_formula_can_be_pasted() -> None:
    (row,) = COUNTEREXAMPLES.table(Study(), ["printed formula"]).records()
    M, J, v = (np.array(ast.literal_eval(row[name])) for name in ("M", "J", "v⁻"))
    v_plus = gram_pinv(M, J, v, float(row["e"]))
    assert relative_energy_gain(M, v, v_plus) > 0.0 and row["relative energy gain"] > 0.0
    compile(row["test"], "test", "exec")

"""The topic of hard cases: what the page quotes, and that a failing case is a missed target."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from reference.worlds import run_world
from verification.check import Study
from verification.finding import REFUTED, REPRODUCED
from verification.hard_cases import topic
from verification.hard_cases.catalogue import HARD_CASES
from verification.hard_cases.topic import CASES, EVERY_METHOD, FAILURE, TOPIC
from verification.numbers import read_values
from verification.ordinary.judge import ORDINARY
from verification.ordinary.touch import TOUCH
from verification.table import Table

NAMES = ("grazing", "nearly_parallel_normals", "wall_far_beyond_the_bound")


@pytest.fixture(scope="module")
def tables() -> Mapping[str, Table]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(topic, "HARD_CASES", {name: HARD_CASES[name] for name in NAMES})
        study = Study(run_world)
        found = {check.key: study.table(check) for check in (EVERY_METHOD, CASES, FAILURE)}
    found[ORDINARY.key] = ORDINARY.table(Study(), ["ball_rolls", "bernoulli"])
    found[TOUCH.key] = TOUCH.table(Study(), TOUCH.cases(Study())[2:])
    return found


def test_every_case_has_a_row_for_each_method_and_a_description(
    tables: Mapping[str, Table],
) -> None:
    every = tables[EVERY_METHOD.key]
    outcomes = {(row["case"], row["method"]): row["outcome"] for row in every.records()}
    assert outcomes["Grazing impact", "factored"] == "stable"
    assert outcomes["Nearly parallel normals, 1e-6 apart", "gram_cholesky"] == "gains energy"
    assert tables[CASES.key]["case"] == list(dict.fromkeys(every["case"]))


def test_the_page_quotes_the_failing_case_and_its_energy(tables: Mapping[str, Table]) -> None:
    numbers = read_values(TOPIC.conclude(tables).tables)
    assert (numbers["cases"], numbers["right"], numbers["failing"]) == (3, 2, 1)
    assert numbers["failing_case"].startswith("Wall 2,000 times")
    assert numbers["failure_energy_times_iapb"] > 5.0 > numbers["failure_energy_times_pb"] > 1.0
    assert numbers["ordinary_right"] == numbers["ordinary"] == 2
    assert numbers["touch_error"] < 1e-9 < numbers["step_error"]


def test_a_failing_case_is_a_missed_target_and_so_is_a_wrong_scene(
    tables: Mapping[str, Table],
) -> None:
    every = tables[EVERY_METHOD.key]
    assert EVERY_METHOD.judge(every)[0].verdict == REFUTED
    right = every.only(not case.startswith("Wall") for case in every["case"])
    assert EVERY_METHOD.judge(right)[0].verdict == REPRODUCED
    for check, planted in ((ORDINARY, "IAPB is right"), (TOUCH, "error, impacts at the touch")):
        table = tables[check.key]
        assert check.judge(table)[0].verdict == REPRODUCED
        wrong = [row | {planted: planted.startswith("error") and 9.0} for row in table.by_title()]
        assert check.judge(check.table_of(wrong))[0].verdict == REFUTED

"""The hard cases' stage and page: every verdict is drawn as what it is, absent files are records, tables add up."""

from __future__ import annotations

from pathlib import Path

import pytest

from reports.pages.builder import worst_first
from reports.pages.records import Evidence
from reports.runner import Runner
from tests.reports.joined import joined
from verification.finding import Finding
from verification.hard_cases import findings
from verification.hard_cases.findings import STABLE
from verification.table import Table, table_from

CHOSEN = ("grazing", "nearly_parallel_normals", "chatter")


def summary(cases: tuple[Finding, ...]) -> Table:
    return findings.on_hard_cases(cases).tables["every method"]


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> tuple[Finding, ...]:
    from verification.hard_cases import catalogue

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("verification.hard_cases.shared_problems.FOLDER", Path("nowhere"))
        chosen = {name: catalogue.HARD_CASES[name] for name in (*CHOSEN, "bowl_of_low_rank")}
        patch.setattr("verification.hard_cases.findings.HARD_CASES", chosen)
        runner = Runner(tmp_path_factory.mktemp("runs"))
        found = findings.hard_cases(runner, lambda done, total: None, [])
        assert any("chatter" in label for label in runner.used)  # its runs are stored, and listed
    return found


def test_every_case_is_a_record_with_a_row_for_each_method(cases: tuple[Finding, ...]) -> None:
    assert [case.key for case in cases] == [*CHOSEN, "bowl_of_low_rank"]
    outcomes = [{part.name: part.sentence for part in case.parts} for case in cases]
    assert outcomes[0]["factored"] == "stable"
    assert outcomes[1]["gram_cholesky"] == "gains energy"
    assert (cases[2].details["kind"], outcomes[2]["IAPB"]) == ("motion", "stable")
    assert "bowl.5" in cases[3].answer and not cases[3].computed and not cases[3].tables
    assert len(summary(cases).rows) == sum(len(case.parts) for case in cases)


def test_the_page_ranks_the_cases_that_the_engine_fails_first(cases: tuple[Finding, ...]) -> None:
    def case(name: str, ours: str, other: str = STABLE) -> Finding:
        rows = [{"method": "factored", "outcome": ours}, {"method": "svd", "outcome": other}]
        return findings.finding_on(name, name, table_from(rows), {})

    made = [case("calm", STABLE), case("others", STABLE, "refused"), case("ours", "wrong motion")]
    assert [one.key for one in worst_first([cases[3], *made])] == ["ours", "others", "calm", "bowl_of_low_rank"]
    page = joined(Evidence(hard_cases=cases, topics=(findings.on_hard_cases(cases),)), ())
    row = page.split(f'<a href="#case-{cases[1].key}">')[1].split("</tr>")[0]
    assert "gram_cholesky gains energy" in row and "stable</span>" in row

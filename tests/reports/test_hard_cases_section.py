"""The hard cases' stage and matrix: every verdict is drawn as what it is, absent files are records, tables add up."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from reports.pages.matrix import matrices, worst_first
from reports.pages.records import Evidence
from reports.runner import Runner
from tests.reports.joined import joined
from verification.finding import Finding, finding_of
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


def test_the_matrix_shows_every_case_and_method(cases: tuple[Finding, ...]) -> None:
    impacts, motions = matrices(summary(cases))
    title, methods, rows = impacts
    assert (title, motions[0]) == ("Impacts, by method", "Motions, by world")
    assert methods[0] == "factored" and motions[1][0] == "IAPB"
    assert {case for case, _ in rows} == {cases[0].title, cases[1].title}
    gains = dict(rows)[cases[1].title][methods.index("gram_cholesky")]
    assert gains is not None and gains[:3] == ("✕", "bad", "gains energy")


def test_what_we_fail_stands_first_then_the_largest_share_of_what_is_allowed() -> None:
    def rows(case: str, outcome: str, error: float, other: str = STABLE) -> list[dict[str, object]]:
        same = {"case": case, "kind": "impact", "energy gain": None, "gain allowed": 1.0, "error allowed": 1e-10}
        return [same | {"method": "factored", "outcome": outcome, "forward error": error},
                same | {"method": "svd", "outcome": other, "forward error": 1.0}]

    found = table_from([*rows("calm", STABLE, 1e-16), *rows("close", STABLE, 9e-11),
                        *rows("others fail", STABLE, 1e-16, "wrong motion"), *rows("ours", "wrong motion", 1e-12)])
    ((_, _, lines),) = matrices(found)
    assert [case for case, _ in lines] == ["ours", "close", "others fail", "calm"]
    alone = [finding_of(case, case, "", "", (), {case: found.where(case=case)}) for case in ("calm", "close", "ours")]
    absent = finding_of("absent", "absent", "", "", ())
    assert [case.key for case in worst_first([absent, *alone])] == ["ours", "close", "calm", "absent"]


def test_the_page_says_the_verdict_before_the_decade(cases: tuple[Finding, ...]) -> None:
    page = joined(Evidence(hard_cases=cases, topics=(findings.on_hard_cases(cases),)), ())
    assert re.search(r'✕</span> gains energy</span> <span class="decade">10[⁻\d⁰¹²³⁴-⁹]+</span>', page)

"""The hard cases' stage and matrix: every verdict is drawn as what it is, absent files are records, tables add up."""

from __future__ import annotations

from pathlib import Path

import pytest

from reports.evidence.stage import Stage
from reports.figures.figure import Figure, draw
from reports.figures.hard_cases import INPUT, MARKS, decade, hard_cases
from reports.runner import Runner
from verification.finding import Finding, Table
from verification.hard_cases import study

CHOSEN = ("grazing", "nearly_parallel_normals", "chatter")


def summary(cases: tuple[Finding, ...]) -> Table:
    return study.on_hard_cases(cases).tables["every method"]


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> tuple[Finding, ...]:
    from verification.hard_cases import catalogue

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("verification.hard_cases.shared_problems.FOLDER", Path("nowhere"))
        chosen = {name: catalogue.HARD_CASES[name] for name in (*CHOSEN, "bowl_of_low_rank")}
        patch.setattr("verification.hard_cases.judge.HARD_CASES", chosen)
        patch.setattr("verification.hard_cases.study.HARD_CASES", chosen)
        runner = Runner(tmp_path_factory.mktemp("runs"))
        found = study.hard_cases(runner, lambda done, total: None, [])
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


def test_a_note_has_a_column_only_where_there_is_one(cases: tuple[Finding, ...]) -> None:
    tables = [table for case in cases for table in case.tables.values()]
    assert all("note" not in table.keys or any(table.column("note")) for table in tables)
    assert "note" not in cases[0].tables[cases[0].key].keys


def test_records_are_read_back_as_they_were(cases: tuple[Finding, ...], tmp_path: Path) -> None:
    stage = Stage(tmp_path, "hard_cases", tuple[Finding, ...], {})
    assert stage.get_or_compute(lambda: cases) == cases
    assert stage.get_or_compute(lambda: pytest.fail("computed twice")) == cases


def test_the_matrix_shows_every_case_and_method(cases: tuple[Finding, ...]) -> None:
    figure = draw(hard_cases, {INPUT: summary(cases)})
    assert isinstance(figure, Figure)
    assert [panel.label for panel in figure.panels] == ["Impacts, by method", "Motions, by world"]
    impacts = figure.panels[0].svg
    assert "Grazing impact" in impacts and "cholesky" in impacts and "Contact chatter" not in impacts
    assert {name for name, _ in figure.legend} >= {"stable", "gains energy", "wrong motion"}


def test_no_two_verdicts_look_alike() -> None:
    looks = [(style.marker, style.color, style.filled) for style in MARKS.values()]
    assert len(set(looks)) == len(looks)


@pytest.mark.parametrize(("value", "text"), [(2e-16, "−16"), (0.3, "−1"), (2.0, "0"), (0.0, ""), (None, "")])
def test_the_decade_of_a_value(value: float | None, text: str) -> None:
    assert decade(value) == text


def test_without_cases_nothing_is_drawn() -> None:
    figure = draw(hard_cases, {INPUT: Table(summary(()).columns)})
    assert isinstance(figure, Figure) and figure.panels == ()

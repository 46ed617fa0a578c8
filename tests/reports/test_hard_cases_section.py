"""The hard cases' stage and matrix: every verdict is drawn as what it is, absent files are records, tables add up."""

from __future__ import annotations

from pathlib import Path

import pytest

from reports.evidence.hard_cases import INPUT, compute, summary
from reports.evidence.stage import Stage
from reports.figures.figure import Figure, draw
from reports.figures.hard_cases import MARKS, decade, hard_cases
from reports.pages.records import HardCase
from reports.runner import Runner
from verification.finding import Table

CHOSEN = ("grazing", "nearly_parallel_normals", "chatter")


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> tuple[HardCase, ...]:
    from verification.hard_cases import catalogue

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("verification.hard_cases.shared_problems.FOLDER", Path("nowhere"))
        chosen = {name: catalogue.HARD_CASES[name] for name in (*CHOSEN, "bowl_of_low_rank")}
        patch.setattr("verification.hard_cases.judge.HARD_CASES", chosen)
        patch.setattr("reports.evidence.hard_cases.HARD_CASES", chosen)
        runner = Runner(tmp_path_factory.mktemp("runs"))
        found = compute(runner, lambda done, total: None, [])
        assert any("chatter" in label for label in runner.used)  # its runs are stored, and listed
    return found


def test_every_case_is_a_record_with_a_row_for_each_method(cases: tuple[HardCase, ...]) -> None:
    assert [case.id for case in cases] == [*CHOSEN, "bowl_of_low_rank"]
    assert cases[0].outcomes["factored"] == "stable"
    assert cases[1].outcomes["gram_cholesky"] == "gains energy"
    assert (cases[2].kind, cases[2].outcomes["IAPB"]) == ("motion", "stable")
    assert "bowl.5" in cases[3].skipped and not cases[3].numbers.rows
    assert len(summary(cases).rows) == sum(len(case.outcomes) for case in cases)


def test_a_note_has_a_column_only_where_there_is_one(cases: tuple[HardCase, ...]) -> None:
    assert all(len(row) == len(case.numbers.columns) for case in cases for row in case.numbers.rows)
    assert "note" not in cases[0].numbers.keys


def test_records_are_read_back_as_they_were(cases: tuple[HardCase, ...], tmp_path: Path) -> None:
    stage = Stage(tmp_path, "hard_cases", tuple[HardCase, ...], {})
    assert stage.get_or_compute(lambda: cases) == cases
    assert stage.get_or_compute(lambda: pytest.fail("computed twice")) == cases


def test_the_matrix_shows_every_case_and_method(cases: tuple[HardCase, ...]) -> None:
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

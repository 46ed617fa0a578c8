"""The topic of complementarity: tables from a small study, figures that follow them, laws of a run by name."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest

from reference.complementarity.problem import ImpactProblem
from reference.datasets import StoredProblem
from reports.figures import RECIPES
from reports.figures.figure import Figure, draw
from reports.figures.style import VARIABLES
from reports.runner import Runner
from verification.complementarity import complementarity, tables
from verification.complementarity.agreement import agreement_map, compare_cases, two_contact_map
from verification.complementarity.cases import random_cases
from verification.complementarity.convergence import ConvergenceRow
from verification.complementarity.extensions import compare_friction, compare_unequal, struck_bar
from verification.complementarity.problems import study_read
from verification.complementarity.study import OWN, ComparisonStudy
from verification.cost.step_cost import COST_COLUMNS, LEMKE_KERNEL, STEP_COLUMNS, WAYS, impact_cost
from verification.finding import VERDICTS, Table, table_of, titled


@pytest.fixture(scope="module")
def study() -> ComparisonStudy:
    found = compare_cases(random_cases(2, seed=3))
    pile, spread = {"impacts": "pile", "contacts": 2}, {"median": 200.0, "least": 100.0, "largest": 300.0}
    unsolved = ({**pile, "solver": "slow", "outcome": "left out", "note": "left out: 9 s for fewer contacts"},
                {**pile, "solver": "wrong", "outcome": "failed", **spread, "distance": 0.1})
    problems = [StoredProblem(ImpactProblem.from_delassus(np.eye(3), [-1.0, 0.2, 0.0], 0.0, mu, name=f"ball {mu}"))
                for mu in (None, 0.5)]  # fmt: skip
    return ComparisonStudy(
        "quick", tuple(c for c in found if c.family == "one contact"), agreement_map(found), two_contact_map(), (), 0,
        compare_friction(2), compare_unequal(4), struck_bar(),
        (ConvergenceRow("two_discs", "automatic", False, 0.2, 1, 1.0, 0.9, 1.0, 1.0),
         ConvergenceRow("still", "automatic", False, 0.2, 0, 0.0, 0.0, 1.0, 1.1)),
        table_of(COST_COLUMNS, [*impact_cost((1, 2), ("daqp",), 1).records(), *unsolved]),
        table_of(STEP_COLUMNS, [{"scene": "peg_corner", "world": way, **spread} for way in WAYS]),
        (study_read(OWN, problems),),
    )  # fmt: skip


@pytest.fixture(scope="module")
def figures(study: ComparisonStudy) -> dict[str, Figure]:
    inputs = {f"{complementarity.ID}/{name}": table for name, table in tables.all_tables(study).items()}
    drawn = {recipe.key: draw(recipe, inputs) for recipe in RECIPES if recipe.section == complementarity.ID}
    assert all(isinstance(figure, Figure) for figure in drawn.values())
    return drawn  # type: ignore[return-value]


def test_all_four_figures_are_whole_and_follow_the_page(figures: dict[str, Figure]) -> None:
    assert {"agreement-map", "cost-of-contacts", "performance-profile", "rigid-convergence"} <= set(figures)
    known = {f"var(--{name}, {value})" for value, name in VARIABLES.items()}
    for figure in figures.values():
        for panel in figure.panels:
            ElementTree.fromstring(panel.svg)
            assert set(re.findall(r"(?:fill|stroke): ([^;\"]+)", panel.svg)) <= known | {"none"}
            assert panel.alt


def test_what_was_not_solved_is_in_the_table_and_in_the_legend(figures: dict[str, Figure]) -> None:
    figure = figures["cost-of-contacts"]
    outcomes = {row[3]: row[4] for row in figure.numbers.rows}  # type: ignore[union-attr]
    assert outcomes["slow"] == "left out" and outcomes["wrong"] == "failed" and outcomes[LEMKE_KERNEL] == "solved"
    assert "slow" in {name for name, _ in figure.legend} and len(figure.legend) == 6  # the numbers have all


def test_rows_have_as_many_cells_as_columns_and_no_number_is_missing(study: ComparisonStudy) -> None:
    for name, table in tables.all_tables(study).items():
        assert all(len(row) == len(table.columns) for row in table.rows), name
        assert not any(isinstance(cell, float) and np.isnan(cell) for row in table.rows for cell in row), name


def test_a_profile_ends_at_the_share_that_was_solved(study: ComparisonStudy, figures: dict[str, Figure]) -> None:
    ends = figures["performance-profile"].numbers
    assert ends is not None
    for collection, kind, solver, _, at_all in ends.rows:
        rows = [row for row in study.problems[0].rows if row.solver == solver]
        assert collection == OWN and at_all == pytest.approx(np.mean([row.verdict == "solved" for row in rows])), kind


def test_a_run_of_any_world_states_its_contact_law(tmp_path: Path) -> None:
    table: Table = tables.worlds(Runner(tmp_path), {"duration": 0.05})
    laws = {row[0]: row[1] for row in table.rows}
    assert set(laws) >= {"ideal", "IAPB", "PB", "CBuc"} and all(laws.values())
    assert laws["IAPB"] != laws["PB"] != laws["ideal"]
    assert "rendering" in {row[0]: row[2] for row in table.rows}["IAPB"]


def test_the_topic_is_made_of_judged_sentences(study: ComparisonStudy, monkeypatch: pytest.MonkeyPatch,
                                               tmp_path: Path) -> None:  # fmt: skip
    monkeypatch.setattr(complementarity, "compare", lambda *arguments, **options: study)
    monkeypatch.setattr(tables, "worlds", lambda runner, failures: titled(("world",), ()))
    topic = complementarity.complementarity(Runner(tmp_path), "quick", lambda done, total: None)
    assert len(topic.parts) >= 10 and {part.verdict for part in topic.parts} <= set(VERDICTS)
    assert topic.answer and "profile" in topic.tables and str(Path.home()) not in repr(topic)

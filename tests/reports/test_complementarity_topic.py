"""The topic of complementarity: figures follow from tables of a small study; laws of a run by name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from reference.complementarity.problem import ImpactProblem
from reference.datasets import StoredProblem
from reports.figures import RECIPES
from reports.figures.figure import Figure, draw
from reports.runner import Runner
from verification.check import Study
from verification.complementarity import agreement, solvers, topic
from verification.complementarity.agreement import MAP, TWO_CONTACTS
from verification.complementarity.convergence import CONVERGENCE
from verification.complementarity.families import FAMILIES
from verification.complementarity.solvers import OWN, collections
from verification.cost import solvers as timings
from verification.cost.solvers import FAMILIES as TIMED
from verification.cost.solvers import IMPACT_TIMES, LEMKE_KERNEL, Size
from verification.cost.steps import STEP_TIMES, WAYS
from verification.table import Table

KEY = topic.TOPIC.key


@pytest.fixture(scope="module")
def study() -> dict[str, Table]:
    patch = pytest.MonkeyPatch()
    patch.setitem(agreement.COUNTS, "quick", 2)
    problems = [StoredProblem(ImpactProblem.from_delassus(np.eye(3), [-1.0, 0.2, 0.0], 0.0, mu, name=f"ball {mu}"))
                for mu in (None, 0.5)]  # fmt: skip
    patch.setattr(solvers, "own_problems", lambda failures: problems)
    given = Study()
    own, profile = collections({OWN: None})
    pile, spread = {"impacts": "pile", "contacts": 2}, dict(zip(timings.MEASURED, (200.0, 100.0, 300.0), strict=True))
    unsolved = ({**pile, "solver": "slow", "outcome": "left out", "note": "left out: 9 s for fewer contacts"},
                {**pile, "solver": "wrong", "outcome": "failed", **spread, "distance": 0.1})
    still = dict.fromkeys(("events", "error of positions", "error of velocities"), 0.0)
    orders = {"order, positions": 1.0, "order, velocities": None}
    patch.setattr(timings, "SOLVERS", ("daqp",))
    timed = IMPACT_TIMES.table(given, [Size(family, contacts) for contacts in (1, 2) for family in TIMED])
    found = {
        "map": MAP.table(given, FAMILIES), "two contacts": TWO_CONTACTS.table(given), "own problems": own.table(given),
        "profile": profile.table(given),
        "convergence": CONVERGENCE.table_of([{"scene": "still", "step [ms]": step, **still, **orders, "holds": None}
                                             for step in (2.0, 0.5)]),
        "time per impact": IMPACT_TIMES.table_of([*timed.by_title(), *unsolved]),
        "time per step": STEP_TIMES.table_of([{"scene": "peg_corner", "world": way, "median": 200.0, "least": 100.0,
                                               "largest": 300.0} for way in WAYS]),
    }  # fmt: skip
    patch.undo()
    return found


@pytest.fixture(scope="module")
def figures(study: dict[str, Table]) -> dict[str, Figure]:
    inputs = {f"{KEY}/{name}": table for name, table in study.items()}
    drawn = {recipe.key: draw(recipe, inputs) for recipe in RECIPES if recipe.section == KEY}
    return {key: figure for key, figure in drawn.items() if isinstance(figure, Figure)}


def test_figures_are_drawn_and_what_was_not_solved_is_in_the_table_and_in_the_legend(
    study: dict[str, Table], figures: dict[str, Figure]
) -> None:
    assert set(figures) == {"agreement-map", "cost-of-contacts", "performance-profile", "rigid-convergence"}
    costs, ends = figures["cost-of-contacts"], figures["performance-profile"].numbers
    assert costs.numbers is not None and ends is not None
    outcomes = {row[3]: row[4] for row in costs.numbers.rows}
    assert outcomes["slow"] == "left out" and outcomes["wrong"] == "failed" and outcomes[LEMKE_KERNEL] == "solved"
    assert "slow" in {name for name, _ in costs.legend} and len(costs.legend) == 6  # the numbers have all
    for collection, kind, solver, _, at_all in ends.rows:
        verdicts = [verdict for verdict in study["own problems"].column(solver) if verdict]
        assert collection == OWN and at_all == pytest.approx(np.mean([one == "solved" for one in verdicts])), kind
    for name, table in study.items():
        assert not any(isinstance(cell, float) and np.isnan(cell) for row in table.rows for cell in row), name


def test_a_run_of_any_world_states_its_contact_law(tmp_path: Path) -> None:
    worlds = topic.TOPIC.checks[-1]
    laws = {row["world"]: row for row in worlds.table(Study(Runner(tmp_path)), ("ideal", "IAPB", "PB")).records()}
    assert laws["IAPB"]["contact law"] != laws["PB"]["contact law"] != laws["ideal"]["contact law"]
    assert "rendering" in laws["IAPB"]["its settings"]

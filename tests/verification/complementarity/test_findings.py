"""A sentence's verdict follows from the record: planted records turn it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from reference.complementarity.problem import ImpactProblem
from reference.datasets import StoredProblem
from verification.complementarity.agreement import agreement_map, compare_cases, two_contact_map
from verification.complementarity.cases import random_cases
from verification.complementarity.findings import PARTS, problems
from verification.complementarity.piles import PileRow
from verification.complementarity.problems import own_problems, study_read
from verification.cost.step_cost import COST_COLUMNS, IAPB, KERNEL, LEMKE_KERNEL, rivals
from verification.finding import MIXED, NOT_TESTABLE, REFUTED, REPRODUCED, table_of
from verification.mechanics.engine_differences import SceneDifference

FOUND = compare_cases(random_cases(3, seed=12))
CELLS = agreement_map(FOUND)
SINGLE = tuple(c for c in FOUND if c.family == "one contact" and not c.redundancy)
STUDY = SimpleNamespace(left_out=0, single=SINGLE, cells=CELLS, scenes=CELLS, two_contacts=two_contact_map())


def row(solver: str, least: float, largest: float, outcome: str = "solved") -> dict[str, Any]:
    return {"impacts": "pile", "contacts": 4, "solver": solver, "outcome": outcome, "median": 0.5 * (least + largest),
            "least": least, "largest": largest}  # fmt: skip


def verdict(name: str, **changed: Any) -> str:
    part = PARTS[name](SimpleNamespace(**{**vars(STUDY), **changed}))  # type: ignore[arg-type]
    assert part is not None
    return part.verdict


def worse(**values: Any) -> tuple[Any, ...]:
    return (replace(CELLS[0], **values), *CELLS[1:])


def test_exact_statements_hold_and_one_exception_refutes_them() -> None:
    assert {verdict(name) for name in ("single_contact", "wider_class", "two_contacts", "difference", "energy")} == {
        REPRODUCED
    }
    assert verdict("single_contact", single=(replace(SINGLE[0], distance=1e-9),)) == REFUTED
    assert verdict("wider_class", cells=worse(contradictions=1)) == REFUTED
    assert verdict("two_contacts", two_contacts=(replace(STUDY.two_contacts[0], found=False),)) == REFUTED
    assert verdict("difference", cells=worse(defect=1e-6)) == REFUTED
    assert verdict("energy", cells=worse(least_extra_loss=-1e-6)) == REFUTED
    assert verdict("energy", cells=worse(momentum=1e-3)) == REFUTED


@pytest.mark.parametrize(("share", "expected"), [(1.0, REPRODUCED), (0.7, MIXED), (0.2, MIXED)])
def test_shares_of_scene_impacts(share: float, expected: str) -> None:
    assert verdict("scenes", scenes=(replace(CELLS[0], agree=share),)) == expected


def test_piles_say_where_to_stop_and_references_where_the_engine_differs() -> None:
    row = PileRow("4 spheres", "approaching", 5, 0, 0.0, 0.0, 0.0, True, 1e-16, -0.5, 1e-4, 1e-4)
    pulls = replace(row, contacts=30, distance=0.2, pulling=0.25, asked=False)
    part = PARTS["piles"](SimpleNamespace(piles=(row, pulls, pulls)))  # type: ignore[arg-type]
    assert part is not None and part.verdict == REFUTED
    assert "in 1 of 3 impacts, and in none with more than 5 contacts. Do not use (19)" in part.sentence
    assert "25 % of the impulses pull" in part.sentence and "contradicts this in 0 impacts" in part.sentence
    same = SceneDifference("peg_corner", 20, 0, 1e-15, 1e-15, 0.0, 0.0, 8, 0.0, 0.0, 1e-16, 0.0)
    assert verdict("references", differences=(same,)) == REPRODUCED
    assert verdict("references", differences=(same, replace(same, gap=1e-9))) == REFUTED


def test_costs_are_told_apart_only_where_samples_do_not_overlap() -> None:
    rows = (row(IAPB, 1.0, 2.0), row(KERNEL, 0.1, 0.2), row("slow", 3.0, 4.0), row("alike", 1.5, 9.0),
            row("fast", 0.1, 0.5), row("wrong", 3.0, 4.0, "failed"), row(LEMKE_KERNEL, 0.5, 0.9))  # fmt: skip
    costs = table_of(COST_COLUMNS, rows)
    outcomes = {pair.solver["solver"]: pair.costs_more for pair in rivals(costs)}
    assert outcomes == {"slow": True, "alike": None, "fast": False, "wrong": None, LEMKE_KERNEL: True}
    assert verdict("cost", impact_costs=costs) == MIXED
    assert verdict("cost", impact_costs=table_of(COST_COLUMNS, rows[:2] + rows[3:4])) == NOT_TESTABLE


def test_a_slow_solver_is_not_asked_for_more_and_a_problem_without_solution_limits() -> None:
    unsolvable = ImpactProblem.from_delassus([[0.0]], [-1.0], name="unsolvable")
    larger = ImpactProblem.from_delassus(np.eye(2), [-1.0, -1.0], name="larger")
    study = study_read("few", [StoredProblem(larger), StoredProblem(unsolvable)], longest=0.0)
    assert {dict(line.verdicts)["daqp"] for line in study.lines} == {"failed", "left out"}
    judged = problems(study)
    assert judged[0].verdict == MIXED and "left out" in judged[0].sentence


def test_own_problems_are_named_apart_and_are_of_both_kinds() -> None:
    own = [stored.problem for stored in own_problems()]
    assert len({problem.name for problem in own}) == len(own)
    assert {problem.friction is None for problem in own} == {True, False}
    hyperstatic = [p for p in own if np.linalg.matrix_rank(p.delassus, hermitian=True) < p.size]
    assert len(hyperstatic) >= 10

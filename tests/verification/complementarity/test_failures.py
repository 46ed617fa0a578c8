"""A fault in one case of the comparison costs that row only."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from reference.complementarity import benchmark
from verification.complementarity import (
    agreement,
    extensions,
    findings,
    problems,
    study,
)
from verification.cost import step_cost
from verification.finding import NOT_TESTABLE, Failure


def breaks(original: Any, here: Any) -> Any:
    """`original`, which raises where here(arguments) is true."""

    def broken(*arguments: Any, **options: Any) -> Any:
        if here(*arguments):
            raise ZeroDivisionError("planted")
        return original(*arguments, **options)

    return broken


@pytest.fixture(scope="module")
def found() -> Iterator[study.ComparisonStudy]:
    """A small comparison with a fault in one case of each of its parts."""
    monkeypatch = pytest.MonkeyPatch()
    depth = study.Depth(1, 2, 3, (1, 2), 1, 9.0, ("two_discs", "bernoulli_balls"))
    monkeypatch.setitem(study.DEPTHS, "quick", depth)
    case_breaks = breaks(agreement.compare_case, lambda case, *_: case.family == "cradle" and case.restitution == 0.5)
    border = agreement.two_contacts(-0.9, 0.05, np.random.default_rng(2)).contact_jacobian.tolist()
    border_breaks = breaks(case_breaks, lambda case, *_: case.contact_jacobian.tolist() == border)
    monkeypatch.setattr(agreement, "compare_case", border_breaks)
    monkeypatch.setattr(study, "scene_impacts", breaks(study.scene_impacts, lambda name: name == "two_discs"))
    rough = breaks(extensions._friction_cell, lambda _, e, mu: (e, mu) == (0.5, 0.1))
    monkeypatch.setattr(extensions, "_friction_cell", rough)
    mixed = breaks(extensions._unequal_cell, lambda signs, *_: signs == "mixed signs")
    monkeypatch.setattr(extensions, "_unequal_cell", mixed)
    monkeypatch.setattr(study, "converge", breaks(study.converge, lambda case: case.scene == "two_discs"))
    monkeypatch.setattr(step_cost, "solver_call", breaks(step_cost.solver_call, lambda case, name: name == "lemke"))
    monkeypatch.setattr(step_cost.impact_cost, "__defaults__",
                        (step_cost.CONTACTS, ("daqp", "lemke"), *step_cost.impact_cost.__defaults__[2:]))
    monkeypatch.setattr(step_cost, "_seconds_per_step",
                        breaks(lambda *_: 1.0, lambda scene, way, _: (scene, way) == ("peg_hole", step_cost.IDEAL)))
    monkeypatch.setattr(study, "compare_piles", lambda *_, **__: ())
    monkeypatch.setattr(problems, "SCENES", ())
    monkeypatch.setattr(problems, "HARD", ("grazing", "mass_ratio"))
    monkeypatch.setattr(problems, "_hyperstatic", lambda: ())
    monkeypatch.setattr(problems, "_with_friction", lambda: ())
    monkeypatch.setattr(benchmark, "solver_names",
                        breaks(lambda _: ("daqp",), lambda problem: problem.name == "hard case grazing"))
    yield study.compare(scenes=("two_discs", "newton_cradle"))
    monkeypatch.undo()


def test_only_the_rows_with_a_fault_are_lost(found: study.ComparisonStudy) -> None:
    assert {failure.error for failure in found.failures} == {"ZeroDivisionError"}
    assert [failure.case for failure in found.failures] == [
        "cradle, e = 0.5, impact 11", "impacts of two_discs", "impacts of two_discs, e = 0.5",
        "two contacts, cosine -0.9, speed ratio 0.05", "friction, e = 0.5, μ = 0.1",
        "unequal restitution, mixed signs", "convergence on two_discs", "lemke on a patch of 1 contacts",
        "lemke on a pile of 1 contacts", "lemke on a patch of 2 contacts", "lemke on a pile of 2 contacts",
        "peg_hole, ideal (QP per step)", "hard case grazing",
    ]  # fmt: skip
    assert {cell.restitution for cell in found.cells if cell.family == "cradle"} == {0.0, 1.0}
    assert {cell.family for cell in found.scenes} == {"scene newton_cradle"}
    assert len(found.two_contacts) == 53 and len(found.friction) == 8
    assert [cell.signs for cell in found.unequal] == ["all approach"]
    assert [row.scene for row in found.convergence] == ["bernoulli_balls"]
    assert set(found.impact_costs.where(solver="lemke").column("outcome")) == {"failed"}
    assert found.step_costs.where(scene="peg_hole").column("world") == [
        way for way in step_cost.WAYS if way != step_cost.IDEAL]
    assert [line.problem for line in found.problems[0].lines] == ["hard case mass_ratio"]


def test_a_sentence_about_nothing_fails_alone(found: study.ComparisonStudy) -> None:
    failures: list[Failure] = []
    names = [part.name for part in findings.parts_of(replace(found, friction=()), failures)]
    assert [failure.case for failure in failures] == ["sentence on friction"]
    assert "friction" not in names and {"wider class", "energy", "cost", "problems"} <= set(names)
    nothing = replace(found, two_contacts=())
    part = findings.two_contacts(nothing)
    assert part is not None and part.verdict == NOT_TESTABLE

"""A fault in one case of a stage costs that row only; the stage is not taken for complete; the last lines say so."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from pathlib import Path
from typing import Any

import pytest
import typer

import verification.claims
from reports.commands import reproduce
from reports.evidence import claims, gather, runs, survival
from reports.figures.figure import Figure, Panel, Recipe
from reports.pages.records import Evidence, FailedCases
from reports.runner import Runner
from verification import proofs
from verification.claims import arm
from verification.cost import effects, impacts
from verification.finding import NOT_COMPUTED, Failure, failure_of
from verification.hard_cases import judge
from verification.hard_cases import study as hard_cases
from verification.laws import engine as engine_laws
from verification.laws import equality, trajectories
from verification.laws import topic as laws
from verification.laws.contracts import CONTRACTS
from verification.table import Column, Table

Patch = pytest.MonkeyPatch
Found = tuple[Any, list[Failure]]


def broken(original: Callable[..., Any], here: Callable[..., bool]) -> Callable[..., Any]:
    """`original`, which raises where `here` is true of its arguments."""

    @wraps(original)
    def call(*arguments: Any, **options: Any) -> Any:
        if here(*arguments):
            raise ZeroDivisionError("planted")
        return original(*arguments, **options)

    return call


def nothing(*_: Any) -> None:
    """No progress."""


def of_claims(patch: Patch, folder: Path) -> list[str]:
    """One trial of C07, and all of C01."""
    from dataclasses import replace

    chosen = {name: verification.claims.CLAIMS[name] for name in ("C01", "C07")}
    chosen["C01"] = replace(chosen["C01"], cases=broken(chosen["C01"].cases, lambda study: True))
    patch.setattr(verification.claims, "CLAIMS", chosen)
    patch.setattr(arm, "strike", broken(arm.strike, lambda robot, place, angle, e: (place, angle) ==
                                                (arm.PLACES[0], arm.ANGLES[0])))  # fmt: skip
    failures: list[Failure] = []
    first, second = claims.compute(Runner(folder), "quick", nothing, failures)
    assert (first.verdict, first.tables["C01"].rows) == (NOT_COMPUTED, ())
    trials = 2 * len(arm.PLACES) * len(arm.ANGLES) - 1
    assert len(second.tables["C07"].rows) == trials - 2
    return [failure.case for failure in failures]


def of_proofs(patch: Patch, folder: Path) -> list[str]:
    patch.setattr(proofs, "all_proofs", lambda: ("one", "two", "three"))
    patch.setattr(proofs, "check", broken(lambda name: name, "two".__eq__))
    failures: list[Failure] = []
    assert proofs.check_all(nothing, failures) == ("one", "three")
    return [failure.case for failure in failures]


def of_properties(patch: Patch, folder: Path) -> list[str]:
    sizes = {"KIT_IMPACTS": 3, "FAULT_IMPACTS": 1, "ENGINE_CASES": 1, "SIMULATED": 1, "FAULT_CASES": 1,
             "TRAJECTORIES": 2, "IN_SPACE": 0, "TRAJECTORY_STEPS": 5}  # fmt: skip
    for name, size in sizes.items():
        patch.setattr(laws, name, size)
    impact, engine = next(iter(equality.LAWS)), next(iter(engine_laws.ENGINE_LAWS))
    chosen = {name: engine_laws.ENGINE_LAWS[name] for name in (engine, "budget") if name in engine_laws.ENGINE_LAWS}
    for module in (engine_laws, laws):
        patch.setattr(module, "ENGINE_LAWS", chosen)
    of_runs = trajectories.TRAJECTORY_LAWS
    for found, name in ((CONTRACTS["equality"].laws, impact), (chosen, engine), (of_runs, "finite")):
        patch.setitem(found, name, found[name]._replace(check=broken(found[name].check, lambda *_: True)))
    found = laws.properties(None, "quick", nothing)
    every = len(equality.LAWS) + len(chosen) + len(of_runs)
    assert len(found.tables["laws"].rows) == every - 3
    assert [failure.case for failure in found.failures] == [
        f"laws, impact, {impact}", f"laws, engine, {engine}", "laws, trajectory, finite"]
    return ["a law of each kind"]


def of_counterexamples(patch: Patch, folder: Path) -> list[str]:
    for name in ("printed_formula", "restitution_per_contact", "saturation"):
        made = getattr(laws, name)
        patch.setattr(laws, name, broken(wraps(made)(lambda: 1), lambda name=name: name == "saturation"))
    failures: list[Failure] = []
    assert laws.counterexamples(nothing, failures) == (1, 1)
    return [failure.case for failure in failures]


def of_bulk(patch: Patch, folder: Path) -> list[str]:
    patch.setitem(laws.IMPACTS, "quick", 20)
    patch.setitem(laws.COMPARED_IMPACTS, "quick", 20)
    patch.setattr(laws, "bulk_impacts", broken(laws.bulk_impacts, lambda n, seed, method, clamp: clamp is False))
    found = laws.energy_gains(None, "quick", nothing)
    methods = found.tables["impacts"].column("method")
    assert list(dict.fromkeys(methods)) == ["factored", "gram_pinv, as printed"]
    assert "In 20 random impacts" in found.answer and found.verdict == NOT_COMPUTED
    return [failure.case for failure in found.failures]


def made_up(solver: str) -> dict[str, Any]:
    """A comparison that fails by Lemke's method."""
    difference = 1.0 if solver == "lemke" else 0.0
    return {"quantity": solver, "against": solver, "cases": 1, "largest difference": difference, "tolerance": 1e-9}


def of_hard_cases(patch: Patch, folder: Path) -> list[str]:
    chosen = {name: judge.HARD_CASES[name] for name in ("grazing", "one_contact")}
    chosen["lost"] = broken(chosen["grazing"], lambda: True)
    patch.setattr(judge, "HARD_CASES", chosen)
    patch.setattr(hard_cases, "HARD_CASES", chosen)
    patch.setattr(judge, "judge_hard_case", broken(judge.judge_hard_case, lambda case, method, _: (
        method, case.name) == ("svd", chosen["grazing"]().name)))  # fmt: skip
    failures: list[Failure] = []
    found = hard_cases.hard_cases(Runner(folder), nothing, failures)
    assert [case.key for case in found] == ["grazing", "one_contact"]
    assert ["svd" in [part.name for part in case.parts] for case in found] == [False, True]
    assert hard_cases.on_hard_cases(found, failures).verdict == NOT_COMPUTED
    return [failure.case for failure in failures]


def of_accuracy(patch: Patch, folder: Path) -> list[str]:
    patch.setattr(impacts, "TIMED_HARDNESS", impacts.TIMED_HARDNESS[:1])
    patch.setattr(impacts, "_ENOUGH", 0.0)
    first, *others = ways = [way for way in impacts.WAYS if way.rows < 3]
    ways[0] = replace(first, make=broken(first.make, lambda problem: True))
    failures: list[Failure] = []
    table = impacts.work_precision([(4, 3)], ways=ways, progress=nothing, failures=failures)
    assert table.column("work") == [way.work for way in others]
    return [failure.case.removeprefix(table.column("problem")[0]) for failure in failures]


def of_effects(patch: Patch, folder: Path) -> list[str]:
    patch.setattr(effects, "scene_names", lambda: ("peg_corner", "arm_pushing"))
    patch.setattr(effects, "load_scene", broken(effects.load_scene, lambda path: path.stem == "arm_pushing"))
    impulses = effects.LEFT_OUT["impulses"]
    patch.setattr(effects, "_loop", broken(effects._loop, lambda scene, world, variant: variant is impulses))
    failures: list[Failure] = []
    found = effects.effects_of_scenes(nothing, failures)
    changes = {row["effect"]: row["change"] for row in found["peg_corner"].records() if row["active"]}
    assert list(found) == ["peg_corner"] and changes.pop("impulses") is None and None not in changes.values()
    return [failure.case for failure in failures]


def of_runs(patch: Patch, folder: Path) -> list[str]:
    patch.setattr(runs, "FIGURE_RUNS", {name: runs.FIGURE_RUNS[name] for name in ("corner/IAPB", "hole/IAPB")})
    patch.setattr(runs, "shipped_scene", broken(runs.shipped_scene, lambda name, values: name == "peg_hole"))
    failures: list[Failure] = []
    assert list(runs.figure_runs(Runner(folder), nothing, failures)) == ["corner/IAPB"]
    return [failure.case for failure in failures]


def of_survival(patch: Patch, folder: Path) -> list[str]:
    chosen = ("corner/IAPB", "corner/PB")
    patch.setattr(survival, "FIGURE_RUNS", {name: survival.FIGURE_RUNS[name] for name in chosen})
    repeat = broken(survival.repeat_run, lambda path: "PB" in path.name.split("-"))
    patch.setattr(survival, "repeat_run", repeat)
    topic = survival.compute(Runner(folder), "quick", nothing)
    assert [row[0] for row in topic.tables["simulated again"].rows] == ["corner/IAPB"]
    return [failure.case for failure in topic.failures]


def of_mechanics(patch: Patch, folder: Path) -> list[str]:
    from dataclasses import replace

    from verification.mechanics import linked_impacts
    from verification.mechanics.mechanics import mechanics

    outcomes = linked_impacts.outcomes
    patch.setattr(linked_impacts, "outcomes", broken(outcomes, lambda balls: balls.name == "cradle of 2"))
    topic = replace(mechanics, checks=(linked_impacts.LINKED_IMPACTS,))(Runner(folder), "quick", nothing)
    assert "cradle of 5" in topic.tables["linked impacts"].column("problem")
    return [failure.case for failure in topic.failures]


STAGES: dict[Callable[[Patch, Path], list[str]], list[str]] = {
    of_claims: ["C01", "C07, slender rods, 0.0, 0.1", "C07, point masses at the tips, 0.0, 0.1"],
    of_proofs: ["two"],
    of_properties: ["a law of each kind"],
    of_counterexamples: ["saturation"],
    of_bulk: ["impacts, factored, no clamp"],
    of_hard_cases: ["grazing, svd", "lost"],
    of_accuracy: [", IAPB, 1 row"],
    of_effects: ["peg_corner, impulses", "arm_pushing"],
    of_runs: ["hole/IAPB"],
    of_survival: ["corner/PB"],
    of_mechanics: ["linked impacts, cradle of 2", "the answer"],
}


@pytest.mark.parametrize("stage", STAGES, ids=lambda stage: stage.__name__)
def test_only_the_row_is_lost(stage: Callable[[Patch, Path], list[str]], monkeypatch: Patch, tmp_path: Path) -> None:
    assert stage(monkeypatch, tmp_path) == STAGES[stage]


def test_a_stage_with_failures_is_not_taken_for_complete(tmp_path: Path) -> None:
    def compute(progress: Any, failures: list[Failure]) -> tuple[str, ...]:
        calls.append(1)
        if len(calls) == 1:
            failures.append(failure_of("two", ValueError("planted")))
        return ("one", "two")[: len(calls)]

    calls: list[int] = []
    for expected in (("one",), ("one", "two"), ("one", "two")):
        stages = gather._Kept(tmp_path / "tables", "quick", nothing, Runner(tmp_path / "runs"))
        assert stages.stage("proofs", tuple[str, ...], compute) == expected
        assert [failed.stage for failed in stages.failed()] == (["proofs"] if len(expected) == 1 else [])
        assert stages.stages[0].path.is_file()
    assert len(calls) == 2 and not list(tmp_path.rglob("*incomplete*")) and not list(tmp_path.rglob("*failed*"))


def test_the_last_lines_say_what_failed_and_where_the_traceback_is(
    monkeypatch: Patch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(tmp_path / "tables" / "claims-failed.txt")
    failures = tuple(failure_of(f"C{n:02d}", ValueError("planted\nand more")) for n in range(1, 23))
    monkeypatch.setattr(reproduce, "gather", lambda *_: Evidence(failed=(FailedCases("claims", failures, path),)))
    facts: dict[str, object] = {}
    with pytest.raises(typer.Exit) as ended:
        reproduce.make_report(tmp_path, "quick", facts)
    assert facts["failed"] == (FailedCases("claims", failures, path),)
    lines = capsys.readouterr().out.splitlines()
    assert ended.value.exit_code == 1
    assert "Not computed: 22 cases." in lines[-23] and lines[-22] == "  claims: C01: ValueError: planted"
    assert lines[-2:] == ["  claims: and 2 more", f"    tracebacks: {path}"]
    page = (tmp_path / "report" / "claims.html").read_text(encoding="utf-8")
    assert "Not computed: 22 of claims" in page and "C22: ValueError: planted" in page


def test_a_figure_that_raises_costs_that_figure_only(
    monkeypatch: Patch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(_inputs: object) -> Figure:
        raise ValueError("planted")

    def whole(_inputs: object) -> Figure:
        return Figure("whole", "", "A figure", "caption", (Panel("<svg />", "alt"),))

    recipes = tuple(Recipe(key, "", key, (), draw, "hero") for key, draw in (("broken", broken), ("whole", whole)))
    monkeypatch.setattr(reproduce, "RECIPES", recipes)
    monkeypatch.setattr(reproduce, "gather", lambda *_: Evidence())
    with pytest.raises(typer.Exit) as ended:
        reproduce.make_report(tmp_path, "quick", {})
    assert ended.value.exit_code == 1
    path = tmp_path / "tables" / "figures-failed.txt"
    last = capsys.readouterr().out.splitlines()[-2:]
    assert last == ["  figures: broken: ValueError: planted", f"    tracebacks: {path}"]
    assert "in broken" in path.read_text(encoding="utf-8")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Not computed in this run" in page and 'id="whole"' in page


def test_a_column_without_rows_has_no_outcome() -> None:
    assert Table((Column("a"),)).passed is None

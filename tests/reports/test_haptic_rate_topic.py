"""The topic on the haptic rate: a miss is called a miss, an absent engine is named, every table fits its headings."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import typer

from reports.commands import bench as command
from reports.evidence.effects import summary
from reports.evidence.haptic_rate import topic_of
from reports.figures import anytime, effect_costs, impact_scaling, trajectory_precision
from reports.pages.records import SceneEffect
from verification.cost.against_mujoco import PartTime, StepRace
from verification.cost.anytime import BudgetRow
from verification.cost.haptic_rate import FACTORED, PRINTED, RateTrial
from verification.cost.kernels import KernelTime, quartiles
from verification.cost.many_bodies import StepCost
from verification.cost.scaling import Timing
from verification.cost.start_up import StartUp
from verification.cost.step_cost import IAPB, KERNEL, CostRow
from verification.cost.study import HapticStudy
from verification.cost.trajectories import TrajectoryRun
from verification.finding import LIMITED, NOT_COMPUTED, REPRODUCED, Failure, Finding, Table
from verification.mechanics.robot_timing import MANY, ONE


def _race(ratio: float) -> StepRace:
    times = [quartiles([value]) for value in (1e-6, 1e-6 / ratio, ratio)]
    return StepRace("peg in the corner", "box", "Newton", 4, 8, *times, 0.0, 0.0)


def _cost(solver: str, seconds: float) -> CostRow:
    return CostRow("patch", 4, 6, solver, "solved", seconds, seconds, seconds, 3, 0.0)


def _run(method: str, step: float, error: float, seconds: float, status: str = "ok") -> TrajectoryRun:
    return TrajectoryRun("ball", method, step, status, "", error, error, error, seconds)


@pytest.fixture
def study() -> HapticStudy:
    """Everything as asked for."""
    parts = (("whole step", 1e-6), ("contacts found", 6e-7), ("record", 1e-7), ("device", 5e-8))
    robots: tuple[dict[str, Any], ...] = tuple(
        {"robot": "arm", "velocities": 6, "quantity": "bias", "form": form, "time": 1.0, "Pinocchio": 1.0,
         "ratio": 0.9, "lower quartile": 0.8, "upper quartile": 1.0} for form in (ONE, MANY)
    )  # fmt: skip
    sizes = [("factored", 12, c) for c in (50, 500)] + [("gram_pinv", 12, c) for c in (50, 500)]
    sizes += [(method, d, 60) for method in ("factored", "gram_pinv") for d in (3, 6)]
    return HapticStudy(
        races=(_race(0.05),), without_mujoco="",
        parts=tuple(PartTime("peg in the corner", name, quartiles([t])) for name, t in parts),
        kernels=(KernelTime(12, 60, quartiles([1e-6]), quartiles([2e-5])),),
        solvers=(_cost(IAPB, 1e-4), _cost(KERNEL, 1e-6), _cost("daqp", 3e-4), _cost("Lemke kernel", 2e-6)),
        scaling=tuple(Timing(name, d, c, quartiles([1e-8 * c * d])) for name, d, c in sizes),
        trials=(RateTrial(FACTORED, 3, 600, 0, 1e-4), RateTrial(PRINTED, 3, 60, 0, 5e-4)),
        bodies=tuple(StepCost(n, 1e-6 * n, 1.0, 1, n * n, n) for n in (20, 100, 200)),
        robots=robots, robots_of="made up", start_up=(StartUp("iapb --help", 0.4, 0.3, 1, 0.5),),
        budgets=tuple(BudgetRow(6, 24, 4, budget, 3, 0.1, 0.2, 0.0, budget / 4) for budget in range(5)),
        trajectories=(
            _run("IAPB, midpoint", 1e-3, 1e-3, 1e-3), _run("PB, midpoint", 1e-3, 1.0, 1e-3),
            _run("MuJoCo", 1e-3, 1e-2, 1e-2), _run("MuJoCo", 1e-4, np.nan, 3.0, "timed out"),
        ),
    )  # fmt: skip


def test_what_is_as_asked_for_is_said_to_be(study: HapticStudy) -> None:
    topic = topic_of(study)
    assert {part.verdict for part in topic.parts} == {REPRODUCED}
    assert "0.05 times MuJoCo's as box (8 contacts" in topic.parts[0].sentence
    for table in topic.tables.values():
        assert all(len(row) == len(table.columns) for row in table.rows)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"races": (_race(0.4),)}, "contacts found 60 %"),
        ({"kernels": (KernelTime(12, 60, quartiles([1e-6]), quartiles([5e-6])),)}, "5 times as long"),
        ({"solvers": (_cost(IAPB, 1e-4), _cost(KERNEL, 1e-6), _cost("daqp", 3e-5))}, "daqp on the patch at 4 contacts"),
        ({"start_up": (StartUp("iapb --help", 0.9, 0.8, 1, 0.5),)}, "iapb --help takes 0.90 s"),
        ({"bodies": tuple(StepCost(n, 1e-9 * n**2, 1.0, 1, n, n) for n in (20, 200))}, "power 2.00"),
        ({"budgets": (BudgetRow(6, 24, 4, 2, 3, 0.1, 0.2, 1e-16, 0.5),)}, "gains energy in 1 of 1"),
    ],
)
def test_a_miss_is_called_one(study: HapticStudy, change: dict[str, Any], words: str) -> None:
    missed = [part.sentence for part in topic_of(replace(study, **change)).parts if part.verdict == LIMITED]
    assert len(missed) == 1 and words in missed[0]


def test_an_absent_engine_is_named(study: HapticStudy) -> None:
    first = topic_of(replace(study, races=(), without_mujoco="mujoco is not installed")).parts[0]
    assert first.verdict == NOT_COMPUTED and "not installed" in first.sentence


def test_figures_draw_every_method_and_failure(study: HapticStudy) -> None:
    inputs = {f"haptic-rate/{name}": table for name, table in topic_of(study).tables.items()}
    motions = trajectory_precision.draw(inputs)
    assert len(motions.panels) == 3
    assert [name for name, _ in motions.legend] == ["IAPB, midpoint", "PB, midpoint", "MuJoCo"]
    without = {**inputs, trajectory_precision.INPUT: replace(
        inputs[trajectory_precision.INPUT],
        rows=tuple(row for row in inputs[trajectory_precision.INPUT].rows if row[8] == "ok"))}  # fmt: skip
    assert motions.panels[0].svg != trajectory_precision.draw(without).panels[0].svg
    assert len(impact_scaling.draw(inputs).panels) == len(anytime.draw(inputs).panels) == 2


def test_the_front_of_effects_is_pareto() -> None:
    effects = {"scene": (
        SceneEffect("cheap", True, "", saved=0.1, position=0.0), SceneEffect("dear", True, "", saved=0.4, position=1.0),
        SceneEffect("bad", True, "", saved=0.1, position=2.0), SceneEffect("off", False, ""),
    )}  # fmt: skip
    table = summary(effects)
    assert {row[1]: row[4] for row in table.rows} == {"cheap": "yes", "dear": "yes", "bad": "no"}
    assert len(effect_costs.draw({effect_costs.INPUT: table}).panels) == 1


def test_bench_ends_with_1_where_a_row_failed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    failed = Failure("impact of 4 contacts", "SolverError", "no solution")
    topic = Finding("haptic-rate", "The haptic rate", "", "", NOT_COMPUTED, failures=(failed,))
    monkeypatch.setattr(command, "haptic_study", lambda *_: None)
    monkeypatch.setattr(command, "topic_of", lambda _: topic)
    monkeypatch.setattr(command.accuracy, "compute", lambda _: Table(()))
    monkeypatch.setattr(command, "_methods", lambda _: "")
    with pytest.raises(typer.Exit) as ended:
        command.bench(False, False)
    assert ended.value.exit_code == 1 and "Not computed: impact of 4 contacts: SolverError" in capsys.readouterr().out
    monkeypatch.setattr(command, "topic_of", lambda _: replace(topic, failures=()))
    command.bench(False, False)

"""Everything that `iapb bench` measures beside the impact methods, in one run: every number is a ratio of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from iapb.errors import MissingDependencyError
from verification.cost.against_mujoco import PartTime, StepRace, profile_step, race_mujoco
from verification.cost.anytime import BudgetRow, anytime
from verification.cost.haptic_rate import RateTrial, haptic_rate
from verification.cost.kernels import KernelTime, kernel_times
from verification.cost.many_bodies import StepCost, study_many_bodies
from verification.cost.resting_scenes import resting_scenes
from verification.cost.scaling import Timing, scaling
from verification.cost.start_up import StartUp, start_up
from verification.cost.step_cost import CostRow, impact_cost
from verification.cost.trajectories import TrajectoryRun, trajectory_precision
from verification.finding import Failure, attempt
from verification.mechanics.own_robots import SHIPPED
from verification.mechanics.robot_timing import time_robots
from verification.mechanics.robots import robot_files

SIZES = ((12, 60), (12, 300))  # (d, c) at which the printed formula is to be ten and a hundred times slower
SOLVER_CONTACTS = {"quick": (1, 4, 16, 64), "full": (1, 4, 16, 64, 128, 300)}

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class HapticStudy:
    """Records of one run.

    races : empty where MuJoCo is not installed, then `without_mujoco` says so
    failures : the cases that raised, which are in nothing else
    robots : rows of `verification.mechanics.robot_timing`; `robots_of` says whose robots they are
    """

    races: tuple[StepRace, ...]
    without_mujoco: str
    parts: tuple[PartTime, ...]
    kernels: tuple[KernelTime, ...]
    solvers: tuple[CostRow, ...]
    scaling: tuple[Timing, ...]
    trials: tuple[RateTrial, ...]
    bodies: tuple[StepCost, ...]
    robots: tuple[dict[str, Any], ...]
    robots_of: str
    start_up: tuple[StartUp, ...]
    budgets: tuple[BudgetRow, ...]
    trajectories: tuple[TrajectoryRun, ...]
    failures: tuple[Failure, ...] = ()


def haptic_study(depth: str = "quick", progress: Progress | None = None) -> HapticStudy:
    """Measure all of it, one after the other: nothing else of ours runs meanwhile."""
    full, say = depth == "full", progress or (lambda stage, done, total: None)

    def within(stage: str) -> Callable[[int, int], None]:
        return lambda done, total: say(stage, done, total)

    failures: list[Failure] = []
    races, missing = _races(20 if full else 9, within("a step against MuJoCo"), failures)
    parts = tuple(part for scene in resting_scenes() for part in attempt(
        f"parts of a step, {scene.name}", partial(profile_step, scene, 15 if full else 7), failures) or ())
    robots, robots_of = attempt("robots", partial(_robots, depth), failures) or ((), "")
    say("printed formula and solvers", 0, 1)
    found = HapticStudy(
        races, missing, parts, kernel_times(SIZES, 40 if full else 7, failures=failures),
        impact_cost(SOLVER_CONTACTS[depth], repeats=5 if full else 3, progress=say, failures=failures),
        scaling(15 if full else 7, within("scaling laws"), failures),
        haptic_rate(progress=within("contacts at 1 kHz"), failures=failures),
        study_many_bodies(failures=failures), robots, robots_of, start_up(depth, failures),
        anytime(40 if full else 15, progress=within("budgets"), failures=failures),
        trajectory_precision(depth=depth, progress=within("whole motions"), failures=failures),
    )  # fmt: skip
    return replace(found, failures=tuple(failures))


def _races(
    rounds: int, progress: Callable[[int, int], None], failures: list[Failure]
) -> tuple[tuple[StepRace, ...], str]:
    try:
        return race_mujoco(rounds=rounds, progress=progress, failures=failures), ""
    except MissingDependencyError as error:
        return (), str(error)


def _robots(depth: str) -> tuple[tuple[dict[str, Any], ...], str]:
    """The robots of others where they are, else the project's own."""
    files, _ = robot_files()
    found = time_robots(None if files else SHIPPED / "robots", depth)
    return tuple(found.records()), "robots of others" if files else "the project's own robots"

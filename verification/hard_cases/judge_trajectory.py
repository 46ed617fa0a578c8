"""Judge a world on a trajectory case: it must neither make energy nor leave the law by more than its step excuses."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import numpy as np

from iapb.errors import IapbError
from iapb.run import Run
from iapb.scene import Scene
from verification.hard_cases.case import Measured, TrajectoryCase
from verification.hard_cases.restitution import restitution_residual
from verification.hard_cases.verdict import RESTITUTION_TOLERANCE, HardCaseVerdict

Simulate = Callable[[Scene, str], Run]

COULOMB = "ideal with friction"  # the rigid world with Coulomb's law; the paper's rigid worlds have no friction


def run_in_world(scene: Scene, world: str) -> Run:
    """Simulate a scene in one of the paper's worlds, or in the rigid one with Coulomb friction."""
    from reference.worlds import require_complete, run_world

    if world != COULOMB:
        return run_world(scene, world)
    from iapb.simulation import simulate
    from reference.time_stepping import RigidConstraints

    return require_complete(simulate(scene, RigidConstraints(friction="coulomb"), world=world))


@cache
def _warm_up() -> None:
    """Compile the step before any clock runs: a short run is timed as one piece."""
    from iapb.scene import find_scene, load_scene
    from iapb.simulation import simulate

    simulate(load_scene(find_scene("two_discs")), steps=1)


def judge_trajectory(case: TrajectoryCase, world: str, simulate: Simulate = run_in_world) -> HardCaseVerdict:
    """Return the verdict of one world on one motion."""
    _warm_up()
    try:
        run = (run_in_world if world == COULOMB else simulate)(case.scene, world)
    except IapbError as error:
        verdict = "refused" if isinstance(error, ValueError) else "failed"
        return HardCaseVerdict(case.name, world, verdict, str(error), exact_rank=None)
    found, residual = case.measure(run), restitution_residual(run)
    return HardCaseVerdict(
        case.name, world, _verdict(found, residual), "", found.energy_gain, found.energy_bound, residual,
        found.error, found.error_bound, int(run.impacts.rank.max(initial=0)), None,
        float(run.impacts.clamp.min(initial=1.0)), _seconds_per_step(run),
    )  # fmt: skip


def _verdict(found: Measured, residual: float) -> str:
    if not found.energy_gain <= found.energy_bound:
        return "gains energy"
    if residual > RESTITUTION_TOLERANCE:  # NaN: no collision to judge
        return "restitution unmet"
    if not (math.isnan(found.error_bound) or found.error <= found.error_bound):
        return "wrong motion"
    return "stable"


def _seconds_per_step(run: Run) -> float:
    return float(np.median(run.chunk_seconds / run.chunk_steps)) if len(run.chunk_steps) else math.nan

"""Judge methods and worlds on hard cases; each pair of case and method gets one verdict with its numbers.

A world must create no energy, and its error may not exceed the error that its time step may cause.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import cache

import numpy as np

from iapb.errors import ArgumentError, IapbError
from iapb.names import one_of
from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene
from iapb.simulation import simulate
from reference.one_thread import one_thread
from reference.time_stepping import RigidConstraints
from reference.worlds import require_complete, run_world
from verification.finding import Failure, of_each
from verification.hard_cases.case import (
    COULOMB,
    RESTITUTION_TOLERANCE,
    AnyCase,
    CaseAbsent,
    HardCase,
    HardCaseVerdict,
    Measured,
    TrajectoryCase,
    smallest_fault,
)
from verification.hard_cases.catalogue import HARD_CASES
from verification.hard_cases.judge_impact import METHODS, judge_impact

Simulate = Callable[[Scene, str], Run]
_STILL = 1e-9  # [m, rad] largest displacement by rounding and by settling springs


def run_in_world(scene: Scene, world: str) -> Run:
    """Simulate a scene in one of the paper's worlds, or in the rigid one with Coulomb friction."""
    if world != COULOMB:
        return run_world(scene, world)
    return require_complete(simulate(scene, RigidConstraints(friction="coulomb"), world=world))


def judge_hard_cases(
    methods: Iterable[str] | None = None, cases: Iterable[str] | None = None, simulate: Simulate = run_in_world,
    failures: list[Failure] | None = None,
) -> tuple[HardCaseVerdict, ...]:
    """Return the verdict of each method or world on each case.

    Parameters
    ----------
    methods : names of impact methods and of worlds; by default the methods or worlds of each case.
    cases : names in `HARD_CASES`, by default all of them. Cases whose files are absent are left out;
        `HARD_CASES[name]()` raises `CaseAbsent` with the reason.
    simulate : function that runs a scene in a world: ``simulate(scene, world) -> Run``.
    failures : receives exceptions other than `IapbError`, which is a verdict; without this list they propagate.

    Returns
    -------
    tuple of HardCaseVerdict
        One verdict for each pair of case and method, with its numbers.

    Raises
    ------
    ArgumentError
        A name in `cases` is not in `HARD_CASES`.
    """
    wanted = None if methods is None else tuple(methods)
    names = tuple(HARD_CASES if cases is None else cases)
    for name in names:
        if name not in HARD_CASES:
            raise ArgumentError("cases", name, one_of(name, HARD_CASES))
    found = (verdict for name in names for verdict in _of(name, wanted, simulate, failures))
    with one_thread():
        return tuple(found)


def methods_for(case: AnyCase) -> tuple[str, ...]:
    """Return the impact methods or the worlds that are judged on a case."""
    if isinstance(case, HardCase):
        return METHODS if case.methods is None else case.methods
    return case.worlds


def judge_hard_case(case: AnyCase, method: str, simulate: Simulate = run_in_world) -> HardCaseVerdict:
    """Return the verdict of one method on one impact, or of one world on one trajectory."""
    if isinstance(case, HardCase):
        return judge_impact(case, method)
    return _judge_motion(case, method, simulate)


def _of(
    name: str, wanted: tuple[str, ...] | None, simulate: Simulate, failures: list[Failure] | None
) -> Iterator[HardCaseVerdict]:
    try:
        case = HARD_CASES[name]()
    except CaseAbsent:
        return
    methods = (method for method in methods_for(case) if wanted is None or method in wanted)
    yield from of_each(methods, lambda method: [judge_hard_case(case, method, simulate)], failures,
                       lambda method: f"{name}, {method}")  # fmt: skip


@cache
def _warm_up() -> None:
    """Compile the step before the timed runs."""
    simulate(load_scene(find_scene("two_discs")), steps=1)


def _judge_motion(case: TrajectoryCase, world: str, simulate: Simulate) -> HardCaseVerdict:
    """Return the verdict of one world on one motion."""
    _warm_up()
    try:
        run = (run_in_world if world == COULOMB else simulate)(case.scene, world)
    except IapbError as error:
        verdict = "refused" if isinstance(error, ValueError) else "failed"
        return HardCaseVerdict(case.name, world, verdict, str(error), exact_rank=None)
    found, residual = case.measure(run), restitution_residual(run)
    verdict, fault = _motion_verdict(found, residual), math.nan
    if verdict == "stable":
        fault = smallest_fault(lambda f: not _keeps_its_law(case, faulty_motion(run, f)))
    return HardCaseVerdict(
        case.name, world, verdict, "", found.energy_gain, found.energy_bound, residual,
        found.error, found.error_bound, int(run.impacts.rank.max(initial=0)), None,
        float(run.impacts.clamp.min(initial=1.0)), _seconds_per_step(run), fault,
    )  # fmt: skip


def faulty_motion(run: Run, fault: float) -> Run:
    """Return the run with all displacements and changes of velocity increased by the share `fault`.

    If nothing moves in the run, all coordinates creep instead at this share of the scene's v_threshold.
    """
    moved, sped = run.q - run.q[0], run.v - run.v[0]
    if np.abs(moved).max() < _STILL:
        creep = run.scene_resolved["contact"]["friction_velocity"]
        moved, sped = creep * run.time[:, None] * np.ones_like(moved), creep * np.ones_like(sped)
    return replace(run, q=run.q + fault * moved, v=run.v + fault * sped)


def _keeps_its_law(case: TrajectoryCase, run: Run) -> bool:
    """Return whether the error of the motion is within its bound; a planted fault does not change the energies."""
    found = case.measure(run)
    return found.error <= found.error_bound


def _motion_verdict(found: Measured, residual: float) -> str:
    if not found.energy_gain <= found.energy_bound:
        return "gains energy"
    if residual > RESTITUTION_TOLERANCE:  # False for NaN: the run has no collision to judge
        return "restitution unmet"
    if not found.error <= found.error_bound:
        return "wrong motion"
    return "stable"


def _seconds_per_step(run: Run) -> float:
    return float(np.median(run.chunk_seconds / run.chunk_steps)) if len(run.chunk_steps) else math.nan


def restitution_residual(run: Run) -> float:
    """Return the largest |P·v⁺ + e P·v⁻| / P·(v⁺ − v⁻) of all collisions; NaN if there is no collision to judge.

    P = Jᵀp is the generalized impulse of a collision, so P·v sums the normal velocities with the impulses as weights,
    and P·(v⁺ − v⁻) = |Δu|² > 0. If every row satisfies J v⁺ = −e J v⁻, the residual is zero. For a rigid world the
    result is NaN, because its impulses also close gaps and carry the forces of the step.
    """
    if run.law == "rigid constraints":
        return math.nan
    e = float(run.scene_resolved["contact"]["restitution"])
    before, after = (np.einsum("kd,kd->k", run.impacts.impulse, v) for v in (run.impacts.v_minus, run.impacts.v_plus))
    struck = after - before > 0.0
    if not struck.any():
        return math.nan
    return float(np.max(np.abs(after + e * before)[struck] / (after - before)[struck]))

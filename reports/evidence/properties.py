"""Stages: the laws on random impacts, engine and trajectories, the planted faults; the bulk study of energy gains."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from iapb import resolve_impact
from reports.pages.records import Property
from verification.finding import Failure, Table, attempt, of_each, titled
from verification.laws import LAWS, PLANTED_BUGS, bulk_impacts, check_passivity
from verification.laws.engine_laws import ENGINE_LAWS, judge_engine_law
from verification.laws.kit import residual_count
from verification.laws.planted_runs import PLANTED_ENGINE_FAULTS, PLANTED_TRAJECTORY_FAULTS, first_occasion
from verification.laws.scenes import draw_scene
from verification.laws.scenes_space import draw_spatial_scene
from verification.laws.trajectory_laws import TRAJECTORY_LAWS, Trajectory

IMPACTS = {"quick": 100_000, "full": 1_000_000}
COMPARED_IMPACTS = {"quick": 10_000, "full": 100_000}  # of the variants shown beside it
KIT_IMPACTS, FAULT_IMPACTS = 1500, 400
ENGINE_CASES, SIMULATED, FAULT_CASES = 300, 20, 60  # cases of a law; of one that simulates each; with a fault
TRAJECTORIES, IN_SPACE, TRAJECTORY_STEPS = 60, 40, 300
SEED = 20050601
Progress = Callable[[int, int], None]


def compute(progress: Progress, failures: list[Failure]) -> tuple[Property, ...]:
    """Every law on our resolver, on what else the engine does, and along trajectories; each with a planted fault."""
    records: list[Property] = []
    total = len(LAWS) + len(ENGINE_LAWS) + len(TRAJECTORY_LAWS)
    for record in (*_impact_laws(failures), *of_each(ENGINE_LAWS, _engine_law, failures), *_trajectory_laws(failures)):
        records.append(record)
        progress(len(records), total)
    return tuple(records)


def _impact_laws(failures: list[Failure]) -> Iterator[Property]:
    """The kit on our resolver; a law that no planted bug names has none."""
    first: dict[str, tuple[str, Any]] = {}
    for name, bug in PLANTED_BUGS.items():
        first.setdefault(bug.caught_by, (name, bug))

    def judged(verdict: Any) -> Iterator[Property]:
        if verdict.error is not None:
            raise verdict.error
        fault, caught = "", None
        if verdict.law in first:
            fault, bug = first[verdict.law]
            broken = check_passivity(bug.make(), impacts=FAULT_IMPACTS, search=0)
            caught = verdict.law in broken.broken_laws
        yield _property(verdict.statement, verdict.checked, verdict.worst, verdict.passed, fault, caught)

    kit = partial(check_passivity, resolve_impact, impacts=KIT_IMPACTS, search=0)
    report = attempt("laws of impacts", kit, failures)
    if report is not None:
        yield from of_each(report.verdicts, judged, failures, lambda verdict: verdict.law)


def _engine_law(name: str) -> Iterator[Property]:
    import numpy as np

    cases = SIMULATED if name in ("group_splitting", "device_port") else ENGINE_CASES
    verdict, (fault, make) = judge_engine_law(name, cases=cases, seed=SEED), PLANTED_ENGINE_FAULTS[name]
    with np.errstate(all="ignore"):  # the faults compute with what overflows
        caught = not judge_engine_law(name, make(), cases=min(cases, FAULT_CASES), seed=SEED).passed
    yield _property(verdict.statement, verdict.checked, verdict.worst, verdict.passed, fault, caught)


def _trajectory_laws(failures: list[Failure]) -> Iterator[Property]:
    import numpy as np

    rng = np.random.default_rng(SEED)
    scenes = [draw_scene(rng, TRAJECTORY_STEPS) for _ in range(TRAJECTORIES)]
    scenes += [draw_spatial_scene(rng, TRAJECTORY_STEPS) for _ in range(IN_SPACE)]
    runs = list(of_each(enumerate(scenes, 1), lambda case: [case[1].simulate()], failures,
                        lambda case: f"trajectory of random scene {case[0]}"))  # fmt: skip
    trajectories, finite = [Trajectory(run) for run in runs], TRAJECTORY_LAWS["finite"]
    sound = attempt("finite", lambda: [(one, finite.check(one)) for one in trajectories], []) or ()
    whole = [one for one, found in sound if found is None or found.passed] or trajectories

    def judged(name: str) -> Iterator[Property]:
        law = TRAJECTORY_LAWS[name]
        residuals = (law.check(one) for one in (trajectories if name == "finite" else whole))
        found = residual_count(residual for residual in residuals if residual is not None)
        run = first_occasion(name, scenes)
        residual = law.check(Trajectory(run)) if run is not None else None
        caught = residual is not None and not residual.passed
        fault = PLANTED_TRAJECTORY_FAULTS[name].__name__
        statement = f"along a trajectory: {law.statement}"
        yield _property(statement, found.checked, found.worst, not found.failures, fault, caught)

    yield from of_each(TRAJECTORY_LAWS, judged, failures)


def _property(law: str, cases: int, worst: Any, holds: bool, fault: str, caught: bool | None) -> Property:
    return Property(law, cases, f"{worst.value:.1e}" if worst else "does not apply",
                    f"{worst.tolerance:.1e}" if worst else "", holds, fault.replace("_", " "), caught)


def bulk(depth: str, progress: Progress, failures: list[Failure]) -> Table:
    """100,000 random impacts: energy gain against 10 d ε √κ(M), with and without the clamp, and the printed formula."""
    studies: tuple[tuple[str, str, bool | None, int], ...] = (
        ("factored", "factored", None, IMPACTS[depth]),
        ("factored, no clamp", "factored", False, COMPARED_IMPACTS[depth]),
        ("gram_pinv, as printed", "gram_pinv", None, COMPARED_IMPACTS[depth]),
    )
    total, before = sum(study[3] for study in studies), itertools.accumulate((s[3] for s in studies), initial=0)

    def rows_of(study: tuple[str, str, bool | None, int]) -> Iterator[tuple[Any, ...]]:
        base = next(before)
        return _bulk_rows(*study, lambda done, _: progress(base + done, total))

    rows = of_each(studies, rows_of, failures, lambda study: study[0])
    return titled(
        ("method", "condition of M from", "impacts", "largest relative energy gain", "gain / (10 d ε √κ)",
         "gain / (d ε κ)", "above 10 d ε √κ", "largest restitution residual"), tuple(rows), 3,
        "d 1 to 30, c 0 to 100, rank deficient, e in [−1, 1]; velocities N(0, I) in v and in Lᵀv; energies in "
        "double-double.")


def _bulk_rows(
    label: str, method: str, clamp: bool | None, count: int, progress: Callable[..., None]
) -> Iterator[tuple[Any, ...]]:

    result = bulk_impacts(count, SEED, method, clamp, progress=progress)
    for row in result.by_condition():
        yield (label, f"1e{row.decade}", row.impacts, row.worst_gain, row.worst_gain_over_bound,
               row.worst_gain_over_cholesky_bound, row.above_bound, row.worst_residual)
    yield (label, "all", count, float(result.gain.max()), result.worst_ratio,
           float((result.gain / result.cholesky_bound).max()), result.above_bound, float(result.residual.max()))

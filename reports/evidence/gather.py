"""Collect all evidence of a report, stage by stage."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, as_completed
from contextlib import suppress
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

from iapb.errors import IapbError
from reference.one_thread import one_thread
from reports.evidence import runs
from reports.evidence.depends import depends_of
from reports.evidence.stage import Stage
from reports.evidence.topics import AHEAD, CLAIM_STAGES, TOPICS, failed_topic, plans
from reports.figures.paper import arm_energies
from reports.pages.records import Evidence, FailedCases
from reports.provenance import PEERS, collect_provenance
from reports.runner import Runner
from reports.store.io import write_whole
from reports.store.keys import evidence_version
from reports.workers import REPORT_WORKERS, executor
from verification import check, haptic_rate
from verification.claims.numbers import claim_tables
from verification.cost import effects
from verification.cost.accuracy import numbers_of, recommended
from verification.finding import Failure, Finding, attempt
from verification.laws import bulk
from verification.mechanics import against_pinocchio, definiteness
from verification.numbers import value_tables
from verification.proofs import numbers as exact_numbers
from verification.proofs import on_proofs
from verification.proofs.coq import checked

Progress = Callable[[str, int, int], None]

# studies that draw random numbers
SEEDS = {
    "claims": check.SEED,
    "impacts": bulk.SEED,
    "proofs": exact_numbers.SEED,
    "robots": against_pinocchio.SEED,
    "mass matrices": definiteness.SEED,
}
FIGURE_RUNS = "runs of the figures"
CERTIFIED = "energy"  # the stage that needs all runs of the others
# The first stages to be computed are the longest.
FIRST = ("proofs", "hard-cases", "claims on the peg", "claims", "energy, without times")
BESIDE = "parts that measure no time"


def gather(out: Path, depth: str, progress: Progress) -> Evidence:
    """Compute or read everything that the report shows; runs/ and tables/ are written in `out`.

    First the stages that measure no time are computed beside each other, in processes; then all
    others, one after the other, in this process.
    """
    runner = Runner(out / "runs")
    stages = {
        name: Stage(out / "tables", name, plan.kind, depth, depends_of(name))
        for name, plan in plans().items()
    }
    _compute_beside(stages, out, depth, progress)
    lost: list[Failure] = []
    read = attempt(
        "all of it", partial(runs.figure_runs, runner, partial(progress, FIGURE_RUNS), lost), lost
    )
    tilted = attempt(runs.TILTED, partial(runs.tilted_runs, runner), lost)
    for stage in stages.values():
        ahead = stages.get(stage.name + AHEAD)
        fresh = not stage.path.is_file()
        _fill(stage, runner, depth, progress, ahead)
        if ahead is not None and fresh:
            ahead.failures.clear()  # the topic has tried these cases again

    found = [claim for name in CLAIM_STAGES for claim in stages[name].records or ()]
    ledger = tuple(sorted(found, key=lambda claim: claim.key))
    scene_effects = dict(stages["effects"].records or {})
    step_times = scene_effects.pop(effects.STEPS, None)
    measured = stages["accuracy"].records
    best = recommended(measured) if measured else None
    seconds = {stage.name: stage.seconds for stage in stages.values()}
    spent = {"stages": len(seconds), "spent_us": 1e6 * sum(seconds.values())}
    quoted = {"claims": claim_tables(ledger, lost), "data": value_tables({}, spent)}
    if step_times and step_times.rows:
        quoted["effects"] = value_tables({}, effects.numbers_of(step_times))
    if best:
        quoted["accuracy"] = value_tables({}, numbers_of(best))
    inputs = {
        **(read or {}),
        runs.CORNER_SCENE: runs.corner_scene(),
        runs.TILTED: tilted,
        "arm_energies": arm_energies(),
        "work_precision": measured,
        "recommended": best,
        "effect_steps": step_times,
        "effect_matrix": effects.matrix(scene_effects) if scene_effects else None,
    }
    failed = failed_cases(
        out / "tables", {FIGURE_RUNS: lost} | {one.name: one.failures for one in stages.values()}
    )
    return Evidence(
        inputs=inputs,
        claims=ledger,
        effects=scene_effects,
        numbers=quoted,
        topics=tuple(_topics(stages, ledger)),
        failed=failed,
        provenance=provenance(),
        runs=tuple(runner.used.values()),
        seconds=seconds,
    )


def _topics(stages: Mapping[str, Stage], ledger: tuple[Finding, ...]) -> Iterator[Finding]:
    """Yield the topics; a stage that failed has a substitute, which says why."""
    for name in CLAIM_STAGES:
        if stages[name].records is None:
            yield _failed(stages[name])
    for name in TOPICS:
        topic = stages[name].records or _failed(stages[name])
        speed = name == haptic_rate.TOPIC.key
        yield haptic_rate.quoting(topic, ledger) if speed else topic
    yield _on_proofs(stages["proofs"])


def _on_proofs(stage: Stage) -> Finding:
    if stage.failures and not stage.records:
        return _failed(stage)
    return on_proofs(stage.records or (), stage.failures, development=checked.read())


def _failed(stage: Stage) -> Finding:
    return failed_topic(stage.name, stage.failures[-1])


@one_thread()
def _fill(
    stage: Stage, runner: Runner, depth: str, progress: Progress, ahead: Stage | None = None
) -> Stage:
    """Read or compute the records of a stage, unless it has been done; `ahead` has tables of its
    checks."""
    plan = plans()[stage.name]
    said = partial(progress, stage.name)
    known = {"known": ahead.records} if ahead is not None and not ahead.failures else {}
    if stage.records is None and not stage.failures:
        stage.fill(runner, lambda failures: plan.compute(runner, depth, said, failures, **known))
        said(1, 1)
    for run in stage.runs.values():
        runner.use(run)
    return stage


def _compute_beside(stages: dict[str, Stage], out: Path, depth: str, progress: Progress) -> None:
    """Compute the missing stages that measure no time, each in a process, and put them into
    `stages`.

    If a worker is killed because memory ran out, its stage stays missing; it is computed alone
    after that.
    """
    order = sorted(stages, key=lambda name: FIRST.index(name) if name in FIRST else len(FIRST))
    missing = [name for name in order if not stages[name].path.is_file()]
    ahead = [name for name in missing if not (plans()[name].timed or name == CERTIFIED)]
    if not ahead:
        return
    with suppress(IapbError), executor(REPORT_WORKERS) as pool:
        jobs: list[Future[Any]] = [pool.submit(_figure_runs, out)]
        for name in ahead:
            jobs.append(pool.submit(_fill, stages[name], Runner(out / "runs"), depth, silent))
        progress(BESIDE, 0, len(jobs))
        for done, job in enumerate(as_completed(jobs), 1):
            stage = job.result()
            if isinstance(stage, Stage):
                stages[stage.name] = stage
            progress(BESIDE, done, len(jobs))


def silent(*_: Any) -> None:
    """Tell no progress, in a worker."""


def _figure_runs(out: Path) -> None:
    """Simulate the runs of the figures, in a worker; the parent reads them, and tries again those
    that fail."""
    runs.figure_runs(Runner(out / "runs"), silent, [])


def provenance() -> dict[str, str]:
    """Return the provenance of the report: date, machine and versions, all seeds, sources, and
    compared packages."""
    seeds = [f"{name} {seed}" for name, seed in SEEDS.items()]
    facts = collect_provenance(seeds=seeds, packages=PEERS)
    return {"date": datetime.now(UTC).date().isoformat()} | facts | {"sources": evidence_version()}


def failed_cases(
    folder: Path, failures: Mapping[str, Sequence[Failure]]
) -> tuple[FailedCases, ...]:
    """Return the failed cases of each stage; write their tracebacks to a file in `folder`, or
    remove an older file."""
    found = []
    for name, lost in failures.items():
        path = folder / f"{name.replace(' ', '_')}-failed.txt"
        path.unlink(missing_ok=True)
        if lost:
            write_whole(path, "\n".join(f"{one.case}\n{one.traceback}" for one in lost))
            found.append(FailedCases(name, tuple(lost), str(path)))
    return tuple(found)

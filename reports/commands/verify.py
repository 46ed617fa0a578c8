"""`iapb verify`: test an impact resolver; `--full`: on a million impacts."""

from __future__ import annotations

from collections import Counter
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from iapb.by_name import function_named
from reports.show import Answer, Json, stage_progress
from reports.store import write_run
from reports.workers import cores, executor
from verification import check_passivity
from verification.laws import CONTRACTS
from verification.laws.bounds import LawCount
from verification.laws.full import (
    IMPACTS,
    OF_ONE_CALL,
    ONE_IN,
    PARTS,
    Batch,
    Found,
    Outcome,
    Subject,
    as_pytest,
    judge_batch,
    plan,
    subject_of,
    summed,
)
from verification.laws.kit import CALL_LIMIT
from verification.laws.kit import IMPACTS as KIT_IMPACTS
from verification.laws.worlds import judge_world

ENGINE = "iapb:resolve_impact"
BROKEN_RUNS = Path("out/runs")  # folder of the scenes that break a law of --full
WORLD_SCENES = 100  # random scenes of --world
LAW_FIELDS = (
    "law",
    "statement",
    "checked",
    "failures",
    "severe",
    "largest",
    "fault",
)  # with --json


def verify(
    resolver: Annotated[
        str,
        typer.Option(
            help="package.module:function, called as (mass_matrix, contact_jacobian, velocity, restitution); with "
            "--contract frictional as (mass_matrix, contact_jacobian, tangents, velocity, restitution, friction)."
        ),
    ] = ENGINE,
    contract: Annotated[
        str, typer.Option(help=f"Contract of the resolver: {', '.join(CONTRACTS)}.")
    ] = "equality",
    laws: Annotated[
        list[str] | None,
        typer.Option(help="Only these laws, by name: kinetic_energy,pushing; may be repeated."),
    ] = None,
    impacts: Annotated[
        int | None, typer.Option(min=1, help="Random impacts; default 5000, with --full 1,000,000.")
    ] = None,
    seed: Annotated[
        int, typer.Option(min=0, max=2**63 - 1, help="Seed of the random impacts.")
    ] = 0,
    unequal: Annotated[
        bool, typer.Option("--unequal", help="Also pass one restitution per contact.")
    ] = False,
    own_process: Annotated[
        bool,
        typer.Option(
            "--own-process",
            help=f"Call the resolver in a process of its own; a call over {CALL_LIMIT:g} s is ended.",
        ),
    ] = False,
    full: Annotated[
        bool, typer.Option("--full", help="A million impacts and thousands of trajectories.")
    ] = False,
    trajectories: Annotated[int, typer.Option(min=0, help="Random scenes of --full.")] = 5000,
    workers: Annotated[
        int, typer.Option(min=0, max=512, help="Processes of --full; 0: one per core.")
    ] = 0,
    world: Annotated[
        str | None,
        typer.Option(
            help="Put a world to the laws of trajectories on random scenes instead: mujoco, or your engine as "
            "module:engine."
        ),
    ] = None,
    json_: Json = False,
) -> Answer:
    """Test an impact resolver against every law; print the verdict, the worst case and a shrunk
    counterexample."""
    if world is not None:
        return _of_world(world, seed)
    if full and (contract != "equality" or laws):
        raise typer.BadParameter("not with --full", param_hint="--contract, --laws")
    if full:
        return _full(resolver, impacts or 1_000_000, trajectories, seed, workers or cores())
    tested = function_named("--resolver", resolver)
    named = [name for given in laws or () for name in given.split(",") if name]
    with stage_progress() as progress:
        report = check_passivity(
            tested,
            contract=contract,
            laws=named if laws else None,
            impacts=impacts or KIT_IMPACTS,
            seed=seed,
            unequal_restitution=unequal,
            own_process=own_process,
            progress=lambda *done: progress(_stage(done[1], impacts or KIT_IMPACTS), *done),
        )
    facts = {
        name: getattr(report, name)
        for name in ("resolver", "contract", "impacts", "seed", "passed")
    } | {
        "unfinished": report.unfinished,
        "report": str(report),
        "laws": [{name: getattr(one, name) for name in LAW_FIELDS} for one in report.verdicts],
    }
    return Answer(facts, [str(report)], 0 if report.passed else 1)


def _stage(total: int, impacts: int) -> str:
    """Name of the stage of the kit with this total."""
    return "impacts" if total == impacts else "seconds of the search for a counterexample"


def _full(resolver: str, impacts: int, trajectories: int, seed: int, workers: int) -> Answer:
    """Judge many cases in worker processes, and list every law; Ctrl-C lists what was judged until
    then.

    A resolver of somebody else's is tested on impacts only.
    """
    subject = subject_of(function_named("--resolver", resolver), seed)
    batches = plan(impacts, trajectories, PARTS if resolver == ENGINE else (IMPACTS,))
    total: Counter[str] = Counter()
    done: Counter[str] = Counter()
    for batch in batches:
        total[batch.part] += batch.count
    judged: list[Outcome] = []
    stopped = False
    try:
        with stage_progress() as progress, executor(workers) as pool:
            outcomes = pool.map(partial(_judged, resolver, seed), batches)
            for batch, outcome in zip(batches, outcomes, strict=True):
                judged.append(outcome)
                done[batch.part] += batch.count
                progress(batch.part, done[batch.part], total[batch.part])
    except KeyboardInterrupt:
        stopped = True
    counts, found = summed(judged)
    lines = [
        f"{len(judged)} of {len(batches)} batches of cases{', then stopped' if stopped else ''}."
    ]
    for part, laws in counts.items():
        lines.append(f"{part}:")
        lines += [_line(count) for count in laws.values()]
    every = ", ".join(OF_ONE_CALL)
    lines.append(
        f"Of the laws of impacts, {every} are put to every one; each other to one in {ONE_IN}."
    )
    shown = [_shown(one, subject) for one in found]
    for one in shown:
        lines.append(
            f"\n{one['part']}, case {one['index']}, breaks {one['law']}. As a test:\n\n{one['test']}"
        )
        if one["run"]:
            lines.append(f"\nIts run: {one['run']}")
    facts = {
        "resolver": resolver,
        "seed": seed,
        "batches": len(batches),
        "judged": len(judged),
        "passed": not found,
        "laws": {part: list(laws.values()) for part, laws in counts.items()},
        "counterexamples": shown,
    }
    return Answer(facts, lines, 130 if stopped else int(bool(found)))


def _judged(resolver: str, seed: int, batch: Batch) -> Outcome:
    """Judge a batch in a worker process, which imports the resolver by its name."""
    return judge_batch(batch, subject_of(function_named("--resolver", resolver), seed))


def _shown(found: Found, subject: Subject) -> dict[str, Any]:
    """Return a counterexample with its test; the run of a scene is stored."""
    run = None
    if found.run is not None:
        name = f"{found.part.replace(' ', '_')}-seed{subject.seed}-{found.index}.h5"
        run = write_run(BROKEN_RUNS / name, found.run, replace=True)
    return {
        "part": found.part,
        "law": found.law,
        "index": found.index,
        "test": as_pytest(found, subject),
        "run": run,
    }


def _line(count: LawCount) -> str:
    """Return as text how many of the cases broke a law, and the worst residual with its
    tolerance."""
    mark = "BROKEN" if count.failures else "kept  "
    worst = f"; worst {count.worst.words}" if count.worst else ""
    return f"  {mark} {count.law}: {count.failures:,} of {count.checked:,} break it{worst}"


def _of_world(world: str, seed: int) -> Answer:
    """Put a world to the laws of trajectories on random scenes."""
    with stage_progress() as progress:
        counts, left_out = judge_world(
            world, WORLD_SCENES, seed, partial(progress, "random scenes")
        )
    judged = WORLD_SCENES - left_out
    ignoring = f"; {left_out} others have something that it ignores" if left_out else ""
    lines = [f"{world} on {judged} random scenes{ignoring}."]
    lines += [_line(count) for count in counts]
    passed = judged > 0 and not any(count.failures for count in counts)
    facts = {
        "world": world,
        "scenes": judged,
        "left_out": left_out,
        "passed": passed,
        "laws": counts,
    }
    return Answer(facts, lines, int(not passed))

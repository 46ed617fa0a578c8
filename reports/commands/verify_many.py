"""`iapb verify-many`: the laws on a hundred thousand impacts and thousands of trajectories."""

from __future__ import annotations

from collections import Counter
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from iapb.names import function_named
from reports.commands.verify import ENGINE
from reports.show import Answer, Json, stage_progress
from reports.store import write_run
from reports.workers import cores, executor
from verification.laws.bounds import LawCount
from verification.laws.full import (
    IMPACTS,
    PARTS,
    Batch,
    Found,
    Outcome,
    judge_batch,
    plan,
    summed,
)

BROKEN_RUNS = Path("out/runs")  # folder of the scenes that break a law


def verify_many(
    resolver: Annotated[
        str, typer.Option(help="package.module:function; another one is tested on impacts only.")
    ] = ENGINE,
    impacts: Annotated[int, typer.Option(min=1, help="Random impacts.")] = 100_000,
    trajectories: Annotated[int, typer.Option(min=0, help="Random scenes.")] = 5000,
    seed: Annotated[int, typer.Option(min=0, max=2**63 - 1, help="Seed of all cases.")] = 0,
    workers: Annotated[int, typer.Option(min=0, max=512, help="Processes; 0: one per core.")] = 0,
    json_: Json = False,
) -> Answer:
    """Test the laws on many impacts and trajectories; Ctrl-C lists what was found."""
    function_named("--resolver", resolver)  # refused here, not in a worker
    batches = plan(impacts, trajectories, PARTS if resolver == ENGINE else (IMPACTS,))
    total: Counter[str] = Counter()
    done: Counter[str] = Counter()
    for batch in batches:
        total[batch.part] += batch.count
    judged: list[Outcome] = []
    stopped = False
    try:
        with stage_progress() as progress, executor(workers or cores()) as pool:
            outcomes = pool.map(partial(_judged, resolver, seed), batches)
            for batch, outcome in zip(batches, outcomes, strict=True):
                judged.append(outcome)
                done[batch.part] += batch.count
                progress(batch.part, done[batch.part], total[batch.part])
    except KeyboardInterrupt:
        stopped = True
    counts, found = summed(judged)
    end = ", then stopped" if stopped else ""
    lines = [f"{len(judged)} of {len(batches)} batches of cases{end}."]
    for part, laws in counts.items():
        lines.append(f"{part}:")
        lines += [line_of(count) for count in laws.values()]
    shown = [_shown(one, seed) for one in found]
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
    return judge_batch(batch, function_named("--resolver", resolver), seed)


def _shown(found: Found, seed: int) -> dict[str, Any]:
    """Return a counterexample with its test; the run of a scene is stored."""
    run = None
    if found.run is not None:
        name = f"{found.part.replace(' ', '_')}-seed{seed}-{found.index}.h5"
        run = write_run(BROKEN_RUNS / name, found.run, replace=True)
    return {
        "part": found.part,
        "law": found.law,
        "index": found.index,
        "test": found.test,
        "run": run,
    }


def line_of(count: LawCount) -> str:
    """Return as text how many of the cases broke a law, and the worst residual with its
    tolerance."""
    mark = "BROKEN" if count.failures else "kept  "
    worst = f"; worst {count.worst.words}" if count.worst else ""
    return f"  {mark} {count.law}: {count.failures:,} of {count.checked:,} break it{worst}"

"""`iapb sweep STUDY`: simulate one scene for many values, on this machine or on a cluster; a sweep can be resumed."""

from __future__ import annotations

import os
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from reports.batches import cluster, processes
from reports.show import Answer, Json, stage_progress
from reports.sweeps.study import find_study, load_study, scene_of
from reports.sweeps.sweep import SUMMARY, run_sweep


def sweep(
    study: Annotated[str, typer.Argument(help="A study file, or the name of one that comes with the project.")],
    workers: Annotated[int, typer.Option(help="Processes of this machine; 0: one per core.", min=0, max=512)] = 0,
    scheduler: Annotated[str, typer.Option(help="Address of a dask scheduler to use instead.")] = "",
    out: Annotated[Path, typer.Option(help="Folder of the sweeps.")] = Path("out/sweeps"),
    json_: Json = False,
) -> Answer:
    """Simulate every point of STUDY that has no run file yet, and write a table of all points.

    If it is stopped, the same command continues.
    """
    path = find_study(study)
    chosen = load_study(path)
    who = cluster(scheduler) if scheduler else processes(workers or os.cpu_count() or 1)
    with stage_progress() as progress:
        outcome = run_sweep(chosen, str(scene_of(chosen, path)), out, who,
                            partial(progress, f"points of {chosen.name}"))
    made, failed = len(outcome.points) - outcome.reused, outcome.failed
    table, runs = out / chosen.name / SUMMARY, out / chosen.name / "runs"
    facts = {"study": chosen.name, "points": outcome.points, "computed": made, "found": outcome.reused,
             "failed": len(failed), "content_hash": outcome.content_hash, "table": table, "runs": runs}  # fmt: skip
    notes = Counter(point["note"] for point in failed).most_common(5)
    return Answer(facts, [
        f"{chosen.name}: {len(outcome.points)} points, {made} computed now, {outcome.reused} found.",
        *(f"  {count} without a run: {note}" for note, count in notes),
        f"All results together: {outcome.content_hash[:16]}",
        f"Table in {table}, runs in {runs}",
    ], 1 if failed else 0)  # fmt: skip

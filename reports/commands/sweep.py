"""`iapb sweep STUDY`: simulate one scene for many values, on this machine or on a cluster; a sweep can be resumed."""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from reports.batches import cluster, processes
from reports.commands.as_json import Json, print_json
from reports.commands.progress import stage_progress
from reports.sweeps.study import find_study, load_study, scene_of
from reports.sweeps.sweep import SUMMARY, SweepOutcome, run_sweep


def sweep(
    study: Annotated[str, typer.Argument(help="A study file, or the name of one that comes with the project.")],
    workers: Annotated[int, typer.Option(help="Processes of this machine; 0: one per core.", min=0, max=512)] = 0,
    scheduler: Annotated[str, typer.Option(help="Address of a dask scheduler to use instead.")] = "",
    out: Annotated[Path, typer.Option(help="Folder of the sweeps.")] = Path("out/sweeps"),
    json_: Json = False,
) -> None:
    """Simulate every point of STUDY that has no run file yet, and write a table of all points.

    If it is stopped, the same command continues.
    """
    path = find_study(study)
    chosen = load_study(path)
    who = cluster(scheduler) if scheduler else processes(workers or os.cpu_count() or 1)
    with stage_progress() as progress:
        outcome = run_sweep(chosen, str(scene_of(chosen, path)), out, who,
                            lambda done, total: progress(f"points of {chosen.name}", done, total))
    made, failed = len(outcome.results) - outcome.reused, outcome.failed
    if json_:
        print_json({"study": chosen.name, "points": outcome.results, "computed": made, "found": outcome.reused,
                    "failed": len(failed), "content_hash": outcome.content_hash,
                    "table": out / chosen.name / SUMMARY, "runs": out / chosen.name / "runs"})
    else:
        _print(chosen.name, outcome, made, out)
    if failed:
        raise typer.Exit(1)


def _print(name: str, outcome: SweepOutcome, made: int, out: Path) -> None:
    print(f"{name}: {len(outcome.results)} points, {made} computed now, {outcome.reused} found.")
    for note, count in Counter(result.note for result in outcome.failed).most_common(5):
        print(f"  {count} without a run: {note}")
    print(f"All results together: {outcome.content_hash[:16]}")
    print(f"Table in {out / name / SUMMARY}, runs in {out / name / 'runs'}")

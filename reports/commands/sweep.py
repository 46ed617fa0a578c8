"""`iapb sweep STUDY`: simulate a scene with many values, on this machine or on a dask cluster."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from iapb.scene import find_scene
from reports.show import Answer, Json, stage_progress
from reports.store.keys import code_version
from reports.sweep import load_study, simulate_point, write_points
from reports.workers import cores, executor

SHOWN = 5  # errors of failed points; the table has all


def sweep(
    study: Annotated[str, typer.Argument(help="A study file, or the name of one of the project.")],
    workers: Annotated[int, typer.Option(help="Processes; 0: one per core.", min=0, max=512)] = 0,
    dask: Annotated[str, typer.Option(help="Address of a dask scheduler to use instead.")] = "",
    out: Annotated[Path, typer.Option(help="Folder of the sweeps.")] = Path("out/sweeps"),
    json_: Json = False,
) -> Answer:
    """Simulate every point of STUDY that has no run file yet, and write a table of all points."""
    path = find_scene(study, "sweeps")
    chosen, scene = load_study(path)
    points = list(chosen.points())
    folder = out / path.stem
    runs = (folder / "runs").resolve()
    runs.mkdir(parents=True, exist_ok=True)
    before = len(list(runs.glob("*.h5")))
    row_of = partial(simulate_point, scene, runs, code_version())
    rows: list[dict[str, Any]] = []
    with stage_progress() as progress, executor(workers or cores(), dask) as pool:
        for row in pool.map(row_of, points):
            rows.append(row)
            progress(f"points of {path.stem}", len(rows), len(points))
    write_points(folder / "points.nc", chosen, rows)
    new = len(list(runs.glob("*.h5"))) - before
    failed = [row["error"] for row in rows if row["error"]]
    lines = [
        f"{path.stem}: {len(points)} points, {new} of them simulated now, {len(failed)} failed.",
        *failed[:SHOWN],
        f"The table points.nc and the runs are in {folder}.",
    ]
    facts = {"points": rows, "new": new, "failed": len(failed), "folder": folder}
    return Answer(facts, lines, 1 if failed else 0)

"""Run a sweep: finished points are kept if it is killed, and the results do not depend on order or workers.

    out/sweeps/<study>/runs/*.h5        one run file per point; a point that has one is not simulated again
    out/sweeps/<study>/summary.h5       the table of all points, written when all are finished
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from iapb.errors import ArgumentError, IapbError
from iapb.names import one_of
from iapb.scene import Scene, find_scene, load_scene
from iapb.simulation import simulate
from reference.one_thread import one_thread
from reference.worlds import find_world, require_complete
from reports.batches import Scheduler, here
from reports.runner import run_inputs
from reports.store.folder import RunStore
from reports.store.keys import code_version
from reports.store.tables import write_table
from reports.sweeps.study import LAW, Point, Study, points_of
from verification.table import table_from

DONE, FAILED = "done", "failed"
RUNS, SUMMARY = "runs", "summary.h5"
_MEASURES = ("impacts", "energy_lost [J]", "penetration [m]", "kinetic_energy [J]", "status", "note", "file",
             "content_hash")  # fmt: skip


@dataclass(frozen=True)
class SweepOutcome:
    """A finished sweep.

    points : the row of each in the table: values and what was measured; None if it failed, and `note` is the reason
    reused : number of points that were finished before; content_hash : hash of all results
    """

    folder: Path
    points: tuple[dict[str, Any], ...]
    reused: int
    content_hash: str

    @property
    def failed(self) -> tuple[dict[str, Any], ...]:
        """Return the failed points."""
        return tuple(point for point in self.points if point["status"] == FAILED)


def run_sweep(
    study: Study, scene: str, out: Path | str = "out/sweeps", scheduler: Scheduler = here,
    progress: Callable[[int, int], None] | None = None,
) -> SweepOutcome:
    """Compute every point of a study that has no run file yet.

    Parameters
    ----------
    study : the values to vary
    scene : path of the scene file
    out : folder of all sweeps; this sweep is stored in a subfolder with its name
    scheduler : distributes the points (`reports.batches`)
    progress : called as progress(points done, total points)
    """
    folder = Path(out).resolve() / study.name
    RunStore(folder / RUNS)  # makes the folder
    points, results = list(points_of(study, str(Path(scene).resolve()))), dict[int, tuple[dict[str, Any], bool]]()
    compute = partial(compute_point, folder=str(folder / RUNS), code=code_version())
    with closing(scheduler(compute, points)) as finished:
        for point, result in finished:
            results[point.index] = result
            if progress is not None:
                progress(len(results), len(points))
    rows = tuple(results[point.index][0] for point in points)
    write_table(folder / SUMMARY, study.name, table_from(rows), title=study.title or study.name, command="iapb sweep")
    hashed = "".join(f"{row['point']} {row['status']} {row['content_hash']}\n" for row in rows)
    return SweepOutcome(folder, rows, sum(reused for _, reused in results.values()),
                        hashlib.sha256(hashed.encode()).hexdigest())


def compute_point(point: Point, folder: str, code: str) -> tuple[dict[str, Any], bool]:
    """Compute a point, or read its run if it exists; return its row in the table, and whether its run was there.

    Raises
    ------
    IapbError
        This process runs another version than `code`, or cannot access the folder of the run files.
    """
    if code_version() != code:
        raise IapbError("a worker runs another version of iapb: install the same one on every machine")
    if not Path(folder).is_dir():
        raise IapbError(f"a worker does not see the folder {folder}: the machines of a cluster must share it")
    row = {"point": point.index, "world": point.world} | point.values
    row |= {f"{LAW}{name}": value for name, value in point.law.items()}
    try:
        scene = _scene(point.scene).with_values(point.values)
        world = find_world(point.world, point.rendering)
        law, coupling = _with_settings(world.law, point.law), world.coupling_in(scene)
        place = _store(Path(folder)).place_of(run_inputs(scene, law, coupling, point.world),
                                              f"{scene.name}-{point.world}")
        reused = place.path.is_file()
        with one_thread():  # so sums do not depend on the cores
            run, entry = _store(Path(folder)).fetch(
                place, lambda: require_complete(simulate(scene, law, coupling, world=point.world)))
    except IapbError as error:
        note = " ".join(str(error).split())
        return row | dict.fromkeys(_MEASURES) | {"status": FAILED, "note": note, "file": "", "content_hash": ""}, False
    energy = run.energy.get("kinetic")
    measured = (len(run.impacts.step), float(np.sum(run.impacts.energy_lost)),
                max(0.0, -float(run.contacts.gap.min(initial=0.0))), None if energy is None else float(energy[-1]),
                DONE, "", entry.file, entry.content_hash)  # fmt: skip
    return row | dict(zip(_MEASURES, measured, strict=True)), reused


@cache
def _store(folder: Path) -> RunStore:
    return RunStore(folder)


@cache
def _scene(name: str) -> Scene:
    return load_scene(find_scene(name))


def _with_settings(law: Any, settings: dict[str, Any]) -> Any:
    """Return the law with other settings; raise ArgumentError for an unknown setting."""
    known = [field.name for field in fields(law)] if is_dataclass(law) else []
    for name, value in settings.items():
        if name not in known:
            expected = one_of(name, known or ["it has none"], f"a setting of the law {law.name!r}: ")
            raise ArgumentError(f"law.{name}", value, expected)
    return replace(law, **settings) if settings else law

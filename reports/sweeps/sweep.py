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
from reports.store.io import mark_store
from reports.store.keys import code_version
from reports.store.tables import write_table
from reports.sweeps.study import Point, Study, points_of
from verification.table import table_from

DONE, FAILED = "done", "failed"
RUNS, SUMMARY = "runs", "summary.h5"
_MEASURES = ("impacts", "energy_lost [J]", "penetration [m]", "kinetic_energy [J]", "status", "note", "file",
             "content_hash")  # fmt: skip


@dataclass(frozen=True)
class Result:
    """The result of one point; for a failed point the measures are None, and `note` is the reason."""

    index: int
    status: str
    reused: bool = False  # the run file was there
    file: str = ""
    content_hash: str = ""
    note: str = ""
    impacts: int | None = None
    energy_lost: float | None = None  # in impacts [J]
    penetration: float | None = None  # deepest [m]
    kinetic_energy: float | None = None  # at the end [J]


@dataclass(frozen=True)
class SweepOutcome:
    """A finished sweep.

    results : by index of the point; content_hash : hash of all results
    """

    folder: Path
    results: tuple[Result, ...]
    content_hash: str

    @property
    def reused(self) -> int:
        """Return the number of points that were finished before."""
        return sum(result.reused for result in self.results)

    @property
    def failed(self) -> tuple[Result, ...]:
        """Return the failed points, each with its reason."""
        return tuple(result for result in self.results if result.status == FAILED)


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
    mark_store(folder)
    RunStore(folder / RUNS)  # makes the folder
    points, results = list(points_of(study, str(Path(scene).resolve()))), dict[int, Result]()
    compute = partial(compute_point, folder=str(folder / RUNS), code=code_version())
    with closing(scheduler(compute, points)) as finished:
        for point, result in finished:
            results[point.index] = result
            if progress is not None:
                progress(len(results), len(points))
    ordered = tuple(results[point.index] for point in points)
    _write_summary(folder / SUMMARY, study, points, ordered)
    hashed = "".join(f"{result.index} {result.status} {result.content_hash}\n" for result in ordered)
    return SweepOutcome(folder, ordered, hashlib.sha256(hashed.encode()).hexdigest())


def _write_summary(path: Path, study: Study, points: list[Point], results: tuple[Result, ...]) -> None:
    """Write a table with a row per point: the changed values, the results, and the run file."""
    rows = []
    for point, result in zip(points, results, strict=True):
        law = {f"law.{name}": value for name, value in point.law.items()}
        measured = {title: getattr(result, title.partition(" [")[0]) for title in _MEASURES}
        rows.append({"point": point.index, "world": point.world} | point.values | law | measured)
    write_table(path, study.name, table_from(rows), title=study.title or study.name, command="iapb sweep")


def compute_point(point: Point, folder: str, code: str) -> Result:
    """Compute a point, or read its run if it exists.

    Raises
    ------
    IapbError
        This process runs another version than `code`, or cannot access the folder of the run files.
    """
    if code_version() != code:
        raise IapbError("a worker runs another version of iapb: install the same one on every machine")
    if not Path(folder).is_dir():
        raise IapbError(f"a worker does not see the folder {folder}: the machines of a cluster must share it")
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
        return Result(point.index, FAILED, note=" ".join(str(error).split()))
    energy = run.energy.get("kinetic")
    return Result(point.index, DONE, reused, entry.file, entry.content_hash, "", len(run.impacts.step),
                  float(np.sum(run.impacts.energy_lost)), max(0.0, -float(run.contacts.gap.min(initial=0.0))),
                  None if energy is None else float(energy[-1]))


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

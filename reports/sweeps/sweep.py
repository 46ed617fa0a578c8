"""Run a sweep: what is done stays done, whatever kills it; the results do not depend on order or workers.

    out/sweeps/<study>/runs/*.h5        one run file per point
    out/sweeps/<study>/results.jsonl    a line per finished point, appended as it comes
    out/sweeps/<study>/summary.h5       the table of all points, once they are all done
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from reports.store.io import remove_abandoned
from reports.store.keys import code_version
from reports.store.tables import Column, Table, write_table
from reports.sweeps.points import Point, points_of
from reports.sweeps.schedule import Scheduler, here
from reports.sweeps.study import Study
from reports.sweeps.work import DONE, FAILED, Result

JOURNAL, RUNS, SUMMARY = "results.jsonl", "runs", "summary.h5"
_MEASURES = {"impacts": "1", "energy_lost": "J", "penetration": "m", "kinetic_energy": "J"}


@dataclass(frozen=True)
class SweepOutcome:
    """A finished sweep.

    results : by index of the point; reused : how many were there already; content_hash : of all results together
    """

    folder: Path
    results: tuple[Result, ...]
    reused: int
    content_hash: str

    @property
    def failed(self) -> tuple[Result, ...]:
        """Points without a run, each with its reason."""
        return tuple(result for result in self.results if result.status == FAILED)


def run_sweep(
    study: Study, scene: str, out: Path | str = "out/sweeps", scheduler: Scheduler = here,
    progress: Callable[[int, int], None] | None = None,
) -> SweepOutcome:
    """Compute every point of a study that is not there yet.

    Parameters
    ----------
    study : what to vary
    scene : path of its scene file
    out : folder of all sweeps; this one goes into the folder of its name
    scheduler : who computes (`reports.sweeps.schedule`)
    progress : called as progress(points done, points in all)
    """
    folder = Path(out).resolve() / study.name
    (folder / RUNS).mkdir(parents=True, exist_ok=True)
    remove_abandoned(folder / RUNS)
    code = _code(scene)
    points = list(points_of(study, str(Path(scene).resolve())))
    found = _journal(folder)
    results = {p.index: r for p in points if (r := found.get(p.key(code))) is not None}
    reused, open_points = len(results), [p for p in points if p.index not in results]
    keys = {p.index: p.key(code) for p in open_points}
    say = progress or (lambda done, total: None)
    say(reused, len(points))
    computed = scheduler(open_points, str(folder / RUNS), code_version())
    with _appending(folder / JOURNAL) as append, closing(computed):
        for result in computed:
            result = _under(result, keys[result.index])
            append(result)
            results[result.index] = result
            say(len(results), len(points))
    ordered = tuple(results[p.index] for p in points)
    _write_summary(folder / SUMMARY, study, points, ordered)
    return SweepOutcome(folder, ordered, reused, _hash(ordered))


def _code(scene: str) -> str:
    """Version of code and scene: both decide what a point gives."""
    return hashlib.sha256(code_version().encode() + Path(scene).read_bytes()).hexdigest()


def _under(result: Result, key: str) -> Result:
    from dataclasses import replace

    return replace(result, point=key)


def _journal(folder: Path) -> dict[str, Result]:
    """Finished points by key; a line cut off by a crash, a failure and a run whose file is gone do not count."""
    found: dict[str, Result] = {}
    journal = folder / JOURNAL
    there = {entry.name for entry in os.scandir(folder / RUNS)}
    for line in journal.read_text(encoding="utf-8").splitlines() if journal.is_file() else ():
        with suppress(ValueError, TypeError):
            result = Result(**json.loads(line))
            if result.status == DONE and result.file in there:
                found[result.point] = result
    return found


class _appending:
    """Append results to the journal, each in one write: two sweeps at once do not mix their lines."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def __enter__(self) -> Callable[[Result], None]:
        self._handle = os.open(self._path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
        os.write(self._handle, b"\n" if os.fstat(self._handle).st_size else b"")  # ends a line that a crash cut off
        return lambda result: self._append(result)

    def _append(self, result: Result) -> None:
        os.write(self._handle, (json.dumps(result.record()) + "\n").encode())

    def __exit__(self, *_: object) -> None:
        os.close(self._handle)


def _hash(results: tuple[Result, ...]) -> str:
    """One hash of all contents, in the order of the points."""
    digest = hashlib.sha256()
    for result in results:
        digest.update(f"{result.index} {result.status} {result.content_hash}\n".encode())
    return digest.hexdigest()


def _write_summary(path: Path, study: Study, points: list[Point], results: tuple[Result, ...]) -> None:
    """A row per point: what was changed, what came of it, and in which file it is."""
    columns = [Column("point", np.arange(len(points)), "1", "index of the point")]
    columns += [Column("world", tuple(point.world for point in points), "1", "world")]
    columns += list(_changed(points))
    columns += [Column(name, _numbers(results, name), unit, name.replace("_", " ")) for name, unit in _MEASURES.items()]
    columns += [Column(name, tuple(getattr(result, name) for result in results), "1", name.replace("_", " "))
                for name in ("status", "note", "file", "content_hash")]
    write_table(path, Table(study.name, tuple(columns), study.title or study.name, command="iapb sweep"))


def _changed(points: list[Point]) -> Iterator[Column]:
    given = [{**point.values, **{f"law.{name}": value for name, value in point.law.items()}} for point in points]
    for path in dict.fromkeys(path for values in given for path in values):
        values = [point.get(path) for point in given]
        numeric = all(isinstance(value, int | float) and not isinstance(value, bool) for value in values)
        shown = np.array(values, float) if numeric else tuple(str(value) for value in values)
        yield Column(path, shown, "SI" if numeric else "1", f"value of {path}")


def _numbers(results: tuple[Result, ...], name: str) -> np.ndarray:
    return np.array([np.nan if (value := getattr(result, name)) is None else float(value) for result in results])

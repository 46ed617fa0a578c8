"""Compute one point of a sweep: simulate, store the run, return what came of it. Runs in any process."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields, is_dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from iapb.errors import ArgumentError, IapbError
from iapb.names import one_of
from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene
from iapb.simulation import simulate
from reference.one_thread import one_thread
from reference.worlds import find_world, require_complete
from reports.runner import run_inputs
from reports.store.folder import file_name
from reports.store.keys import code_version, run_key
from reports.store.runs import RunEntry, read_stored, store_run
from reports.sweeps.points import Point

DONE, FAILED = "done", "failed"


@dataclass(frozen=True)
class Result:
    """What came of one point; the measures are None where it failed, and `note` says why."""

    index: int
    point: str  # key of the point
    status: str
    file: str = ""
    content_hash: str = ""
    note: str = ""
    impacts: int | None = None
    energy_lost: float | None = None  # in impacts [J]
    penetration: float | None = None  # deepest [m]
    kinetic_energy: float | None = None  # at the end [J]

    def record(self) -> dict[str, Any]:
        """As plain values."""
        return asdict(self)


def compute_point(point: Point, folder: str, code: str) -> Result:
    """Compute a point, or read its run where there is one.

    Parameters
    ----------
    folder : of the run files, which this machine must see
    code : version that the sweep is made with; a worker of another version may not take part

    Raises
    ------
    IapbError
        This process runs another version of the code, or does not see the folder.
    """
    if code_version() != code:
        raise IapbError("a worker runs another version of iapb: install the same one on every machine")
    if not Path(folder).is_dir():
        raise IapbError(f"a worker does not see the folder {folder}: the machines of a cluster must share it")
    key = point.key(code)
    try:
        run, entry = _run(point, Path(folder))
    except IapbError as error:
        return Result(point.index, key, FAILED, note=" ".join(str(error).split()))
    return Result(point.index, key, DONE, entry.file, entry.content_hash, "", **_measures(run))


def _run(point: Point, folder: Path) -> tuple[Run, RunEntry]:
    """The run of a point and its file's entry; BLAS on one thread, or the sums would depend on the machine's cores."""
    scene = _scene(point.scene).with_values(point.values)
    world = find_world(point.world, point.rendering)
    law, coupling = _with_settings(world.law, point.law), world.coupling_in(scene)
    key = run_key(run_inputs(scene, law, coupling, point.world))
    path = folder / file_name(f"{scene.name}-{point.world}", key)
    if path.is_file():
        return read_stored(path)
    with one_thread():
        run = require_complete(simulate(scene, law, coupling, world=point.world))
    return run, store_run(path, run, key=key)


@cache
def _scene(name: str) -> Scene:
    return load_scene(find_scene(name))


def _with_settings(law: Any, settings: dict[str, Any]) -> Any:
    """The law with other settings; an unknown one is refused by name."""
    known = [field.name for field in fields(law)] if is_dataclass(law) else []
    for name, value in settings.items():
        if name not in known:
            expected = one_of(name, known or ["it has none"], f"a setting of the law {law.name!r}: ")
            raise ArgumentError(f"law.{name}", value, expected)
    return replace(law, **settings) if settings else law


def _measures(run: Run) -> dict[str, Any]:
    energy = run.energy.get("kinetic")
    return {
        "impacts": len(run.impacts.step),
        "energy_lost": float(np.sum(run.impacts.energy_lost)),
        "penetration": max(0.0, -float(run.contacts.gap.min(initial=0.0))),
        "kinetic_energy": None if energy is None else float(energy[-1]),
    }

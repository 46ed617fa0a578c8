"""Sweeps: one scene with every combination of some values; a run per point, and a table of all
points.

out/sweeps/<study>/runs/*.h5    one run file per point; a point that has one is not simulated again
out/sweeps/<study>/points.nc    the table: `xarray.open_dataset(path, engine="h5netcdf")`
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from iapb.errors import ArgumentError, IapbError
from iapb.scene import Scene, find_scene, load_scene, scene_names
from iapb.scene.document import Document
from iapb.scene.parts import Number, ScenePart, Text, Truth
from iapb.scene.reading import checked, read_text
from reference.worlds import find_world
from reports.runner import Runner
from reports.show import said
from reports.store.io import write_whole
from reports.store.keys import code_version

MAX_POINTS = 100_000  # files in one folder: a larger study is probably a mistake
# Columns of the table: numbers with their units, and texts. The kinetic energy is that at the end.
COLUMNS = {
    "impacts": "1",
    "energy_lost": "J",
    "penetration": "m",
    "kinetic_energy": "J",
    "distrust": "",
    "file": "",
    "error": "",
}
Values = Annotated[tuple[Number | Truth | Text, ...], Field(min_length=1)]
# leads to no other folder
Word = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]{0,199}$")]


class Study(ScenePart):
    """A study file: a scene, worlds, and lists of values by path, such as ``contact.stiffness``."""

    scene: Word = Field(description="a scene of the project, or a file beside this one")
    worlds: Annotated[tuple[Text, ...], Field(min_length=1)] = ("IAPB",)
    values: dict[Word, Values] = Field(description="value path: list of values")

    def axes(self) -> dict[str, tuple[Any, ...]]:
        """Return the values along each axis of the table; the first axis is the world."""
        return {"world": self.worlds, **self.values}

    def points(self) -> Iterator[dict[str, Any]]:
        """Yield world and values of every point; the last path varies fastest."""
        axes = self.axes()
        for chosen in itertools.product(*axes.values()):
            yield dict(zip(axes, chosen, strict=True))


def load_study(path: Path) -> tuple[Study, Scene]:
    """Read a study and its scene.

    Raises
    ------
    ArgumentError
        A file cannot be read, a world does not exist, or there are more than MAX_POINTS points.
    SceneError
        A file is no study or no scene; the error lists all mistakes.
    """
    document = Document(read_text(path), str(path), "study")
    study = checked(Study, document.value, document, [], "study")
    size = math.prod(map(len, study.axes().values()))
    if size > MAX_POINTS:
        raise ArgumentError("study", f"{size} points", f"at most {MAX_POINTS}")
    for world in study.worlds:
        find_world(world)
    ours = study.scene in scene_names()
    return study, load_scene(find_scene(study.scene) if ours else path.parent / study.scene)


def simulate_point(scene: Scene, folder: Path, code: str, point: dict[str, Any]) -> dict[str, Any]:
    """Simulate a point, or read its run if it is there; return its row of the table.

    Parameters
    ----------
    scene : to be changed
    folder : of the run files
    code : the version that the worker must have
    point : the world, and values by path
    """
    values = dict(point)
    world = values.pop("world")
    try:
        if code_version() != code or not folder.is_dir():
            raise IapbError(f"a worker lacks the folder {folder}, or has another version of iapb")
        runner = Runner(folder)
        run = runner(scene.with_values(values), world, keep=False)
    except Exception as error:  # costs this row
        return point | {"error": said(error, "")}
    [stored] = runner.used
    contacts = {  # an engine that gives states alone leaves them missing
        "impacts": len(run.impacts.step),
        "energy_lost": run.impacts.energy_lost.sum(),
        "penetration": max(0.0, -run.contacts.gap.min(initial=0.0)),
    }
    return (
        point
        | (contacts if run.records_contacts else {})
        | {
            "kinetic_energy": run.energy.get("kinetic", [math.nan])[-1],
            "distrust": "; ".join(run.distrust),
            "file": stored,
            "error": "",
        }
    )


def write_points(path: Path, study: Study, rows: list[dict[str, Any]]) -> None:
    """Write the table of all points: an xarray Dataset with an axis for the worlds and for each
    path."""
    from xarray import Dataset

    axes = {name: list(values) for name, values in study.axes().items()}
    shape = [len(values) for values in axes.values()]
    table = Dataset(coords=axes, attrs={"scene": study.scene})
    for name, unit in COLUMNS.items():
        missing = math.nan if unit else ""
        column = np.reshape([row.get(name, missing) for row in rows], shape)
        table[name] = list(axes), column, {"units": unit}
    write_whole(path, bytes(table.to_netcdf(engine="h5netcdf")))

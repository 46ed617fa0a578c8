"""The energy book of each scene of the project in the world IAPB, at its own step and at shorter
ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from iapb.run import Run
from iapb.scene import scene_names
from verification.check import Check, Study
from verification.finding import Part
from verification.scenes.books import OPEN, energy_book, is_first_order, open_row, scene_of
from verification.table import Columns, Row, Table

WORLD = "IAPB"
REFINEMENTS = {"quick": (1, 2, 4), "full": (1, 2, 4, 8)}
WORTH_NAMING = 1.0  # [%] of the energy exchanged; scenes that leave more open are named
# penetration, as a share of the thinnest moving shape, from which contacts push to the wrong side
DEEP = 0.5
DEEPEST = "deepest overlap, of the thinnest shape"
GAIN = "most energy beyond what was put in"


def scene_row(run: Run) -> Row:
    """Return the energy book, penetration and impacts of a run."""
    book = energy_book(run)
    deepest = float(np.maximum(-run.contacts.gap, 0.0).max(initial=0.0))
    thin = thinnest(run)
    return {
        "scene": run.scene_name,
        "dimensions": getattr(scene_of(run), "dimensions", 2),
        "step [ms]": 1e3 * run.dt,
        "energy exchanged [J]": book.exchanged,
        "work of the hand [J]": float(run.energy["hand_work"][-1]),
        "work of the coupling [J]": float(run.energy["coupling_work"][-1]),
        **{f"lost in {name} [J]": lost + 0.0 for name, lost in book.lost.items()},
        "left open by the motion [J]": book.of_motion,
        "left open by springs [J]": book.of_springs,
        f"{GAIN} [%]": 100.0 * book.share(book.gain),
        "impacts": len(run.impacts.step),
        "deepest overlap [mm]": 1e3 * deepest,
        DEEPEST: deepest / thin if thin else None,
        "stopped": run.stopped,
    }


def thinnest(run: Run) -> float | None:
    """Return the smallest thickness [m] of a moving shape; None if there is no shape."""
    shapes = [shape for body in run.scene_resolved["bodies"] for shape in body["shapes"]]
    return min(map(_thickness, shapes)) if shapes else None


def _thickness(shape: Mapping[str, Any]) -> float:
    if "radius" in shape:
        return 2.0 * float(shape["radius"])
    if "size" in shape:
        return float(min(shape["size"]))
    return float(np.ptp(np.array(shape["vertices"]), axis=0).min())


def _row(study: Study, name: str) -> Row:
    scene = study.scene(name)

    def simulate(scene: Any) -> Run:
        return study.run(scene, WORLD, keep=False)

    left = open_row(scene, simulate, REFINEMENTS[study.depth])
    return {**scene_row(study.run(scene, WORLD)), **left}


def _targets(table: Table) -> Iterator[Part]:
    rows = table.records()
    depths = [row[DEEPEST] for row in rows if row[DEEPEST] is not None]
    yield Part.on("scenes whose run stops", sum(bool(row["stopped"]) for row in rows), 0)
    yield Part.on("deepest overlap, of the thinnest moving shape", max(depths, default=None), DEEP)
    late = sum(not is_first_order(row) for row in rows)
    yield Part.on("scenes whose energy error does not fall with the step", late, 0)
    wide = sum(row[OPEN] > WORTH_NAMING for row in rows)
    yield Part.on(f"scenes that leave more than {WORTH_NAMING:g} % of their energy open", wide, 0)


SCENES = Check(
    key="scenes",
    question="Where does the energy of each scene go, and does what is left open fall with the step?",
    cases=lambda study: scene_names(),
    row=_row,
    targets=_targets,
    columns=Columns(prose=("stopped",)),
)

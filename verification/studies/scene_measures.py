"""Every scene in a world: penetration, energy ledger, simultaneous rows and time per step, as one record each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from iapb.run import Run


@dataclass(frozen=True)
class SceneMeasure:
    """One run.

    penetration : deepest overlap [m]; most_rows : rows of the largest impact; most_contacts : in one step
    energy : the ledger's last entries by name [J]; largest_kinetic : [J], to compare the residual with
    seconds_per_step : median over the chunks, since the first may hold compilation
    realtime_factor : step length over it
    """

    scene: str
    world: str
    steps: int
    complete: bool
    penetration: float
    most_rows: int
    most_contacts: int
    impacts: int
    largest_kinetic: float
    energy: dict[str, float]
    seconds_per_step: float
    realtime_factor: float


def measure(run: Run) -> SceneMeasure:
    """Return the record of a run."""
    pace = float(np.median(run.chunk_seconds / run.chunk_steps))
    return SceneMeasure(
        run.scene_name, run.world, run.steps, run.complete,
        penetration=float(np.maximum(-run.contacts.gap, 0.0).max(initial=0.0)),
        most_rows=int(run.impacts.rows.max(initial=0)),
        most_contacts=int(np.diff(run.contacts.offsets).max(initial=0)),
        impacts=len(run.impacts.step),
        largest_kinetic=float(run.energy["kinetic"].max()) if "kinetic" in run.energy else np.nan,
        energy={name: float(values[-1]) for name, values in run.energy.items() if len(values)},
        seconds_per_step=pace, realtime_factor=run.dt / pace,
    )  # fmt: skip


LINKAGE_SCENES = (
    "three_link_arm_plastic", "three_link_arm_elastic", "newton_cradle", "bernoulli_balls", "faceted_socket",
    "box_stack", "tumbling_body", "peg_hole_space", "arm_obstacles",
)  # fmt: skip


def study_scenes(
    names: Sequence[str] = LINKAGE_SCENES, worlds: Sequence[str] = ("IAPB",)
) -> tuple[SceneMeasure, ...]:
    """Return the measures of scenes that come with the project in the paper's worlds."""
    from iapb.scene import load_scene
    from iapb.scene_files import find_scene
    from reference.worlds import run_world

    return tuple(measure(run_world(load_scene(find_scene(name)), world)) for name in names for world in worlds)

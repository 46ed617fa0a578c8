"""C22 in the loop: seconds per step of each world on the project's scenes, taking turns.

The rigid worlds run a QP per step from Python, the engine's worlds are compiled; so IAPB is timed in both ways, as
the loop runs it and one step at a time from Python. Both differences are shown, neither is hidden in the other.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from iapb.scene import find_scene, load_scene
from iapb.simulation import Simulation
from reference.one_thread import one_thread
from reference.worlds import find_world, run_world
from verification.finding import Failure, attempt

SCENES = ("peg_corner", "peg_hole")
STEPPED, IDEAL = "IAPB, step by step", "ideal (QP per step)"
WAYS = ("IAPB, compiled loop", STEPPED, "PB, compiled loop", IDEAL, "CBuc (QP per step)")
STEPS = 256  # half a second of the peg: free, colliding and resting steps


@dataclass(frozen=True)
class StepCostRow:
    """Seconds per step of one world on one scene: median, least and largest of `repeats` runs of `steps` steps."""

    scene: str
    way: str
    median: float
    least: float
    largest: float
    repeats: int
    steps: int


def step_rivals(rows: Sequence[StepCostRow]) -> tuple[tuple[StepCostRow, StepCostRow], ...]:
    """(the rigid world's row, IAPB's row) of each scene, both stepped from Python."""
    by = {(row.scene, row.way): row for row in rows}
    scenes = dict.fromkeys(row.scene for row in rows)
    return tuple((by[scene, IDEAL], by[scene, STEPPED]) for scene in scenes
                 if (scene, IDEAL) in by and (scene, STEPPED) in by)  # fmt: skip


def costs_more(theirs: StepCostRow, ours: StepCostRow) -> bool | None:
    """Whether their step costs more; None where the samples of the two overlap."""
    if theirs.least <= ours.largest and ours.least <= theirs.largest:
        return None
    return theirs.median > ours.median


def world_cost(
    scenes: Sequence[str] = SCENES, repeats: int = 5, steps: int = STEPS, ways: Sequence[str] = WAYS,
    progress: Callable[[str, int, int], None] | None = None, failures: list[Failure] | None = None,
) -> tuple[StepCostRow, ...]:
    """Time every world on every scene; the first run of each, which compiles, is not counted."""
    rows: list[StepCostRow] = []
    for done, name in enumerate(scenes):
        samples: dict[str, list[float]] = {way: [] for way in ways}
        with one_thread():
            for turn in range(max(3, repeats) + 1):
                for way in tuple(samples):
                    seconds = attempt(f"{name}, {way}", partial(_seconds_per_step, name, way, steps), failures)
                    if seconds is None:
                        del samples[way]
                    elif turn > 0:
                        samples[way].append(seconds)
        rows += [
            StepCostRow(name, way, float(np.median(s)), min(s), max(s), len(s), steps) for way, s in samples.items()
        ]
        if progress is not None:
            progress("time per step", done + 1, len(scenes))
    return tuple(rows)


def _seconds_per_step(scene_name: str, way: str, steps: int) -> float:
    scene, world = load_scene(find_scene(scene_name)), way.split(",")[0].split(" ")[0]
    if way != STEPPED:
        return float(np.sum(run_world(scene, world, steps=steps).chunk_seconds)) / steps
    found = find_world(world)
    simulation = Simulation(scene, found.law, found.coupling_in(scene))
    simulation.step()
    started = time.perf_counter()
    for _ in range(steps):
        simulation.step()
    return (time.perf_counter() - started) / steps

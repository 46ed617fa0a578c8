"""Paced runs of scenes for whoever measures: the loop as it is, with numbers instead of files."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from iapb.scene import Scene
from reference.worlds import find_world
from reports.live.budget import calibrated
from reports.live.clock import Clock
from reports.live.deadline import percentiles
from reports.live.loop import LiveRun, Loop
from reports.live.setup import live_simulation


@dataclass(frozen=True)
class Pace:
    """How a scene kept to a rate; times at the percentiles of `reports.live.deadline.PERCENTILES` [s]."""

    scene: str
    rate: float  # [1/s]
    ticks: int
    work: tuple[float, ...]  # of a tick
    lateness: tuple[float, ...]  # of its beginning
    missed: int
    behind: float  # [s] that simulated time fell behind the clock
    collisions: int
    rows_left_out: int  # rows that still approached after impacts that had used up their budget


def pace(scene: Scene, rate: float, seconds: float, *, world: str = "IAPB", budgeted: bool = True,
         clock: Clock | None = None) -> Pace:
    """Run a scene for some seconds of real time at a rate, and say how it went.

    Parameters
    ----------
    scene : Scene; its own rate is replaced by `rate`.
    rate : float [1/s]
    seconds : float [s] of simulated and, without misses, of real time.
    world : one of `reference.worlds.WORLDS`.
    budgeted : whether impacts get the rows that the time left allows, or all.
    clock : default: this machine's.
    """
    simulation = live_simulation(scene, find_world(world), rate)
    budget = calibrated(simulation, simulation.system.dt) if budgeted else None
    live = Loop(simulation, max(1, round(seconds * rate)), clock, budget).run(world)
    return summary(live)


def summary(live: LiveRun) -> Pace:
    """The numbers of a live run."""
    table = live.timetable
    return Pace(
        scene=live.run.scene_name, rate=1.0 / table.period, ticks=live.run.steps,
        work=tuple(percentiles(table.work).tolist()), lateness=tuple(percentiles(table.lateness).tolist()),
        missed=int(table.missed.sum()), behind=table.behind, collisions=len(live.run.impacts.step),
        rows_left_out=rows_left_out(live),
    )  # fmt: skip


def rows_left_out(live: LiveRun) -> int:
    """Rows that approached still after an impact that had used up a budget below the number of velocities."""
    impacts, budget = live.run.impacts, live.timetable.budget
    if not len(impacts.step):
        return 0
    given = budget[impacts.step]
    short = (impacts.rank >= given) & (given < live.run.v.shape[1])
    return int(np.maximum(impacts.approaching[short], 0).sum())

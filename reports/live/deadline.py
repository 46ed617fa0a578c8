"""Deadlines of a loop at a fixed rate: when each tick was due, began and ended, and the effect of missed deadlines.

A tick that ends after the next one is due misses its deadline. Then the next tick begins at once, and all later ticks
are postponed by the same delay. So no step is left out, and two steps never run in the time of one, which the hand
would feel as a jerk. Instead, simulated time falls behind the clock, and `Pace.behind` says by how much.

To wait for an instant, the clock sleeps until shortly before it, and then polls the time.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.run import Run

Floats = NDArray[np.float64]
# Columns of a timetable: name, unit, meaning.
TICK = (
    ("due", "s", "when the tick was due, since the first one"),
    ("start", "s", "when it began, never before it was due"),
    ("end", "s", "when its work was done"),
    ("budget", "1", "rows that an impact of the step could use"),
    *((f"{what}_{axis}", unit, f"of the hand, {what}_{axis}")
      for what, unit in (("force", "N"), ("torque", "N m")) for axis in "xyz"),
)
TICK_COLUMNS = len(TICK)
PERCENTILES = (50.0, 90.0, 99.0, 99.9, 100.0)


class Timetable(NamedTuple):
    """The ticks of a loop: `period` [s] and a row (n, TICK_COLUMNS) for each tick, with the columns of `TICK`."""

    period: float
    rows: Floats

    @property
    def due(self) -> Floats:
        """Return when each tick (n,) was due [s]."""
        return self.rows[:, 0]

    @property
    def budget(self) -> NDArray[np.int64]:
        """Return how many rows an impact of each step (n,) could use."""
        return self.rows[:, 3].astype(np.int64)

    @property
    def missed(self) -> NDArray[np.bool_]:
        """Return whether each tick (n,) ended after the next one was due."""
        return self.rows[:, 2] > self.due + self.period


@dataclass(frozen=True)
class Pace:
    """How a live run kept its rate; times [s] at the percentiles of `PERCENTILES`."""

    scene: str
    rate: float  # [1/s]
    ticks: int
    work: tuple[float, ...]  # of a tick
    lateness: tuple[float, ...]  # of its beginning
    missed: int
    behind: float  # [s] that simulated time fell behind the clock
    collisions: int
    least_rows: int  # that the time left gave a collision
    rows_left_out: int  # rows that still approached after impacts that had used up their budget


_EDGES = np.geomspace(1e-9, 1e5, 32_001)  # [s] of a histogram, relative distance 1e-3


class Tally:
    """Collects the numbers of a live run that is given in parts, in constant memory."""

    def __init__(self) -> None:
        self._scene, self._period, self._ticks, self._behind = "", 1.0, 0, 0.0
        self._counts, self._worst = np.zeros((2, len(_EDGES) + 1), np.int64), np.zeros(2)  # of work, of lateness
        self._missed = self._collisions = self._left_out = 0
        self._least = np.iinfo(np.int64).max

    def add(self, run: Run, table: Timetable) -> None:
        """Add a part of the run and the ticks of this part."""
        impacts = run.impacts
        given = table.budget[impacts.step[:] - self._ticks]
        short = (impacts.rank[:] >= given) & (given < run.v.shape[1])
        self._left_out += int(impacts.approaching[:][short].clip(0).sum())
        self._collisions += len(given)
        self._least = int(given.min(initial=self._least))
        self._scene, self._period, self._ticks = run.scene_name, table.period, self._ticks + len(table.rows)
        _, start, end = table.rows[:, :3].T
        for k, seconds in enumerate((end - start, start - table.due)):
            self._counts[k] += np.bincount(np.searchsorted(_EDGES, seconds), minlength=len(_EDGES) + 1)
            self._worst[k] = seconds.max(initial=self._worst[k])
        self._missed += int(table.missed.sum())
        self._behind += float((end - (table.due + table.period))[table.missed].sum())

    def pace(self) -> Pace:
        """Return the numbers of all parts."""
        return Pace(self._scene, 1.0 / self._period, self._ticks, self._percentiles(0), self._percentiles(1),
                    self._missed, self._behind, self._collisions, self._least if self._collisions else 0,
                    self._left_out)  # fmt: skip

    def _percentiles(self, k: int) -> tuple[float, ...]:
        """Return the times [s] at `PERCENTILES`: upper ends of bins, except the last, which is the exact maximum."""
        below, worst = np.cumsum(self._counts[k]), float(self._worst[k])
        bins = np.searchsorted(below, np.array(PERCENTILES[:-1]) / 100.0 * below[-1]).clip(max=len(_EDGES) - 1)
        return (*np.minimum(_EDGES[bins], worst).tolist(), worst)


# Linux wakes a sleeping process about 50 µs late, so the clock polls during the last part; more would waste power.
SPIN_SECONDS = 1e-4


class Clock:
    """CLOCK_MONOTONIC: the same in all processes of this machine, and it cannot be set; tests use their own clock."""

    def now(self) -> float:
        """Return the time [s] since some fixed instant."""
        return time.monotonic()

    def wait_until(self, instant: float) -> None:
        """Sleep to `SPIN_SECONDS` before the instant, then spin."""
        time.sleep(max(0.0, instant - time.monotonic() - SPIN_SECONDS))
        while time.monotonic() < instant:
            pass

"""Deadlines of a loop at a fixed rate: when each tick was due, began and ended, and the effect of missed deadlines.

A tick that ends after the next one is due misses its deadline. Then the next tick begins at once, and all later ticks
are postponed by the same delay. So no step is left out, and two steps never run in the time of one, which the hand
would feel as a jerk. Instead, simulated time falls behind the clock, and `Timetable.behind` records by how much.

To wait for an instant, the clock sleeps until shortly before it, and then polls the time.
"""

from __future__ import annotations

import time
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
TICK_COLUMNS = 10
PERCENTILES = (50.0, 90.0, 99.0, 99.9, 100.0)


class Timetable(NamedTuple):
    """The times of n ticks, in seconds since the first tick was due, with their row budgets and wrenches."""

    period: float
    due: Floats  # (n,)
    start: Floats  # (n,) when the tick began, never before it was due
    end: Floats  # (n,) when its work was done
    budget: NDArray[np.int64]  # (n,) rows that an impact of the step could use
    wrench: Floats  # (n, 6) of the hand [N, N m]

    @property
    def work(self) -> Floats:
        """Return the duration of each tick's work (n,) [s]."""
        return self.end - self.start

    @property
    def lateness(self) -> Floats:
        """Return the delay of each tick's start (n,) [s], which the operating system and other programs cause."""
        return self.start - self.due

    @property
    def missed(self) -> NDArray[np.bool_]:
        """Return whether each tick (n,) ended after the next one was due."""
        return self.end > self.due + self.period

    @property
    def behind(self) -> float:
        """Return the total time [s] by which simulated time fell behind the clock."""
        late = self.end - (self.due + self.period)
        return float(late[self.missed].sum())


class Deadlines:
    """Records a timetable during the loop, without allocating memory.

    Parameters
    ----------
    period : float [s]
    ticks : largest number of ticks.
    first : float [s], clock time when the first tick is due.
    kept : number of the last ticks that are kept; default: all.
    """

    def __init__(self, period: float, ticks: int, first: float, kept: int | None = None) -> None:
        self.period, self.first, self.done = period, first, 0
        self.due = first
        self._rows = np.zeros((ticks if kept is None else kept, TICK_COLUMNS))

    def left(self, now: float) -> float:
        """Return the time [s] before the deadline of the current tick."""
        return self.due + self.period - now

    def note(self, budget: int, wrench: Floats) -> None:
        """Record the inputs of the current step, so that it can be repeated."""
        row = self._rows[self.done % len(self._rows)]
        row[3], row[4:] = budget, wrench

    def close(self, start: float, end: float) -> None:
        """Record the times of a tick; the next one is due a period later or, after a missed deadline, at `end`."""
        row = self._rows[self.done % len(self._rows)]
        row[0], row[1], row[2] = self.due - self.first, start - self.first, end - self.first
        self.done += 1
        self.due = max(self.due + self.period, end)

    def timetable(self, ticks: int) -> Timetable:
        """Return the timetable of the first `ticks` ticks."""
        return timetable_of(self.period, self.rows(0, ticks))

    def rows(self, first: int, count: int) -> Floats:
        """Return rows (count, TICK_COLUMNS) from tick number `first` on: due, start, end, row budget, wrench (6)."""
        found: Floats = self._rows[np.arange(first, first + count) % len(self._rows)]
        return found


def timetable_of(period: float, rows: Floats) -> Timetable:
    """Return the timetable that rows of `Deadlines` describe."""
    due, start, end, budget = rows[:, :4].T.copy()
    return Timetable(period, due, start, end, budget.astype(np.int64), rows[:, 4:].copy())


_EDGES = np.geomspace(1e-9, 1e5, 32_001)  # [s], relative distance 1e-3


class Spread:
    """A histogram of any number of times, in constant memory and with a relative resolution of 1e-3."""

    def __init__(self) -> None:
        self._counts, self._worst = np.zeros(len(_EDGES) + 1, np.int64), 0.0

    def add(self, seconds: Floats) -> None:
        """Add times [s] to the histogram."""
        self._counts += np.bincount(np.searchsorted(_EDGES, seconds), minlength=len(self._counts))
        self._worst = max(self._worst, float(seconds.max(initial=0.0)))

    def percentiles(self) -> tuple[float, ...]:
        """Return the times [s] at `PERCENTILES`: upper ends of bins, except the last, which is the exact maximum."""
        below = np.cumsum(self._counts)
        bins = np.searchsorted(below, np.array(PERCENTILES) / 100.0 * below[-1])
        return tuple(min(float(_EDGES[min(each, len(_EDGES) - 1)]), self._worst) for each in bins[:-1]) + (self._worst,)


# Linux wakes a sleeping process about 50 µs late, so the clock polls during the last part; more would waste power.
SPIN_SECONDS = 1e-4


class Clock(Protocol):
    """The interface of a clock, which tells the time and waits; tests use their own clock."""

    def now(self) -> float:
        """Return the time [s]; it never goes back."""
        ...

    def wait_until(self, instant: float) -> None:
        """Return at `instant` [s], or at once if it has passed."""
        ...


class MonotonicClock:
    """CLOCK_MONOTONIC: it is the same in all processes of this machine, and it cannot be set."""

    def now(self) -> float:
        """Return the time [s] since some fixed instant."""
        return time.monotonic()

    def wait_until(self, instant: float) -> None:
        """Sleep to `SPIN_SECONDS` before the instant, then spin."""
        asleep = instant - time.monotonic() - SPIN_SECONDS
        if asleep > 0.0:
            time.sleep(asleep)
        while time.monotonic() < instant:
            pass

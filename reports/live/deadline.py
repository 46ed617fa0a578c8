"""Deadlines of a loop at a fixed rate: when each tick was due, began and ended, and what a miss did.

A tick that ends after the next one was due has missed its deadline. Then the next tick begins at once and all later
ones are due that much later: simulated time never jumps and never hurries, so that no step is left out and no two are
crammed into the time of one, which the hand would feel as a blow. It falls behind the clock instead, and this is
recorded: `Timetable.behind`.

The clock is asleep until shortly before an instant, and then watches for it.
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
    """What happened at n ticks; times in seconds since the first was due."""

    period: float
    due: Floats  # (n,)
    start: Floats  # (n,) when the tick began, never before it was due
    end: Floats  # (n,) when its work was done
    budget: NDArray[np.int64]  # (n,) rows that an impact of the step could use
    wrench: Floats  # (n, 6) of the hand [N, N m]

    @property
    def work(self) -> Floats:
        """(n,) Time that each tick's work took."""
        return self.end - self.start

    @property
    def lateness(self) -> Floats:
        """(n,) Time from due to begun: what the operating system and other programs cost."""
        return self.start - self.due

    @property
    def missed(self) -> NDArray[np.bool_]:
        """(n,) Whether the tick ended after the next one was due."""
        return self.end > self.due + self.period

    @property
    def behind(self) -> float:
        """Seconds by which simulated time fell behind the clock in all."""
        late = self.end - (self.due + self.period)
        return float(late[self.missed].sum())


class Deadlines:
    """The timetable in the making, written without allocating anything.

    Parameters
    ----------
    period : float [s]
    ticks : how many there can be.
    first : float [s], the clock's time when the first one is due.
    kept : so many of the last ticks are kept; default: all.
    """

    def __init__(self, period: float, ticks: int, first: float, kept: int | None = None) -> None:
        self.period, self.first, self.done = period, first, 0
        self.due = first
        self._rows = np.zeros((ticks if kept is None else kept, TICK_COLUMNS))

    def left(self, now: float) -> float:
        """Time that the tick at hand may still take [s]."""
        return self.due + self.period - now

    def note(self, budget: int, wrench: Floats) -> None:
        """Keep what the step at hand was given: with this it can be done again."""
        row = self._rows[self.done % len(self._rows)]
        row[3], row[4:] = budget, wrench

    def close(self, start: float, end: float) -> None:
        """Enter a tick; the next one is due a period later or, after a miss, now."""
        row = self._rows[self.done % len(self._rows)]
        row[0], row[1], row[2] = self.due - self.first, start - self.first, end - self.first
        self.done += 1
        self.due = max(self.due + self.period, end)

    def timetable(self, ticks: int) -> Timetable:
        """The first `ticks` ticks."""
        return timetable_of(self.period, self.rows(0, ticks))

    def rows(self, first: int, count: int) -> Floats:
        """Return (count, TICK_COLUMNS) of the ticks from number `first` on: due, start, end, rows allowed, wrench."""
        found: Floats = self._rows[np.arange(first, first + count) % len(self._rows)]
        return found


def timetable_of(period: float, rows: Floats) -> Timetable:
    """Return the timetable in rows of `Deadlines`."""
    due, start, end, budget = rows[:, :4].T.copy()
    return Timetable(period, due, start, end, budget.astype(np.int64), rows[:, 4:].copy())


_EDGES = np.geomspace(1e-9, 1e5, 32_001)  # [s]; a thousandth apart


class Spread:
    """Times, any number of them, counted in bins: in constant memory, each to a thousandth of itself."""

    def __init__(self) -> None:
        self._counts, self._worst = np.zeros(len(_EDGES) + 1, np.int64), 0.0

    def add(self, seconds: Floats) -> None:
        """Count some times [s]."""
        self._counts += np.bincount(np.searchsorted(_EDGES, seconds), minlength=len(self._counts))
        self._worst = max(self._worst, float(seconds.max(initial=0.0)))

    def percentiles(self) -> tuple[float, ...]:
        """Return the times [s] at `PERCENTILES`, by the upper ends of their bins; the last is the worst, exactly."""
        below = np.cumsum(self._counts)
        bins = np.searchsorted(below, np.array(PERCENTILES) / 100.0 * below[-1])
        return tuple(min(float(_EDGES[min(each, len(_EDGES) - 1)]), self._worst) for each in bins[:-1]) + (self._worst,)


# Linux wakes a sleeper some 50 µs late, so the last stretch is spent awake; more would only heat the processor.
SPIN_SECONDS = 1e-4


class Clock(Protocol):
    """Anything that tells the time and waits; tests bring one of their own."""

    def now(self) -> float:
        """Return the time [s]; it never goes back."""
        ...

    def wait_until(self, instant: float) -> None:
        """Return at `instant` [s] or, where that has passed, at once."""
        ...


class MonotonicClock:
    """CLOCK_MONOTONIC: the same in all processes of this machine, and nobody can set it."""

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

"""The haptic loop: one step of the simulation at each tick of a clock.

    wait for the tick
        read the device, which has moved since the last tick, and record the step that ends now
        compute the row budget of the next step from the time left, and read the hand's wrench
        begin the next step: compute coupling and contact law, send the force to the device
        publish the coordinates for the viewer

The loop never waits for a lock or for the viewer. Python's garbage collector is off during the loop. The log is written
when enough time is left before the next tick, or when too many chunks are waiting.
"""

from __future__ import annotations

import gc
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from iapb.errors import IapbError, RunFileError
from iapb.recording import Record, Recorder
from iapb.run import Run
from iapb.simulation import INTERRUPTED, Simulation
from reports.live.budget import RowBudget
from reports.live.deadline import Clock, Deadlines, MonotonicClock, Timetable
from reports.store.logs import RunLog

Floats = NDArray[np.float64]

_SPARE_SECONDS = 4e-4  # [s] a chunk is allocated in advance only if this much of the period is left
_LOG_SECONDS = 7e-4  # [s] a chunk is written if this much of the period is left
_MOST_WAITING = 8  # or if more chunks than this are waiting
_TICKS_KEPT = 16 * 512  # more than the ticks of the waiting chunks


class Audience(Protocol):
    """The interface of a viewer that may also pull the hand; its methods must return at once in any case."""

    def publish(self, q: Floats) -> None:
        """Publish the coordinates q."""
        ...

    def pull(self, now: float) -> Floats:
        """Return the wrench (6,) [N, N m] of the hand, world axes, at the held point."""
        ...


@dataclass(frozen=True)
class LiveRun:
    """A run in real time, and its timetable; `device` is the class of its device, empty = the compiled device."""

    run: Run
    timetable: Timetable
    device: str = ""


class Loop:
    """The real-time loop of a simulation.

    Parameters
    ----------
    simulation : in its initial state; its time step is the period of the ticks.
    ticks : largest number of ticks.
    clock : default: the clock of this machine.
    budget : computes the row budget from the time left; None: impacts use all rows.
    audience : the viewer; None: no viewer.
    log : receives the record during the loop (`stream`); None: the record stays in memory (`run`).
    """

    def __init__(self, simulation: Simulation, ticks: int, clock: Clock | None = None,
                 budget: RowBudget | None = None, audience: Audience | None = None, log: RunLog | None = None) -> None:
        self.simulation, self.ticks, self.audience = simulation, ticks, audience
        self.clock: Clock = MonotonicClock() if clock is None else clock
        self.budget, self._rows = budget, int(simulation.state.row_budget[0])
        self._tape = Tape(simulation, ticks, log)
        self._under_way = False  # between the two halves of a step
        self._interrupted = False

    def run(self, world: str = "") -> LiveRun:
        """Run all ticks, or those before Ctrl-C or a failure; ``run.stopped`` gives the reason.

        Raises
        ------
        IapbError, KeyboardInterrupt
            The loop was stopped before its first step was complete.
        """
        deadlines, stopped = self._paced(None)
        timetable = deadlines.timetable(self._tape.steps)
        return LiveRun(self._tape.run(world, stopped), timetable, name_of(self.simulation.link))

    def stream(self) -> str:
        """Run all ticks like `run`, but write them to the log; return why the loop stopped early, "" if it did not."""
        _, stopped = self._paced(_TICKS_KEPT)
        try:
            self._tape.write_log(all_of_it=True)
        except RunFileError as error:
            return stopped or str(error)
        return stopped

    def _paced(self, kept: int | None) -> tuple[Deadlines, str]:
        """Run the ticks; return the timetable of the last `kept` ones, and why the loop stopped early."""
        stopped, dt = "", self.simulation.system.dt
        with self._until_interrupted(), _without_collector():
            deadlines = self._tape.deadlines = Deadlines(dt, self.ticks, self.clock.now() + dt, kept)
            try:
                while deadlines.done < self.ticks and not self._interrupted:
                    self._tick(deadlines)
                self.clock.wait_until(deadlines.due)
                self._finish()
            except IapbError as error:
                stopped = str(error)
            except Exception as error:  # a user's device may raise anything; finished steps are kept
                stopped = f"the device failed: {type(error).__name__}: {error}"
            self._release()
        steps = self._tape.steps
        if steps == 0:
            raise IapbError(stopped) if stopped else KeyboardInterrupt
        return deadlines, "" if steps == self.ticks else stopped or INTERRUPTED

    def _tick(self, deadlines: Deadlines) -> None:
        self.clock.wait_until(deadlines.due)
        start = self.clock.now()
        self._finish()
        self._give(deadlines)
        self.simulation.begin_step()
        self._under_way = True
        if self.audience is not None:
            self.audience.publish(self.simulation.state.q)
        end = self.clock.now()
        deadlines.close(start, end)
        self._tape.add_time(end - start)
        if self.budget is not None:
            self.budget.learn(end - start, self._rows_used())
        if self._tape.wants_spare and self.clock.now() + _SPARE_SECONDS < deadlines.due:
            self._tape.make_spare()
        elif self._tape.wants_log and self.clock.now() + _LOG_SECONDS < deadlines.due:
            self._tape.write_log()

    def _finish(self) -> None:
        """End the current step and record it."""
        if self._under_way:
            self._under_way = False
            self.simulation.end_step()
            self._tape.write()

    def _give(self, deadlines: Deadlines) -> None:
        """Set the row budget and the hand's wrench of the next step; record both, so that it can be repeated."""
        simulation, now = self.simulation, self.clock.now()
        if self.budget is not None:
            self._rows = self.budget.rows(deadlines.left(now))
            simulation.state.row_budget[0] = self._rows
        if self.audience is not None:
            simulation.port.wrench[:] = self.audience.pull(now)
        deadlines.note(self._rows, simulation.port.wrench)

    def _rows_used(self) -> int:
        log = self.simulation.state.impacts
        return int(log.rank[: log.logged[0]].sum()) if log.logged[0] else 0

    def _release(self) -> None:
        if self.simulation.link is not None:
            with suppress(Exception):  # the device may be the cause of the failure
                self.simulation.link.release()

    @contextmanager
    def _until_interrupted(self) -> Iterator[None]:
        """Let Ctrl-C end the loop after the current tick, so that every recorded step is complete."""
        def stop(*_: Any) -> None:
            self._interrupted = True

        try:
            before = signal.signal(signal.SIGINT, stop)
        except ValueError:  # not the main thread, which alone receives Ctrl-C
            yield
            return
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, before)


@contextmanager
def _without_collector() -> Iterator[None]:
    """Collect garbage before the loop, and switch the collector off during the loop."""
    was_on = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def name_of(link: Any) -> str:
    """Return the class name of the link's Python device; "" without a link."""
    return "" if link is None else f"{type(link.device).__module__}:{type(link.device).__qualname__}"


class Tape:
    """Records steps in chunks of a `Recorder`, and allocates the next chunk in advance when there is time.

    Parameters
    ----------
    simulation : in its initial state.
    steps : largest number of steps.
    log : receives the full chunks, with their ticks from `deadlines`; None: the recorder keeps them.
    """

    def __init__(self, simulation: Simulation, steps: int, log: RunLog | None = None) -> None:
        self._simulation, self._total, self._log = simulation, steps, log
        self._waiting: list[tuple[Record, int, float]] = []
        self.deadlines: Deadlines | None = None
        self._recorder = Recorder(simulation)
        self._record, self._size = self._recorder.blank(steps)
        simulation.prepare(self._record, singly=True)
        self._spare: tuple[Record, int] | None = None
        self._line, self._seconds = 0, 0.0

    @property
    def steps(self) -> int:
        """Return the number of recorded steps."""
        return self._recorder.steps + self._line

    def write(self) -> None:
        """Record the step that the simulation has just ended."""
        if self._line == self._size:
            self._keep()
            self._record, self._size = self._spare or self._recorder.blank(self._total)
            self._spare = None
        self._simulation.write(self._record, self._line)
        self._line += 1

    def add_time(self, seconds: float) -> None:
        """Add the working time of a tick to the timings of the run."""
        self._seconds += seconds

    @property
    def wants_spare(self) -> bool:
        """Return whether the next chunk should be allocated soon."""
        return self._spare is None and 2 * self._line > self._size and self._recorder.steps + self._size < self._total

    def make_spare(self) -> None:
        """Allocate the next chunk. This takes some tenths of a millisecond; call it only if no tick is due then."""
        self._spare = self._recorder.blank(self._total - self._size)

    def run(self, world: str, stopped: str) -> Run:
        """Return everything recorded so far as a Run."""
        self._keep()
        return self._recorder.run(world, stopped)

    def _keep(self) -> None:
        if self._log is None:
            self._recorder.keep(self._record, self._line, self._seconds)
        else:
            self._waiting.append((self._record, self._line, self._seconds))
            self._recorder.go_on(self._recorder.steps + self._line)
        self._line, self._seconds = 0, 0.0
        if len(self._waiting) > _MOST_WAITING:
            self.write_log()

    @property
    def wants_log(self) -> bool:
        """Return whether a full chunk is waiting to be written to the log."""
        return bool(self._waiting)

    def write_log(self, *, all_of_it: bool = False) -> None:
        """Write the oldest waiting chunk to the log; with `all_of_it` all chunks, including the unfinished one."""
        if all_of_it:
            self._keep()
        while self._waiting and self._log is not None and self.deadlines is not None:
            record, lines, seconds = self._waiting.pop(0)
            self._log.write_chunk(record, lines, seconds, (self.deadlines.rows(self._log.steps, lines),))
            if not all_of_it:
                break

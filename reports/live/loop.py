"""The haptic loop: one step of the simulation at each tick of a clock.

    wait for the tick
        read the device, which has moved since the last tick, and record the step that ends now
        compute the row budget of the next step from the time left, and read the hand's wrench
        begin the next step: compute coupling and contact law, send the force to the device
        publish the coordinates for the viewer

The loop never waits for a lock or for the viewer. Python's garbage collector is off during the loop. A part is written
(`reports.store.parts`) when enough time is left before the next tick, or when too many chunks are waiting.
"""

from __future__ import annotations

import gc
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from iapb.errors import IapbError, RunFileError
from iapb.recording import Recorder
from iapb.run import Run
from iapb.simulation import INTERRUPTED, Simulation
from reports.live.budget import RowBudget
from reports.live.deadline import TICK_COLUMNS, Clock, Timetable
from reports.store.parts import Parts

if TYPE_CHECKING:
    from reports.live.viewer import Viewer

Floats = NDArray[np.float64]

_SPARE_SECONDS = 4e-4  # [s] a chunk is allocated in advance only if this much of the period is left
_WRITE_SECONDS = 7e-4  # [s] a chunk is written if this much of the period is left
_MOST_WAITING = 8  # or if more chunks than this are waiting


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
    audience : the viewer, whose `publish` and `pull` return at once in any case; None: no viewer.
    parts : receive the record during the loop (`stream`); None: the record stays in memory (`run`).
    """

    def __init__(self, simulation: Simulation, ticks: int, clock: Clock | None = None,
                 budget: RowBudget | None = None, audience: Viewer | None = None, parts: Parts | None = None) -> None:
        self.simulation, self.ticks, self.budget, self.audience = simulation, ticks, budget, audience
        self.clock = Clock() if clock is None else clock
        self._tape = Tape(simulation, ticks, parts)
        self._first = self._due = 0.0  # when the first tick was due, and when the next one is
        self._under_way = False  # between the two halves of a step
        self._interrupted = False

    def run(self, world: str = "") -> LiveRun:
        """Run all ticks, or those before Ctrl-C or a failure; ``run.stopped`` gives the reason.

        Raises
        ------
        IapbError, KeyboardInterrupt
            The loop was stopped before its first step was complete.
        """
        return self._tape.run(world, self._paced())

    def stream(self) -> str:
        """Run all ticks like `run`, but write them to parts; return why the loop stopped early, "" if it did not."""
        stopped = self._paced()
        try:
            self._tape.write_parts(all_of_it=True)
        except RunFileError as error:
            return stopped or str(error)
        return stopped

    def _paced(self) -> str:
        """Run the ticks; return why the loop stopped early, "" if it did not."""
        stopped, link = "", self.simulation.link
        with self._undisturbed():
            self._first = self._due = self.clock.now() + self.simulation.system.dt
            try:
                for _ in range(self.ticks):
                    if self._interrupted:
                        break
                    self._tick()
                self.clock.wait_until(self._due)
                self._finish()
            except IapbError as error:
                stopped = str(error)
            except Exception as error:  # a user's device may raise anything; finished steps are kept
                stopped = f"the device failed: {type(error).__name__}: {error}"
            if link is not None:
                with suppress(Exception):  # the device may be the cause of the failure
                    link.release()
        if self._tape.steps == 0:
            raise IapbError(stopped) if stopped else KeyboardInterrupt
        return "" if self._tape.steps == self.ticks else stopped or INTERRUPTED

    def _tick(self) -> None:
        simulation, tape, period = self.simulation, self._tape, self.simulation.system.dt
        self.clock.wait_until(self._due)
        start = self.clock.now()
        self._finish()
        tick, now = tape.tick(), self.clock.now()
        if self.budget is not None:
            simulation.state.row_budget[0] = self.budget.rows(self._due + period - now)
        if self.audience is not None:
            simulation.port.wrench[:] = self.audience.pull(now)
        tick[3], tick[4:] = simulation.state.row_budget[0], simulation.port.wrench  # so that it can be repeated
        simulation.begin_step()
        self._under_way = True
        if self.audience is not None:
            self.audience.publish(simulation.state.q)
        end = self.clock.now()
        tick[0], tick[1], tick[2] = self._due - self._first, start - self._first, end - self._first
        self._due = max(self._due + period, end)  # after a missed deadline: at once
        if self.budget is not None:
            log = simulation.state.impacts
            self.budget.learn(end - start, int(log.rank[: log.logged[0]].sum()))
        if tape.wants_spare and self.clock.now() + _SPARE_SECONDS < self._due:
            tape.make_spare()
        elif tape.has_waiting and self.clock.now() + _WRITE_SECONDS < self._due:
            tape.write_parts()

    def _finish(self) -> None:
        """End the current step and record it."""
        if self._under_way:
            self._under_way = False
            self.simulation.end_step()
            self._tape.write()

    @contextmanager
    def _undisturbed(self) -> Iterator[None]:
        """Keep the garbage collector off; let Ctrl-C end the loop after the current tick, so that steps are whole."""
        def stop(*_: Any) -> None:
            self._interrupted = True

        main, collects = threading.current_thread() is threading.main_thread(), gc.isenabled()
        before = signal.signal(signal.SIGINT, stop) if main else None  # the main thread alone receives Ctrl-C
        gc.collect()
        gc.disable()
        try:
            yield
        finally:
            if collects:
                gc.enable()
            if main:
                signal.signal(signal.SIGINT, before)


def name_of(link: Any) -> str:
    """Return the class name of the link's Python device; "" without a link."""
    return "" if link is None else f"{type(link.device).__module__}:{type(link.device).__qualname__}"


class Tape:
    """Records steps and their ticks in chunks, and allocates the next chunk in advance when there is time.

    Parameters
    ----------
    simulation : in its initial state.
    steps : largest number of steps.
    parts : receive the full chunks; None: the tape keeps them.
    """

    def __init__(self, simulation: Simulation, steps: int, parts: Parts | None = None) -> None:
        self._simulation, self._total, self._parts = simulation, steps, parts
        self._recorder, self._held = Recorder(simulation), list[Floats]()  # the ticks of each chunk of the recorder
        self._line = 0
        self._spare: tuple[Any, Floats] | None = None
        self._record, self._ticks = self._blank(steps)
        simulation.prepare(self._record, singly=True)

    def _blank(self, steps: int) -> tuple[Any, Floats]:
        record, size = self._recorder.blank(steps)
        return record, np.zeros((size, TICK_COLUMNS))

    @property
    def steps(self) -> int:
        """Return the number of recorded steps."""
        return self._recorder.steps + self._line

    def tick(self) -> Floats:
        """Return the row (TICK_COLUMNS,) for the tick of the step that begins now."""
        if self._line == len(self._ticks):
            self._keep()
            self._record, self._ticks = self._spare or self._blank(self._total)
            self._spare = None
        row: Floats = self._ticks[self._line]
        return row

    def write(self) -> None:
        """Record the step that the simulation has just ended."""
        self._simulation.write(self._record, self._line)
        self._line += 1

    @property
    def wants_spare(self) -> bool:
        """Return whether the next chunk should be allocated soon."""
        size = len(self._ticks)
        return self._spare is None and 2 * self._line > size and self._recorder.steps + size < self._total

    def make_spare(self) -> None:
        """Allocate the next chunk. This takes some tenths of a millisecond; call it only if no tick is due then."""
        self._spare = self._blank(self._total - len(self._ticks))

    def run(self, world: str, stopped: str) -> LiveRun:
        """Return everything recorded so far."""
        self._keep()
        timetable = Timetable(self._simulation.system.dt, np.concatenate(self._held))
        return LiveRun(self._recorder.run(world, stopped), timetable, name_of(self._simulation.link))

    def _keep(self) -> None:
        ticks = self._ticks[: self._line]
        self._recorder.keep(self._record, self._line, float((ticks[:, 2] - ticks[:, 1]).sum()))
        self._held.append(ticks)
        self._line = 0
        if self.has_waiting and len(self._held) > _MOST_WAITING:
            self.write_parts()

    @property
    def has_waiting(self) -> bool:
        """Return whether a full chunk is waiting to be written."""
        return self._parts is not None and bool(self._held)

    def write_parts(self, *, all_of_it: bool = False) -> None:
        """Write the oldest waiting chunk as a part; with `all_of_it` all chunks, including the unfinished one."""
        if all_of_it:
            self._keep()
        while self.has_waiting:
            self._parts.write(*self._recorder.chunks.pop(0), self._held.pop(0))  # type: ignore[union-attr]
            if not all_of_it:
                break

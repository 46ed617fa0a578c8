"""The haptic loop: one step of the simulation at each tick of a clock.

    wait for the tick
        read the device, which has moved since the last tick, and record the step that ends now
        compute the row budget of the next step from the time left, and read the hand's wrench
        begin the next step: compute coupling and contact law, send the force to the device
        publish the coordinates for the viewer

The loop never waits for a lock or for the viewer. Python's garbage collector is off. The next chunk of the record is
allocated, and a full one written as a part (`reports.store.parts`), when enough time is left before the next tick, or
when too many chunks are waiting.
"""

from __future__ import annotations

import gc
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from iapb.errors import IapbError, RunFileError
from iapb.recording import Recorder
from iapb.simulation import INTERRUPTED, Simulation
from reports.live.budget import RowBudget
from reports.live.deadline import TICK_COLUMNS, Clock
from reports.store.parts import Parts

if TYPE_CHECKING:
    from reports.live.viewer import Viewer

Floats = NDArray[np.float64]

_SPARE_SECONDS = 4e-4  # [s] a chunk is allocated in advance only if this much of the period is left
_WRITE_SECONDS = 7e-4  # [s] a chunk is written if this much of the period is left
_MOST_WAITING = 8  # or if more chunks than this are waiting


class Loop:
    """The real-time loop of a simulation.

    Parameters
    ----------
    simulation : in its initial state; its time step is the period of the ticks.
    ticks : largest number of ticks.
    parts : receive the record, with a row of each tick.
    clock : default: the clock of this machine.
    budget : computes the row budget from the time left; None: impacts use all rows.
    audience : the viewer, whose `publish` and `pull` return at once in any case; None: no viewer.
    """

    def __init__(self, simulation: Simulation, ticks: int, parts: Parts, clock: Clock | None = None,
                 budget: RowBudget | None = None, audience: Viewer | None = None) -> None:  # fmt: skip
        self.simulation, self.ticks, self.budget, self.audience = simulation, ticks, budget, audience
        self.clock = Clock() if clock is None else clock
        self._first = self._due = 0.0  # when the first tick was due, and when the next one is
        self._under_way = False  # between the two halves of a step
        self._interrupted = False
        self._parts, self._recorder, self._held = parts, Recorder(simulation), list[Floats]()  # ticks of the chunks
        self._line = 0
        self._spare: tuple[Any, Floats] | None = None
        self._record, self._ticks = self._blank(ticks)
        simulation.prepare()

    def run(self) -> str:
        """Run all ticks, or those before Ctrl-C or a failure; return why the loop stopped early, "" if it did not.

        Raises
        ------
        IapbError, KeyboardInterrupt
            The loop was stopped before its first step was complete.
        """
        stopped = self._paced()
        try:
            self._keep()
            while self._held:
                self._write_part()
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
        steps = self._recorder.steps + self._line
        if steps == 0:
            raise IapbError(stopped) if stopped else KeyboardInterrupt
        return "" if steps == self.ticks else stopped or INTERRUPTED

    def _tick(self) -> None:
        simulation, period = self.simulation, self.simulation.system.dt
        self.clock.wait_until(self._due)
        start = self.clock.now()
        self._finish()
        if self._line == len(self._ticks):
            self._keep()
            self._record, self._ticks = self._spare or self._blank(self.ticks)
            self._spare = None
        tick, now = self._ticks[self._line], self.clock.now()
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
        size = len(self._ticks)
        wants_spare = self._spare is None and 2 * self._line > size and self._recorder.steps + size < self.ticks
        if wants_spare and self.clock.now() + _SPARE_SECONDS < self._due:
            self._spare = self._blank(self.ticks - size)
        elif self._held and self.clock.now() + _WRITE_SECONDS < self._due:
            self._write_part()

    def _finish(self) -> None:
        """End the current step and record it."""
        if self._under_way:
            self._under_way = False
            self.simulation.end_step()
            self.simulation.write(self._record, self._line)
            self._line += 1

    def _blank(self, total: int) -> tuple[Any, Floats]:
        record, size = self._recorder.blank(total)
        return record, np.zeros((size, TICK_COLUMNS))

    def _keep(self) -> None:
        ticks = self._ticks[: self._line]
        self._recorder.keep(self._record, self._line, float((ticks[:, 2] - ticks[:, 1]).sum()))
        self._held.append(ticks)
        self._line = 0
        if len(self._held) > _MOST_WAITING:
            self._write_part()

    def _write_part(self) -> None:
        """Write the oldest full chunk."""
        self._parts.write(*self._recorder.chunks.pop(0), self._held.pop(0))

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

"""The haptic loop: one step of the simulation at each tick of a clock.

    wait for the tick
        the device has moved meanwhile: read it, write the step that ends here
        rows that the next step's impact may use, from the time left; where the hand pulls
        begin the next step: coupling, contact law, the force goes to the device
        publish where everything is, for whoever looks

Nothing in it waits for anybody: no lock, no file, no viewer, and Python's collector of garbage rests.
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

_SPARE_SECONDS = 4e-4  # a chunk is made only where this much is left of the period, or nothing is left anyway
_LOG_SECONDS = 7e-4  # and written where this much is left,
_MOST_WAITING = 8  # or so many wait
_TICKS_KEPT = 16 * 512  # more than the ticks of the chunks that wait


class Audience(Protocol):
    """Who looks on and may pull: must answer at once, whatever happens to the one behind it."""

    def publish(self, q: Floats) -> None:
        """Say where everything is."""
        ...

    def pull(self, now: float) -> Floats:
        """Return the wrench (6,) [N, N m] of the hand, world axes, at the held point."""
        ...


@dataclass(frozen=True)
class LiveRun:
    """A run in real time, and its timetable; `device` says what device it had, empty = the compiled one."""

    run: Run
    timetable: Timetable
    device: str = ""


class Loop:
    """A simulation, paced.

    Parameters
    ----------
    simulation : at its start; its step is the period of the ticks.
    ticks : at most this many.
    clock : default: this machine's.
    budget : rows from the time left; None: always all.
    audience : who looks on; None: nobody.
    log : takes what is recorded while the loop is at work (`stream`); None: it is held in memory (`run`).
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
        """Do all ticks, or as many as there are before Ctrl-C or a failure: ``run.stopped`` says which.

        Raises
        ------
        IapbError, KeyboardInterrupt
            Stopped before the first step was done: there is nothing to return.
        """
        deadlines, stopped = self._paced(None)
        timetable = deadlines.timetable(self._tape.steps)
        return LiveRun(self._tape.run(world, stopped), timetable, name_of(self.simulation.link))

    def stream(self) -> str:
        """Do all ticks as `run` does, into the log; return why they are not all done, "" where they are."""
        _, stopped = self._paced(_TICKS_KEPT)
        try:
            self._tape.write_log(all_of_it=True)
        except RunFileError as error:
            return stopped or str(error)
        return stopped

    def _paced(self, kept: int | None) -> tuple[Deadlines, str]:
        """Do the ticks; return their timetable, of which the last `kept` are there, and what stopped them."""
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
            except Exception as error:  # a device of somebody's own: whatever it does, what was done is kept
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
        """End the step that is under way, and write it."""
        if self._under_way:
            self._under_way = False
            self.simulation.end_step()
            self._tape.write()

    def _give(self, deadlines: Deadlines) -> None:
        """Rows and hand of the next step; both are noted, so that the step can be done again."""
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
            with suppress(Exception):  # it may be what failed
                self.simulation.link.release()

    @contextmanager
    def _until_interrupted(self) -> Iterator[None]:
        """Ctrl-C ends the loop after the tick at hand; a step is never left half written."""
        def stop(*_: Any) -> None:
            self._interrupted = True

        try:
            before = signal.signal(signal.SIGINT, stop)
        except ValueError:  # not the main thread: nobody's Ctrl-C arrives here
            yield
            return
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, before)


@contextmanager
def _without_collector() -> Iterator[None]:
    """Garbage is collected before and after, not in the middle of a step."""
    was_on = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def name_of(link: Any) -> str:
    """Return the class of a device of its own, "" where there is none."""
    return "" if link is None else f"{type(link.device).__module__}:{type(link.device).__qualname__}"


class Tape:
    """Lines of a `Recorder`, with the next chunk made beforehand, while there is time.

    Parameters
    ----------
    simulation : at its start.
    steps : how many there can be.
    log : takes the chunks that are full, with their ticks of `deadlines`; None: the recorder holds them.
    """

    def __init__(self, simulation: Simulation, steps: int, log: RunLog | None = None) -> None:
        self._simulation, self._total, self._log = simulation, steps, log
        self._waiting: list[tuple[Record, int, float]] = []
        self.deadlines: Deadlines | None = None
        self._recorder = Recorder(simulation)
        self._record, self._size = self._recorder.blank(steps)
        simulation.stepper.prepare(self._record)
        self._spare: tuple[Record, int] | None = None
        self._line, self._seconds = 0, 0.0

    @property
    def steps(self) -> int:
        """Steps written."""
        return self._recorder.steps + self._line

    def write(self) -> None:
        """Write the step that the simulation has just ended."""
        if self._line == self._size:
            self._keep()
            self._record, self._size = self._spare or self._recorder.blank(self._total)
            self._spare = None
        self._simulation.stepper.write(self._record, self._line, self._simulation.steps_done - 1)
        self._line += 1

    def add_time(self, seconds: float) -> None:
        """Work of a tick, for the run's own timings."""
        self._seconds += seconds

    @property
    def wants_spare(self) -> bool:
        """Whether the next chunk should be made soon."""
        return self._spare is None and 2 * self._line > self._size and self._recorder.steps + self._size < self._total

    def make_spare(self) -> None:
        """Make the next chunk; some tenths of a millisecond, so not while a tick is due."""
        self._spare = self._recorder.blank(self._total - self._size)

    def run(self, world: str, stopped: str) -> Run:
        """Everything written so far as a Run."""
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
        """Whether a full chunk waits for the log."""
        return bool(self._waiting)

    def write_log(self, *, all_of_it: bool = False) -> None:
        """Write the oldest chunk that waits; or all of them, and what there is of the next one."""
        if all_of_it:
            self._keep()
        while self._waiting and self._log is not None and self.deadlines is not None:
            record, lines, seconds = self._waiting.pop(0)
            self._log.write_chunk(record, lines, seconds, (self.deadlines.rows(self._log.steps, lines),))
            if not all_of_it:
                break

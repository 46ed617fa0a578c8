"""The record of a run that is written one step at a time, without a pause between two chunks."""

from __future__ import annotations

from iapb.recorder import Recorder
from iapb.recording import Record
from iapb.run import Run
from iapb.simulation import Simulation


class Tape:
    """Lines of a `Recorder`, with the next chunk made beforehand, while there is time.

    Parameters
    ----------
    simulation : at its start.
    steps : how many there can be.
    """

    def __init__(self, simulation: Simulation, steps: int) -> None:
        self._simulation, self._total = simulation, steps
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
        self._recorder.keep(self._record, self._line, self._seconds)
        self._line, self._seconds = 0, 0.0

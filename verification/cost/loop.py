"""The loop in which the time of a step is measured: the loop of `simulate`, with its record."""

from __future__ import annotations

from functools import partial
from typing import Any

from iapb.recording import Recorder
from verification.clock import timed


class RecordedLoop:
    """A simulation that starts again from its first state for every sample.

    Parameters
    ----------
    simulation : an `iapb.simulation.Simulation`
    steps : number of steps of one sample

    Attributes
    ----------
    recording : the Recorder of the last sample
    """

    def __init__(self, simulation: Any, steps: int) -> None:
        self.simulation, self.steps = simulation, steps
        self.recording: Recorder

    def sample(self) -> float:
        """Return the time per step of one whole run [s]; raise the error that stops the run before its end."""
        simulation, system = self.simulation, self.simulation.system
        simulation.state, simulation.steps_done = system.make_state(), 0
        simulation.port = system.make_port(simulation.coupling)
        self.recording, total = Recorder(simulation), 0.0
        while self.recording.steps < self.steps:
            record, size = self.recording.blank(self.steps)
            if self.recording.steps == 0:
                simulation.prepare(record)  # the timed call contains steps only
            (done, stop), spent = timed(partial(simulation.advance_chunk, record, size))
            self.recording.keep(record, done, spent)
            total += spent
            if stop is not None:
                raise stop
        return total / self.steps

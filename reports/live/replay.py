"""A live run done again, from what was recorded: the same bits, without the clock."""

from __future__ import annotations

from numpy.typing import ArrayLike

from iapb.haptics.device import DeviceReading
from iapb.run import Run
from iapb.simulation import Simulation
from reports.live.loop import LiveRun
from reports.live.tape import Tape
from reports.resimulate import coupling_of, law_of, scene_of


class RecordedDevice:
    """The device of a run: it was where it was, whatever it is told."""

    def __init__(self, run: Run) -> None:
        self._run, self._step = run, 0

    def read(self) -> DeviceReading:
        """Return the reading that the run has at this instant."""
        return DeviceReading(self._run.device_q[self._step], self._run.device_v[self._step])

    def apply(self, force: ArrayLike) -> None:
        """Let a step pass."""
        self._step += 1


def replay(live: LiveRun) -> Run:
    """Simulate a live run again with its budgets, its hand and, where it had one of its own, its device's readings.

    Returns
    -------
    Run
        With the content hash of ``live.run``, however late any of its ticks was.

    Raises
    ------
    ArgumentError
        Its law or coupling is not one of ours (`reports.resimulate`).
    """
    run, timetable = live.run, live.timetable
    device = RecordedDevice(run) if live.device else None
    simulation = Simulation(scene_of(run), law_of(run), coupling_of(run), device)
    tape = Tape(simulation, run.steps)
    for budget, wrench in zip(timetable.budget, timetable.wrench, strict=True):
        simulation.state.row_budget[0] = budget
        simulation.port.wrench[:] = wrench
        simulation.begin_step()
        simulation.end_step()
        tape.write()
    return tape.run(run.world, run.stopped)

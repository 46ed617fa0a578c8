"""Store a live run in two files (run and timetable), and repeat it from them, bit for bit and without the clock."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from iapb.haptics.device import DeviceReading
from iapb.recording import Recorder
from iapb.run import Run
from iapb.simulation import Simulation
from reports.live.deadline import TICK, TICK_COLUMNS, Pace, Tally, Timetable
from reports.live.loop import LiveRun, Tape, name_of
from reports.resimulate import coupling_of, law_of, scene_of
from reports.store.io import mark_store
from reports.store.logs import LOG_SUFFIX, RunLog, read_log
from reports.store.runs import read_run, store_parts
from reports.store.tables import Column, Table, growing_table, read_tables
from reports.streaming import log_head, log_of, parts_of, simulation_of

_COMPILED = "compiled"


def _timetable_of(run: Path) -> Path:
    return run.with_name(run.stem + "-timetable.h5")


def open_log(folder: Path, name: str, simulation: Simulation, world: str, ticks: int) -> RunLog:
    """Return the log of a live run that will become ``name.h5``; mark the folder as a store, so that repair works."""
    mark_store(folder)
    start = {name: values.tolist() for name, values in Recorder(simulation).start.items()}
    more = {"device": name_of(simulation.link), "period": simulation.system.dt, "start": start}
    return RunLog(log_of(folder / f"{name}.h5"), log_head(simulation, world, ticks, live=more))


def finish_live(log: Path, stopped: str, ticks: int = 0) -> tuple[Path, Path, Pace]:
    """Write the run and the timetable in a log to their files, in constant memory; return both and the measured pace.

    Raises
    ------
    RunFileError
        The log has fewer complete ticks than `ticks`.
    """
    head, _ = read_log(log)
    told, rows, tally = head["live"], list[Any](), Tally()
    period = float(told["period"])
    joiner = Recorder(simulation_of(head))
    joiner.start = {name: np.array(values, np.float64) for name, values in told["start"].items()}
    path = log.with_name(log.name.removesuffix(LOG_SUFFIX))

    def parts(append: Callable[[Table], None]) -> Iterator[Run]:
        for part in parts_of(log, joiner, str(head["world"]), ticks, TICK_COLUMNS, rows):
            timetable = Timetable(period, np.concatenate(rows))
            rows.clear()
            append(ticks_table(timetable, path.name))
            tally.add(part, timetable)
            yield part

    session = Table("session", (
        Column("period", np.array([period]), "s", "of the ticks"),
        Column("device", (told["device"] or _COMPILED,), "1", "the device's class; compiled: simulated in the loop"),
    ))  # fmt: skip
    with growing_table(_timetable_of(path), (session,)) as append:
        store_parts(path, parts(append), stopped=stopped, key="", replace=True)
    return path, _timetable_of(path), tally.pace()


def is_live(log: Path) -> bool:
    """Return whether a log belongs to a live run."""
    return "live" in read_log(log)[0]


def read_live(path: Path | str) -> LiveRun:
    """Read a live run from its two files; `path` is the file of the run."""
    tables = read_tables(_timetable_of(Path(path)))
    period, device = (tables["session"][name][0] for name in ("period", "device"))
    rows = np.column_stack([tables["ticks"][name] for name, _, _ in TICK])
    return LiveRun(read_run(path), Timetable(float(period), rows), "" if device == _COMPILED else str(device))


def ticks_table(timetable: Timetable, run: str) -> Table:
    """Return a timetable as a table, one row per tick; `run` is the name of the run's file."""
    def values(name: str, k: int) -> Any:
        return timetable.budget if name == "budget" else timetable.rows[:, k]

    columns = [Column(name, values(name, k), unit, meaning) for k, (name, unit, meaning) in enumerate(TICK)]
    columns.insert(3, Column("missed", timetable.missed, "1", "1 where the next tick was due before"))
    return Table("ticks", tuple(columns), title="When each step of a live run was due and done", runs=(run,))


class RecordedDevice:
    """The device of a recorded run: it replays the recorded positions and ignores forces."""

    def __init__(self, run: Run) -> None:
        self._run, self._step = run, 0

    def read(self) -> DeviceReading:
        """Return the reading that was recorded for the current step."""
        return DeviceReading(self._run.device_q[self._step], self._run.device_v[self._step])

    def apply(self, force: ArrayLike) -> None:
        """Advance to the next step; the force is ignored."""
        self._step += 1


def replay(live: LiveRun) -> Run:
    """Simulate a live run again with its row budgets, its wrenches and, for a Python device, its recorded readings.

    Returns
    -------
    Run
        It has the content hash of ``live.run``, also if ticks were late.

    Raises
    ------
    ArgumentError
        The law or coupling is not one of the project's (`reports.resimulate`).
    """
    run, timetable = live.run, live.timetable
    device = RecordedDevice(run) if live.device else None
    simulation = Simulation(scene_of(run), law_of(run), coupling_of(run), device)
    tape = Tape(simulation, run.steps)
    for row in timetable.rows:
        tape.tick()[:] = row
        simulation.state.row_budget[0], simulation.port.wrench[:] = row[3], row[4:]
        simulation.begin_step()
        simulation.end_step()
        tape.write()
    return tape.run(run.world, run.stopped).run

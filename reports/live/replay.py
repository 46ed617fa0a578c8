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
from reports.live.deadline import TICK_COLUMNS, Timetable, timetable_of
from reports.live.loop import LiveRun, Tape, name_of
from reports.live.measure import Pace, Tally
from reports.resimulate import coupling_of, law_of, scene_of
from reports.store.io import mark_store
from reports.store.logs import LOG_SUFFIX, RunLog, read_log
from reports.store.runs import read_run, store_parts, write_run
from reports.store.tables import Column, Table, growing_table, read_tables, write_tables
from reports.streaming import log_head, log_of, parts_of, simulation_of

_WRENCH = ("force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z")
_SUFFIX = "-timetable.h5"


def write_live(folder: Path | str, live: LiveRun, name: str) -> tuple[Path, Path]:
    """Write run and timetable as ``name.h5`` and ``name-timetable.h5``; return both paths."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    path = write_run(folder / f"{name}.h5", live.run)
    tables = ticks_table(live.timetable, path.name), _session(live.timetable.period, live.device)
    return path, write_tables(_timetable_of(path), tables)


def _timetable_of(run: Path) -> Path:
    return run.with_name(run.stem + _SUFFIX)


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
            timetable = timetable_of(period, np.concatenate(rows))
            rows.clear()
            append(ticks_table(timetable, path.name))
            tally.add(part, timetable)
            yield part

    with growing_table(_timetable_of(path), (_session(period, str(told["device"])),)) as append:
        store_parts(path, parts(append), stopped=stopped, key="", replace=True)
    return path, _timetable_of(path), tally.pace()


def is_live(log: Path) -> bool:
    """Return whether a log belongs to a live run."""
    return "live" in read_log(log)[0]


def read_live(path: Path | str) -> LiveRun:
    """Read a live run from its two files; `path` is the file of the run."""
    path = Path(path)
    return LiveRun(read_run(path), *_timetable_and_device(path))


def _timetable_and_device(path: Path) -> tuple[Timetable, str]:
    tables = read_tables(_timetable_of(path))
    ticks, session = tables["ticks"], tables["session"]
    wrench = np.column_stack([ticks[name] for name in _WRENCH])
    due, start, end, budget = (np.asarray(ticks[name]) for name in ("due", "start", "end", "budget"))
    return Timetable(float(session["period"][0]), due, start, end, budget, wrench), _device_in(session)


def ticks_table(timetable: Timetable, run: str = "") -> Table:
    """Return a timetable as a table, one row per tick."""
    def column(name: str, values: Any, unit: str, meaning: str) -> Column:
        return Column(name, values, unit, meaning)

    return Table("ticks", (
        column("due", timetable.due, "s", "when the tick was due, since the first one"),
        column("start", timetable.start, "s", "when it began"),
        column("end", timetable.end, "s", "when its work was done"),
        column("missed", timetable.missed, "1", "1 where the next tick was due before"),
        column("budget", timetable.budget, "1", "rows that an impact of the step could use"),
        *(column(name, timetable.wrench[:, i], "N" if i < 3 else "N m", f"of the hand, {name}")
          for i, name in enumerate(_WRENCH)),
    ), title="When each step of a live run was due and done", runs=(run,) if run else ())  # fmt: skip


def _session(period: float, device: str) -> Table:
    return Table("session", (
        Column("period", np.array([period]), "s", "of the ticks"),
        Column("device", (device or "compiled",), "1", "the device's class; compiled: simulated in the loop"),
    ))  # fmt: skip


def _device_in(session: Table) -> str:
    device = str(session["device"][0])
    return "" if device == "compiled" else device


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
    for budget, wrench in zip(timetable.budget, timetable.wrench, strict=True):
        simulation.state.row_budget[0] = budget
        simulation.port.wrench[:] = wrench
        simulation.begin_step()
        simulation.end_step()
        tape.write()
    return tape.run(run.world, run.stopped)

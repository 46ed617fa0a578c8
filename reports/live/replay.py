"""Store a live run in two files (run and timetable), and repeat it from them, bit for bit and without the clock."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from iapb.haptics.device import DeviceReading
from iapb.recording import Recorder
from iapb.run import Run
from iapb.simulation import Simulation
from reports.live.deadline import TICK, Pace, Tally, Timetable
from reports.provenance import collect_provenance
from reports.resimulate import coupling_of, law_of, scene_of, simulation_of
from reports.store.io import mark_store, new_file, refuse_foreign
from reports.store.parts import Parts, parts_of, read_head
from reports.store.runs import read_run, store_run
from reports.store.tables import append_columns, read_columns, write_head
from reports.streaming import joined, parts_head

_COMPILED = "compiled"


class LiveRun(NamedTuple):
    """A run in real time, and its timetable; `device` is the class of its device, empty = the compiled device."""

    run: Run
    timetable: Timetable
    device: str = ""


def _timetable_of(run: Path) -> Path:
    return run.with_name(run.stem + "-timetable.h5")


def open_parts(folder: Path, name: str, simulation: Simulation, world: str, ticks: int) -> Parts:
    """Return the parts of a live run that will become ``name.h5``; mark the folder as a store, so that repair works."""
    mark_store(folder)
    start = {name: values.tolist() for name, values in Recorder(simulation).start.items()}
    device = type(simulation.link.device) if simulation.link else None
    told = f"{device.__module__}:{device.__qualname__}" if device else ""
    more = {"device": told, "period": simulation.system.dt, "start": start}
    return Parts(parts_of(folder / f"{name}.h5"), parts_head(simulation, world, ticks, live=more), synced=False)


def finish_live(folder: Path, stopped: str, ticks: int = 0) -> tuple[Path, Path, Pace]:
    """Write the run and the timetable in parts to their files, in constant memory; return both and the measured pace.

    Raises
    ------
    RunFileError
        The parts have fewer complete ticks than `ticks`.
    """
    head = read_head(folder)
    told, rows, tally = head["live"], list[Any](), Tally()
    period = float(told["period"])
    recorder = Recorder(simulation_of(head))
    recorder.start = {name: np.array(values, np.float64) for name, values in told["start"].items()}
    path = folder.with_suffix("")
    for target in (path, _timetable_of(path)):
        refuse_foreign(target)

    def pieces(group: Any) -> Iterator[Run]:
        for piece in joined(folder, recorder, str(head["world"]), ticks, rows):
            timetable = Timetable(period, np.concatenate(rows))
            rows.clear()
            append_columns(group, _columns(timetable))
            tally.add(piece, timetable)
            yield piece

    with new_file(_timetable_of(path), replace=True, large=True) as file:
        write_head(file, collect_provenance())
        store_run(path, pieces(file.create_group("ticks", track_order=True)), stopped=stopped, key="", replace=True)
        append_columns(file.create_group("session", track_order=True), [
            ("period", "s", "of the ticks", np.array([period])),
            ("device", "1", "the device's class; compiled: simulated in the loop", (told["device"] or _COMPILED,))])
    return path, _timetable_of(path), tally.pace()


def is_live(folder: Path) -> bool:
    """Return whether parts belong to a live run."""
    return "live" in read_head(folder)


def read_live(path: Path | str) -> LiveRun:
    """Read a live run from its two files; `path` is the file of the run."""
    timetable = _timetable_of(Path(path))
    ticks, session = (read_columns(timetable, name) for name in ("ticks", "session"))
    rows = np.column_stack([ticks[name][1] for name, _, _ in TICK])
    period, device = float(session["period"][1][0]), str(session["device"][1][0])
    return LiveRun(read_run(path), Timetable(period, rows), "" if device == _COMPILED else device)


def _columns(timetable: Timetable) -> list[tuple[str, str, str, Any]]:
    """Return name, unit, meaning and values of each column of a timetable."""
    columns: list[tuple[str, str, str, Any]] = [
        (*tick, timetable.budget if tick[0] == "budget" else timetable.rows[:, k]) for k, tick in enumerate(TICK)]
    columns.insert(3, ("missed", "1", "1 where the next tick was due before", timetable.missed.astype(np.uint8)))
    return columns


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
    recorder = Recorder(simulation)
    while recorder.steps < run.steps:
        record, size = recorder.blank(run.steps)
        if not recorder.steps:
            simulation.prepare()
        for line, row in enumerate(timetable.rows[recorder.steps:][:size]):
            simulation.state.row_budget[0], simulation.port.wrench[:] = row[3], row[4:]
            simulation.begin_step()
            simulation.end_step()
            simulation.write(record, line)
        recorder.keep(record, size, 0.0)
    return recorder.run(run.world, run.stopped)

"""A live run in two files: the run itself, and its timetable beside it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from reports.live.deadline import Timetable
from reports.live.loop import LiveRun
from reports.store.runs import read_run, write_run
from reports.store.tables import Column, Table, read_tables, write_tables

_WRENCH = ("force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z")
_SUFFIX = "-timetable.h5"


def write_live(folder: Path | str, live: LiveRun, name: str) -> tuple[Path, Path]:
    """Write run and timetable as ``name.h5`` and ``name-timetable.h5``; return both paths."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    path = write_run(folder / f"{name}.h5", live.run)
    return path, write_tables(folder / f"{name}{_SUFFIX}", (ticks_table(live.timetable, path.name), _session(live)))


def read_live(path: Path | str) -> LiveRun:
    """Read a live run back from its two files; `path` is that of the run."""
    path = Path(path)
    tables = read_tables(path.with_name(path.stem + _SUFFIX))
    ticks, session = tables["ticks"], tables["session"]
    wrench = np.column_stack([ticks[name] for name in _WRENCH])
    due, start, end, budget = (np.asarray(ticks[name]) for name in ("due", "start", "end", "budget"))
    timetable = Timetable(float(session["period"][0]), due, start, end, budget, wrench)
    return LiveRun(read_run(path), timetable, _device_in(session))


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


def _session(live: LiveRun) -> Table:
    device = live.device or "compiled"
    return Table("session", (
        Column("period", np.array([live.timetable.period]), "s", "of the ticks"),
        Column("device", (device,), "1", "the device's class; compiled: simulated in the loop"),
    ))  # fmt: skip


def _device_in(session: Table) -> str:
    device = str(session["device"][0])
    return "" if device == "compiled" else device

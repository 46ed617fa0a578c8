"""Runs of any length in constant memory: chunks go to a log during the loop, and from the log to the run file.

A run that ends before its first block is due needs no log. A longer run keeps a log beside its file. After a kill, the
run can be continued from this log, bit for bit; at most about `PAUSE` seconds of work are lost.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from iapb.errors import RunFileError
from iapb.recording import Recorder
from iapb.run import Run
from iapb.simulation import Simulation, record
from reports.resimulate import coupling_of, law_of, scene_of
from reports.store.care import stores_below
from reports.store.folder import Place
from reports.store.io import is_locked
from reports.store.keys import code_label, plain
from reports.store.logs import (
    CHUNK,
    LOG_SUFFIX,
    STATE,
    LogLocked,
    RunLog,
    is_log,
    put_back,
    read_log,
    record_of,
)
from reports.store.runs import RunEntry, store_parts, store_run

PAUSE = 5.0  # [s] between two states in a log
HELD = 16 << 20  # bytes of the chunks held before the log is written, and of a part copied to the run file
_STATE_SHARE = 0.05  # largest share of the time for writing states


@dataclass(frozen=True)
class Streamed:
    """The outcome of a run: its entry if complete, why it stopped, the step it resumed at, and if it can resume."""

    entry: RunEntry | None
    stopped: str
    resumed_at: int
    resumable: bool


def log_of(path: Path) -> Path:
    """Return the path of the log of an unfinished run, beside its run file."""
    return path.with_name(path.name + LOG_SUFFIX)


def stream(place: Place, simulation: Simulation, world: str, total: int, *, resume: bool = False,
           progress: Any = None) -> Streamed:
    """Simulate `total` steps and store the run in its place.

    Parameters
    ----------
    simulation : in its initial state.
    resume : continue from the log in that place, if there is one.

    Raises
    ------
    RunFileError
        A file cannot be written, or the log belongs to another run.
    """
    return _Stream(place, simulation, world, total).run(resume, progress)


class _Stream:
    def __init__(self, place: Place, simulation: Simulation, world: str, total: int) -> None:
        self.place, self.simulation, self.world, self.total = place, simulation, world, total
        self.recorder, self.joiner = Recorder(simulation), Recorder(simulation)
        self.log: RunLog | None = None
        self._next = time.monotonic() + PAUSE

    def run(self, resume: bool, progress: Any) -> Streamed:
        try:
            resumed_at = self._go_on() if resume else 0
            stopped = record(self.recorder, self.total, progress, self._between)
            target, code = (self.place.partial, "") if stopped else (self.place.path, code_label())
            if self.log is None:
                entry = store_run(target, self.recorder.run(self.world, stopped), key=self.place.key, code=code,
                                  replace=bool(stopped))  # fmt: skip
            else:
                self._spill()
                parts = parts_of(self.log.path, self.joiner, self.world, self.log.steps)
                entry = store_parts(target, parts, stopped=stopped, key=self.place.key, code=code,
                                    replace=bool(stopped))  # fmt: skip
            if stopped:
                return Streamed(None, stopped, resumed_at, self.log is not None and self.simulation.keeps_no_state)
            self.place.partial.unlink(missing_ok=True)
            self._forget()
            return Streamed(entry, "", resumed_at, False)
        finally:
            if self.log is not None:
                self.log.close()

    def _forget(self) -> None:
        """Remove the log, also one that an earlier attempt left, unless another process is writing it."""
        path, log, self.log = log_of(self.place.path), self.log, None
        with suppress(LogLocked):
            if log is not None or is_log(path):
                (log or RunLog(path, {}, anew=False)).close(remove=True)

    def _between(self) -> None:
        """Between two chunks, append the held chunks to the log if they exceed HELD bytes, or if a state is due."""
        due = time.monotonic() >= self._next
        if not (due or self.recorder.held_bytes > HELD):
            return
        self._spill()
        if due and self.simulation.keeps_no_state:
            began = time.monotonic()
            self.log.write_state(self.simulation.arrays())  # type: ignore[union-attr]
            now = time.monotonic()
            self._next = now + max(PAUSE, (now - began) / _STATE_SHARE)
            self.log.sync()  # type: ignore[union-attr]

    def _spill(self) -> None:
        """Append the held chunks that are not yet in the log; it is safe to repeat this if Ctrl-C interrupts it."""
        if self.log is None:
            head = log_head(self.simulation, self.world, self.total, key=self.place.key, code=code_label())
            try:
                self.log = RunLog(log_of(self.place.path), head)
            except LogLocked:
                said = f"{self.place.path}: another process is computing this run; wait for it"
                raise RunFileError(said) from None
        first = self.recorder.first
        for chunk, size, seconds in self.recorder.held():
            if first >= self.log.steps:
                self.log.write_chunk(chunk, size, seconds)
            first += size
        self.recorder.forget()

    def _go_on(self) -> int:
        """Restore the last state in the log; return its step, 0 if there is none."""
        path = log_of(self.place.path)
        if not path.is_file():
            return 0
        head, blocks = read_log(path)
        if head.get("key") != self.place.key:
            raise RunFileError(f"{path}: the log belongs to another run")
        last = None
        for block in blocks:
            last = block if block.line["kind"] == STATE else last
        if last is None or not self.simulation.keeps_no_state:
            return 0
        self.log = RunLog(path, head, anew=False)
        put_back(path, last, self.simulation.arrays())
        self.log.go_on(last)
        self.simulation.steps_done = self.log.steps
        self.recorder.go_on(self.log.steps)
        return self.log.steps


def log_head(simulation: Simulation, world: str, total: int, **more: Any) -> dict[str, Any]:
    """Return the head of a log: enough data to simulate the run again."""
    law, coupling = simulation.law, simulation.coupling
    return plain({
        "scene_resolved": simulation.scene.resolved(), "scene_source": simulation.scene.source_text, "world": world,
        "law": law.name, "law_settings": dict(law.settings), "coupling": coupling.name,
        "coupling_settings": dict(coupling.settings), "steps": total, **more,
    })  # fmt: skip


def parts_of(path: Path, joiner: Recorder, world: str, steps: int = 0, more: int = 0,
             rows: list[Any] | None = None) -> Iterator[Run]:
    """Yield the run in a log in parts.

    joiner : a recorder of the same simulation, made in its initial state; steps : number of steps that the log must
    have; rows : receives the `more` additional columns of the log.

    Raises
    ------
    RunFileError
        The log has fewer complete steps.
    """
    names, held = ("coordinate", "velocity", "device_coordinate", "device_velocity"), 0
    lengths = dict(zip(names, joiner.coordinates, strict=True))
    for block in read_log(path)[1]:
        if block.line["kind"] == CHUNK and block.line["steps"]:
            chunk, own = record_of(path, block, lengths, more)
            if rows is not None:
                rows.append(own)
            joiner.keep(chunk, int(block.line["steps"]), float(block.line["seconds"]))
            held += int(block.line["bytes"])
            if held > HELD:
                yield joiner.take(world)
                held = 0
    if joiner.steps < max(steps, 1):
        raise RunFileError(f"{path}: damaged: only {joiner.steps} of {max(steps, 1)} steps can be read")
    if held:
        yield joiner.take(world)


def logs_of_killed(folder: Path | str) -> list[Path]:
    """Return the logs in stores, at and below a folder, that no process is writing."""
    return [log for store in stores_below(folder) for log in sorted(store.glob(f"*.h5{LOG_SUFFIX}"))
            if is_log(log) and not log.is_symlink() and not is_locked(log)]


def recover(log: Path) -> Path:
    """Store the steps in a log as a partial run beside it, so that they can be read; the log stays for resuming.

    Raises
    ------
    RunFileError
        The log is damaged.
    ArgumentError
        The law or coupling is not one of the project's.
    """
    head, _ = read_log(log)
    simulation = simulation_of(head)
    place = Place(str(head.get("key", "")), log.with_name(log.name.removesuffix(LOG_SUFFIX)))
    parts = parts_of(log, Recorder(simulation), str(head["world"]))
    store_parts(place.partial, parts, stopped="killed", key=place.key, replace=True)
    return place.partial


def simulation_of(head: Mapping[str, Any]) -> Simulation:
    """Return the simulation of a log in its initial state."""
    run: Any = SimpleNamespace(**head)  # it has the names of a Run's
    return Simulation(scene_of(run), law_of(run), coupling_of(run))

"""Runs of any length in constant memory: steps go to parts during the loop, and from the parts to the run file.

A run that ends before its first part is due needs no parts. The parts of a longer run are in a folder beside its file
(`reports.store.parts`). After a kill, the run can be continued from them, bit for bit; at most about `PAUSE` seconds of
work are lost.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from iapb.errors import RunFileError
from iapb.recording import Recorder
from iapb.run import Run
from iapb.simulation import Simulation, record
from reports.store.folder import Place
from reports.store.keys import code_label, plain
from reports.store.parts import Parts, parts_of, read_head, read_parts, remove_parts
from reports.store.runs import store_run

PAUSE = 5.0  # [s] between two parts
HELD = 16 << 20  # bytes of the steps held before a part is written, and of a piece copied to the run file
_PARTS_SHARE = 0.05  # largest share of the time for writing parts that are due


class Streamed(NamedTuple):
    """The outcome of a run: why it stopped, "" if it did not; the step it resumed at; and whether it can resume."""

    stopped: str
    resumed_at: int
    resumable: bool


class Stream:
    """Simulates `total` steps and stores the run in its place.

    simulation : in its initial state.
    """

    def __init__(self, place: Place, simulation: Simulation, world: str, total: int) -> None:
        self.place, self.simulation, self.world, self.total = place, simulation, world, total
        self.recorder, self.folder = Recorder(simulation), parts_of(place.path)
        self.parts: Parts | None = None
        self._next = time.monotonic() + PAUSE

    def run(self, resume: bool, progress: Any = None) -> Streamed:
        """Run to the end, to a failure or to Ctrl-C; with `resume` continue from the parts in that place.

        Raises
        ------
        RunFileError
            A file cannot be written, or the parts belong to another run.
        """
        stored = False
        try:
            resumed_at = self._go_on() if resume else 0
            stopped = record(self.recorder, self.total, progress, self._between)
            made: Run | Iterator[Run]
            if self.parts is None:
                made = self.recorder.run(self.world, stopped)
            else:
                self._write(())
                self.recorder.go_on(0)
                made = joined(self.folder, self.recorder, self.world, self.parts.steps)
            target, code = (self.place.partial, "") if stopped else (self.place.path, code_label())
            store_run(target, made, key=self.place.key, code=code, stopped=stopped, replace=bool(stopped))
            stored = not stopped
        finally:
            if self.parts is not None:
                self.parts.close(remove=stored)
        if stored:
            self.place.partial.unlink(missing_ok=True)
            if self.parts is None and self.folder.is_dir():  # of an earlier attempt
                remove_parts(self.folder)
        return Streamed(stopped, resumed_at, bool(stopped and self.parts and self.simulation.keeps_no_state))

    def _between(self) -> None:
        """Between two chunks, write a part if one is due, or if the steps held exceed HELD bytes."""
        began = time.monotonic()
        if began >= self._next or self.recorder.held_bytes > HELD:
            self._write(self.simulation.arrays() if self.simulation.keeps_no_state else ())
            now = time.monotonic()
            self._next = now + max(PAUSE, (now - began) / _PARTS_SHARE)

    def _write(self, state: Any) -> None:
        """Write the steps held; it is safe to repeat this if Ctrl-C interrupts it."""
        if self.parts is None:
            head = parts_head(self.simulation, self.world, self.total, key=self.place.key, code=code_label())
            self.parts = Parts(self.folder, head)
        first, held = self.recorder.first, self.recorder.held()
        for chunk, size, seconds in held:
            if first >= self.parts.steps:
                self.parts.write(chunk, size, seconds, state=state if chunk is held[-1][0] else ())
            first += size
        self.recorder.forget()

    def _go_on(self) -> int:
        """Restore the last state in the parts; return its step, 0 if there is none."""
        if not self.folder.is_dir():
            return 0
        if read_head(self.folder).get("key") != self.place.key:
            raise RunFileError(f"{self.folder}: the parts belong to another run")
        last, number = None, 0
        for k, part in enumerate(read_parts(self.folder), 1):
            if part.state:
                last, number = part, k
        if last is None or not self.simulation.keeps_no_state:
            return 0
        steps = self.simulation.steps_done = last.first + last.steps
        self.parts = Parts(self.folder)
        self.parts.go_on(number + 1, steps)
        self.recorder.go_on(steps)
        for array, values in zip(self.simulation.arrays(), last.state, strict=True):
            array[...] = values
        return steps


def parts_head(simulation: Simulation, world: str, total: int, **more: Any) -> dict[str, Any]:
    """Return the head of parts: enough data to simulate the run again."""
    law, coupling = simulation.law, simulation.coupling
    return plain({
        "scene_resolved": simulation.scene.resolved(), "scene_source": simulation.scene.source_text, "world": world,
        "law": law.name, "law_settings": dict(law.settings), "coupling": coupling.name,
        "coupling_settings": dict(coupling.settings), "steps": total, **more,
    })  # fmt: skip


def joined(folder: Path, recorder: Recorder, world: str, steps: int = 0,
           rows: list[Any] | None = None) -> Iterator[Run]:
    """Yield the run in a folder of parts, in pieces of about HELD bytes.

    recorder : of the same simulation, as it was made in the initial state; steps : number of steps that the parts must
    have; rows : receives the rows of the caller.

    Raises
    ------
    RunFileError
        The parts have fewer steps.
    """
    for part in read_parts(folder):
        if recorder.held_bytes > HELD:
            yield recorder.take(world)
        if rows is not None:
            rows.append(part.more)
        recorder.keep(part.record, part.steps, part.seconds)
    if recorder.steps < max(steps, 1):
        raise RunFileError(f"{folder}: damaged: only {recorder.steps} of {max(steps, 1)} steps can be read")
    yield recorder.take(world)

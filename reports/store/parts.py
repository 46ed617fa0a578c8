"""A run in the making: a folder of numbered parts, each whole or absent, from which the run file is joined.

    <run file>.parts/00000000.part   the inputs of the run
    <run file>.parts/00000001.part   the first steps of the loop's record (`iapb.recording`), and everything that the
                                     next step depends on (`Simulation.arrays`), if the run can be resumed there
    <run file>.parts/lock            locked by the process that is at work on the run

A part is a line of JSON, the bytes of its arrays, and a seal. The first missing or damaged part ends the run.
"""

from __future__ import annotations

import fcntl
import json
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from math import prod
from pathlib import Path
from stat import S_ISREG
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.errors import RunFileError
from iapb.recording import LINES
from reports.store.io import SEAL, WRITING, sealed, written_aside

PARTS_SUFFIX = ".parts"
_LOCK = "lock"
_FORMAT = {"format": "iapb part", "format_version": 1}
PART_HEAD = b'{"format": "iapb part"'
_NAME = re.compile(r"\d{8}\.part")
_MORE, _STATE = "more", "state/"  # names of the arrays of a part that are no columns of a record


class Part(NamedTuple):
    """One whole part of a run."""

    first: int  # number of steps before it
    steps: int
    seconds: float
    record: Any  # as `Recorder.keep` accepts it
    more: NDArray[np.float64]  # rows of the caller, one per step
    state: list[NDArray[Any]]  # empty if the run cannot be resumed after this part


class PartsLocked(RunFileError):
    """Another process is writing the parts."""


class Parts:
    """The folder of parts of a run, open and locked for writing.

    Parameters
    ----------
    folder : created if it does not exist.
    head : inputs of the run, for a new one; None: go on with the parts that are there.
    synced : whether each part is on the disk, not only handed to the system, when it is written.

    Raises
    ------
    PartsLocked
        Another process is writing it.
    """

    def __init__(self, folder: Path, head: Mapping[str, Any] | None = None, *, synced: bool = True) -> None:
        self.folder, self.steps, self._synced = folder, 0, synced
        folder.mkdir(parents=True, exist_ok=True)
        self._lock = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            os.close(self._lock)
            raise PartsLocked(f"{folder}: another process is computing this run; wait for it") from error
        self._run = ""
        if head is not None:
            self.go_on(0, 0)
            self._write(head, {}, 0)
        self._run = _run_of(folder)

    def go_on(self, parts: int, steps: int) -> None:
        """Keep the first `parts` parts, which have so many steps, and remove the others; of a run at work damaged ones,
        too."""
        for path in sorted(self.folder.iterdir(), reverse=True):
            if path.name.endswith(WRITING) or (_NAME.fullmatch(path.name) and int(path.stem) >= parts):
                path.unlink()
        self._count, self.steps = parts, steps

    def write(self, record: Any, steps: int, seconds: float, more: NDArray[np.float64] | None = None,
              state: Sequence[NDArray[Any]] = ()) -> None:  # fmt: skip
        """Write the first `steps` steps of a record; `more` are rows of the caller, `state` what the next step needs.

        Raises
        ------
        RunFileError
            The part cannot be written; the ones before it are whole.
        """
        used = (steps, *(int(rows) for rows in record.used[1:]))
        arrays = {f"{table}/{each.name}": getattr(getattr(record, table), each.name)[:rows]
                  for (table, listed), rows in zip(LINES.items(), used, strict=True) for each in listed}
        arrays |= {_MORE: np.zeros((steps, 0)) if more is None else more[:steps]}
        arrays |= {f"{_STATE}{number}": array for number, array in enumerate(state)}
        self._write({"used": used, "seconds": seconds, "first": self.steps}, arrays, steps)

    def _write(self, facts: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]], steps: int) -> None:
        layout = [(name, array.dtype.str, array.shape) for name, array in arrays.items()]
        line = json.dumps({**_FORMAT, "run": self._run, "number": self._count, "arrays": layout, **facts}).encode()
        path = _path(self.folder, self._count)
        try:  # a file in its place is of somebody else, or the same part, written before Ctrl-C
            with written_aside(path, replace=False, synced=self._synced) as aside:
                aside.write_bytes(sealed(b"".join([line, b"\n", *(array.tobytes() for array in arrays.values())])))
        except RunFileError as error:
            raise RunFileError(f"{error}; --resume goes on from the last part before it") from error
        self._count, self.steps = self._count + 1, self.steps + steps  # together: Ctrl-C does not come between them

    def close(self, *, remove: bool = False) -> None:
        """Release the lock; with `remove`, remove the parts first, and the folder if nothing else is in it."""
        if remove:
            self.go_on(0, 0)
            with suppress(OSError):
                found = os.fstat(self._lock)
                if S_ISREG(found.st_mode) and found.st_nlink == 1 and not found.st_size:  # else of somebody else
                    (self.folder / _LOCK).unlink()
                self.folder.rmdir()
        os.close(self._lock)


def parts_of(path: Path) -> Path:
    """Return the folder of the parts of a run file."""
    return path.with_name(path.name + PARTS_SUFFIX)


def remove_parts(folder: Path) -> None:
    """Remove the parts of a run, unless a process is writing them."""
    with suppress(PartsLocked):
        Parts(folder).close(remove=True)


def read_head(folder: Path) -> Mapping[str, Any]:
    """Return the inputs of the run.

    Raises
    ------
    RunFileError
        There are no parts, or the first one is damaged or of another version.
    """
    head = _read(folder, 0)
    if head is None:
        raise RunFileError(f"{folder}: its first part is missing, damaged or of another version; run without --resume")
    return head[0]


def read_parts(folder: Path) -> Iterator[Part]:
    """Yield the parts after the head, one by one, up to the first that is missing, damaged or of another run."""
    steps, number, run = 0, 1, _run_of(folder)
    while (found := _read(folder, number)) and (found[0]["run"], found[0]["first"]) == (run, steps):
        facts, arrays = found
        tables: dict[str, Any] = {table: SimpleNamespace(**{each.name: arrays[f"{table}/{each.name}"]
                                                            for each in LINES[table]}) for table in LINES}  # fmt: skip
        yield Part(steps, facts["used"][0], facts["seconds"], SimpleNamespace(used=facts["used"], **tables),
                   arrays[_MORE], [array for name, array in arrays.items() if name.startswith(_STATE)])
        steps, number = steps + facts["used"][0], number + 1


def _path(folder: Path, number: int) -> Path:
    return folder / f"{number:08d}.part"


def _run_of(folder: Path) -> str:
    """Return what the parts of this run carry and those of no other: the checksum of its head."""
    head = _path(folder, 0)
    return head.read_bytes()[-SEAL:].decode(errors="replace").strip() if head.is_file() else ""


def _read(folder: Path, number: int) -> tuple[dict[str, Any], dict[str, NDArray[Any]]] | None:
    """Return the facts and the arrays of one part, or None if it is missing, damaged or of another version."""
    path = _path(folder, number)
    whole = path.read_bytes() if path.is_file() else b""
    content = whole[:-SEAL]
    if not content.startswith(PART_HEAD) or sealed(content) != whole:
        return None
    line = content.partition(b"\n")[0]
    try:  # sealed, but perhaps made by other software
        facts, arrays, start = json.loads(line), {}, len(line) + 1
        if (facts["format_version"], facts["number"]) != (_FORMAT["format_version"], number):
            return None
        for name, kind, shape in facts["arrays"]:
            arrays[name] = np.frombuffer(content, kind, prod(shape), start).reshape(shape)
            start += arrays[name].nbytes
        for (table, listed), rows in zip(LINES.items(), facts["used"] if number else (), strict=bool(number)):
            if any(len(arrays[f"{table}/{each.name}"]) != rows for each in listed):
                return None
        _ = facts["run"], arrays[_MORE] if number else None, facts["first"] + facts["seconds"] if number else 0
    except (ValueError, TypeError, LookupError, RecursionError, OverflowError):
        return None
    return facts, arrays

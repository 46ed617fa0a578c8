"""The log of an unfinished run on disk: data are only appended, so that a kill loses at most the last block.

    a line of JSON: the format of the file, and the inputs of the run
    blocks, each a line of JSON (kind, counts, number of bytes that follow) and its numbers:
        chunk   steps of the loop's record: the columns of `iapb.recording`, one after another
        state   everything that the next step depends on (`Simulation.arrays`), after the chunks before it

Each line has a sha256 of itself, its numbers and the previous sha256, so changed, lost or exchanged data are detected.
An incomplete or damaged block ends the log. The writing process holds a lock, which the kernel releases when the
process ends. The log is used to resume and to recover runs (`reports.streaming`); results are only read from run files.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate
from math import prod
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.errors import RunFileError
from iapb.recording import LINES
from reports.store.io import sync

LOG_SUFFIX = ".log"
CHUNK, STATE = "chunk", "state"
_FORMAT, _VERSION = "iapb log", 2
_SEAL = "sha256"
_OWN = ("format", "format_version", _SEAL)  # of a head; the rest is the caller's
_BEGINNING = f'{{"format": "{_FORMAT}"'.encode()
_LONGEST_LINE = 1 << 24  # bytes of a line of JSON: a scene of ten thousand bodies is a tenth of that


@dataclass(frozen=True)
class Block:
    """One complete block of a log: its line, its numbers as bytes, and its start and end in the file."""

    line: Mapping[str, Any]
    numbers: bytes
    start: int
    end: int


class LogLocked(RunFileError):
    """Another process is writing the log."""


class RunLog:
    """A log that is open and locked for writing.

    Parameters
    ----------
    path : created if it does not exist; an incomplete block of a killed writer is overwritten.
    head : inputs of the run, for a new log.
    anew : whether the contents of an existing log are discarded.

    Raises
    ------
    LogLocked
        Another process is writing it.
    """

    def __init__(self, path: Path, head: Mapping[str, Any], *, anew: bool = True) -> None:
        self.path = path
        self._file = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            os.close(self._file)
            raise LogLocked(f"{path}: another process is at work on this run") from error
        self.steps = 0
        self.end = 0
        self._seal = ""
        if anew:
            if not _BEGINNING.startswith(os.pread(self._file, len(_BEGINNING), 0)):
                os.close(self._file)
                raise RunFileError(f"{path}: in the place of a log, but not a log of iapb: move it away")
            os.ftruncate(self._file, 0)
            self._write({"format": _FORMAT, "format_version": _VERSION, **head}, b"")

    def go_on(self, block: Block) -> None:
        """Continue after a block; all data after it are removed."""
        os.ftruncate(self._file, block.end)
        self.steps, self.end, self._seal = int(block.line["steps"]), block.end, block.line[_SEAL]

    def write_chunk(self, record: Any, steps: int, seconds: float, more: Sequence[NDArray[Any]] = ()) -> None:
        """Append the first `steps` steps of a chunk; `more` are additional columns of the caller."""
        _, contacts, impacts = (int(count) for count in record.used)
        columns = [getattr(getattr(record, name), each.name)[:count]
                   for (name, listed), count in zip(LINES.items(), (steps, contacts, impacts), strict=True)
                   for each in listed]
        line = {"kind": CHUNK, "steps": steps, "contacts": contacts, "impacts": impacts, "seconds": seconds}
        self._write_block(line, [*columns, *(column[:steps] for column in more)])
        self.steps += steps

    def write_state(self, arrays: Sequence[NDArray[Any]]) -> None:
        """Append everything that the next step depends on."""
        self._write_block({"kind": STATE, "steps": self.steps}, arrays)

    def sync(self) -> None:
        """Wait until all written data are on the disk, so that they survive a power failure."""
        try:
            os.fdatasync(self._file)
            sync(self.path.parent)
        except OSError as error:
            raise self._failed(error) from error

    def _write_block(self, line: Mapping[str, Any], arrays: Sequence[NDArray[Any]]) -> None:
        numbers = b"".join(array.tobytes() for array in arrays)
        self._write({**line, "bytes": len(numbers)}, numbers)

    def _write(self, line: Mapping[str, Any], numbers: bytes) -> None:
        """Write a line and its numbers at the end; after a failed write, the next write overwrites them."""
        seal, place = _seal_of(self._seal, line, numbers), self.end
        view = memoryview(_line({**line, _SEAL: seal}) + numbers)
        try:
            while view:
                done = os.pwrite(self._file, view, place)
                place, view = place + done, view[done:]
        except OSError as error:
            raise self._failed(error) from error
        self.end, self._seal = place, seal

    def _failed(self, error: OSError) -> RunFileError:
        return RunFileError(f"{self.path}: cannot be written: {error.strerror or error}; --resume goes on from the "
                            "last state in it")  # fmt: skip

    def close(self, *, remove: bool = False) -> None:
        """Release the lock; with `remove`, also remove the file."""
        if remove:
            self.path.unlink(missing_ok=True)
        os.close(self._file)


def _line(record: Mapping[str, Any]) -> bytes:
    return json.dumps(record, ensure_ascii=False).encode(errors="surrogatepass") + b"\n"


def _seal_of(before: str, line: Mapping[str, Any], numbers: bytes) -> str:
    """Return the seal of a block: sha256 of the previous seal `before`, the line and its numbers."""
    unsealed = {name: value for name, value in line.items() if name != _SEAL}
    return hashlib.sha256(before.encode() + _line(unsealed) + numbers).hexdigest()


def is_log(path: Path) -> bool:
    """Return whether a file is a log of iapb."""
    try:
        with path.open("rb") as file:
            return file.read(len(_BEGINNING)) == _BEGINNING
    except OSError:
        return False


def read_log(path: Path) -> tuple[dict[str, Any], Iterator[Block]]:
    """Return the head of a log, and its complete blocks one by one, up to the first incomplete or damaged block.

    Raises
    ------
    RunFileError
        The file is not a log that this version supports, or its head is damaged.
    """
    if not is_log(path):
        raise RunFileError(f"{path}: no log of a run")
    with path.open("rb") as file:
        head = _parsed(file.readline(_LONGEST_LINE))
        first = file.tell()
    if head.get("format_version", _VERSION) != _VERSION:
        raise RunFileError(f"{path}: format version is not {_VERSION}; run without --resume")
    if head.get(_SEAL) != _seal_of("", head, b""):
        raise RunFileError(f"{path}: its first line is damaged, so the log cannot be read; run without --resume")
    return {name: value for name, value in head.items() if name not in _OWN}, _blocks_from(path, first, head[_SEAL])


def _blocks_from(path: Path, start: int, before: str) -> Iterator[Block]:
    """Yield the complete blocks of a log; `before` is the seal of its head."""
    size = path.stat().st_size
    with path.open("rb") as file:
        file.seek(start)
        while _is_block(line := _parsed(file.readline(_LONGEST_LINE))) and line["bytes"] <= size - file.tell():
            numbers = file.read(line["bytes"])
            if line.get(_SEAL) != _seal_of(before, line, numbers):
                return
            yield Block(line, numbers, start, file.tell())
            start, before = file.tell(), line[_SEAL]


def is_damaged(path: Path) -> bool:
    """Return whether a log has more than complete blocks and one block cut off by a kill or a full disk."""
    end = max((block.end for block in read_log(path)[1]), default=0)
    with path.open("rb") as file:
        file.seek(end)
        text, line = (found := file.readline(_LONGEST_LINE)), _parsed(found)
        return text.endswith(b"\n") and not (_is_block(line) and line["bytes"] > path.stat().st_size - file.tell())


def _parsed(text: bytes) -> dict[str, Any]:
    """Return the mapping in a line; an empty one if the line is incomplete or something else."""
    try:
        found = json.loads(text) if text.endswith(b"\n") else None
    except (ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def _is_block(line: Mapping[str, Any]) -> bool:
    counts = ["bytes", "steps", *(["contacts", "impacts"] if line.get("kind") == CHUNK else [])]
    return line.get("kind") in (CHUNK, STATE) and all(
        isinstance(line.get(name), int) and line[name] >= 0 for name in counts)


def record_of(path: Path, block: Block, lengths: Mapping[str, int], more: int = 0) -> tuple[Any, NDArray[np.float64]]:
    """Return the chunk in a block as a record that `Recorder.keep` accepts, and the `more` columns of the caller.

    `lengths` are the lengths of the dimensions that depend on the scene.
    """
    steps, contacts, impacts = (int(block.line[name]) for name in ("steps", "contacts", "impacts"))
    rows = {**lengths, "time": steps, "step": steps, "contact": contacts, "impact": impacts, "axis": 3}
    listed = [(name, each.name, [rows[dimension] for dimension in each.dimensions], each.dtype)
              for name in LINES for each in LINES[name]]  # fmt: skip
    columns = _split(path, block, "chunk", [*((shape, dtype) for *_, shape, dtype in listed), ([steps, more], float)])
    tables: dict[str, Any] = {name: SimpleNamespace() for name in LINES}
    for (name, column, *_), values in zip(listed, columns, strict=False):
        setattr(tables[name], column, values)
    return SimpleNamespace(used=(steps, contacts, impacts), **tables), columns[-1]


def put_back(path: Path, block: Block, arrays: Sequence[NDArray[Any]]) -> None:
    """Copy a state from a block into the arrays of the simulation.

    Raises
    ------
    RunFileError
        The state belongs to another scene.
    """
    stored = _split(path, block, "state", [(array.shape, array.dtype) for array in arrays])
    for array, values in zip(arrays, stored, strict=True):
        array[...] = values


def _split(path: Path, block: Block, what: str, layout: Sequence[tuple[Sequence[int], Any]]) -> list[NDArray[Any]]:
    """Return the numbers of a block as arrays of these shapes and types, which must use all its bytes."""
    sizes = [prod(shape) * np.dtype(dtype).itemsize for shape, dtype in layout]
    if sum(sizes) != len(block.numbers):
        raise RunFileError(f"{path}: the {what} at byte {block.start} belongs to another scene")
    places = accumulate(sizes, initial=0)
    return [np.frombuffer(block.numbers, dtype, prod(shape), place if size else 0).reshape(shape)
            for (shape, dtype), size, place in zip(layout, sizes, places, strict=False)]  # fmt: skip

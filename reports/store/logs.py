"""A run in the making, on disk: a log that only grows, so that a kill loses no more than its last block.

    a line of JSON: what this is, and what run it is of
    blocks, each a line of JSON (kind, counts, bytes and sha256 of what follows) and its numbers:
        chunk   lines of the loop's record: the columns of `iapb.recording`, one after another
        state   everything that the next step depends on (`Simulation.arrays`), after the chunks before it

Who writes holds a lock that the kernel releases with the process. A block that is cut off or damaged ends the log.
The log is for going on and for recovery (`reports.streaming`); results are read from run files alone.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import prod
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.errors import RunFileError
from iapb.recording import CONTACTS, IMPACTS, STATES, STEPS
from iapb.run import Quantity

LOG_SUFFIX = ".log"
CHUNK, STATE = "chunk", "state"
_FORMAT, _VERSION = "iapb log", 1
_BEGINNING = f'{{"format": "{_FORMAT}"'.encode()
_LONGEST_LINE = 1 << 24  # bytes of a line of JSON: a scene of ten thousand bodies is a tenth of that


@dataclass(frozen=True)
class Block:
    """One block of a log: its line, and where it and its numbers are in the file."""

    line: Mapping[str, Any]
    start: int
    numbers: int

    @property
    def end(self) -> int:
        """Where the next block starts."""
        return self.numbers + int(self.line["bytes"])


class LogLocked(RunFileError):
    """Another process writes the log."""


class RunLog:
    """A log that is open, and locked, for writing.

    Parameters
    ----------
    path : made if it does not exist; what a killed writer cut off is overwritten.
    head : what the run is of, for a new log.
    anew : whether what the log holds is given up.

    Raises
    ------
    LogLocked
        Another process writes it.
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
        if anew:
            os.ftruncate(self._file, 0)
            self.end = self._put(0, _line({"format": _FORMAT, "format_version": _VERSION, **head}))

    def go_on(self, block: Block) -> None:
        """Continue behind a block; what follows it is dropped."""
        os.ftruncate(self._file, block.end)
        self.steps, self.end = int(block.line["steps"]), block.end

    def write_chunk(self, record: Any, steps: int, seconds: float, more: Sequence[NDArray[Any]] = ()) -> None:
        """Append the lines of a chunk of which `steps` are written; `more`: further columns, of the caller's."""
        contacts, impacts = (int(count) for count in record.used)
        columns = [getattr(record.steps, each.name)[:steps] for each in (*STATES, *STEPS)]
        columns.append(record.contact_count[:steps])
        columns += [getattr(record.contacts, each.name)[:contacts] for each in CONTACTS]
        columns += [getattr(record.impacts, each.name)[:impacts] for each in IMPACTS]
        line = {"kind": CHUNK, "steps": steps, "contacts": contacts, "impacts": impacts, "seconds": seconds}
        end = self._write(line, [*columns, *(column[:steps] for column in more)])
        self.steps, self.end = self.steps + steps, end

    def write_state(self, arrays: Sequence[NDArray[Any]]) -> None:
        """Append everything that the next step depends on."""
        self.end = self._write({"kind": STATE, "steps": self.steps}, arrays)

    def _write(self, line: Mapping[str, Any], arrays: Sequence[NDArray[Any]]) -> int:
        """Write a block at the end and return where it ends: until that is noted, the next one overwrites it."""
        numbers = b"".join(array.tobytes() for array in arrays)
        whole = {**line, "bytes": len(numbers), "sha256": hashlib.sha256(numbers).hexdigest()}
        return self._put(self.end, _line(whole) + numbers)

    def _put(self, place: int, content: bytes) -> int:
        view = memoryview(content)
        try:
            while view:
                done = os.pwrite(self._file, view, place)
                place, view = place + done, view[done:]
        except OSError as error:
            raise RunFileError(f"{self.path}: cannot be written: {error.strerror or error}; --resume goes on from the "
                               "last state in it") from error
        return place

    def close(self, *, remove: bool = False) -> None:
        """Give up the lock; with `remove` the file too."""
        if remove:
            self.path.unlink(missing_ok=True)
        os.close(self._file)


def _line(record: Mapping[str, Any]) -> bytes:
    return json.dumps(record, ensure_ascii=False).encode() + b"\n"


def is_log(path: Path) -> bool:
    """Whether a file is a log of ours."""
    try:
        with path.open("rb") as file:
            return file.read(len(_BEGINNING)) == _BEGINNING
    except OSError:
        return False


def read_log(path: Path) -> tuple[dict[str, Any], list[Block]]:
    """Return the head of a log, and its whole blocks in order; numbers are read, and checked, by `numbers_of`.

    Raises
    ------
    RunFileError
        The file is no log that this version knows.
    """
    if not is_log(path):
        raise RunFileError(f"{path}: no log of a run")
    blocks: list[Block] = []
    size = path.stat().st_size
    with path.open("rb") as file:
        head = _parsed(file.readline(_LONGEST_LINE))
        if head is None or head.get("format_version") != _VERSION:
            raise RunFileError(f"{path}: a log of another version: this one reads {_VERSION}")
        while True:
            start = file.tell()
            line = _parsed(file.readline(_LONGEST_LINE))
            if line is None or not _is_block(line):
                return head, blocks
            block = Block(line, start, file.tell())
            if block.end > size:
                return head, blocks
            blocks.append(block)
            file.seek(block.end)


def _parsed(text: bytes) -> dict[str, Any] | None:
    try:
        found = json.loads(text) if text.endswith(b"\n") else None
    except ValueError:
        return None
    return found if isinstance(found, dict) else None


def _is_block(line: Mapping[str, Any]) -> bool:
    counts = ["bytes", "steps", *(["contacts", "impacts"] if line.get("kind") == CHUNK else [])]
    return line.get("kind") in (CHUNK, STATE) and all(
        isinstance(line.get(name), int) and line[name] >= 0 for name in counts)


def numbers_of(path: Path, block: Block) -> bytes:
    """Return the bytes of a block.

    Raises
    ------
    RunFileError
        They are not those that were written.
    """
    with path.open("rb") as file:
        file.seek(block.numbers)
        numbers = file.read(int(block.line["bytes"]))
    if hashlib.sha256(numbers).hexdigest() != block.line.get("sha256"):
        raise RunFileError(f"{path}: damaged at byte {block.start}")
    return numbers


def record_of(path: Path, block: Block, lengths: Mapping[str, int], more: int = 0) -> tuple[Any, NDArray[np.float64]]:
    """Return the chunk in a block as a record that `Recorder.keep` takes, and the `more` columns of the caller's.

    `lengths` are those of the dimensions along which quantities go in this scene.
    """
    steps, contacts, impacts = (int(block.line[name]) for name in ("steps", "contacts", "impacts"))
    rows = {**lengths, "time": steps, "step": steps, "contact": contacts, "impact": impacts, "axis": 3}
    numbers, place = numbers_of(path, block), 0

    def column(shape: Sequence[int], dtype: Any) -> NDArray[Any]:
        nonlocal place
        found = np.frombuffer(numbers, dtype, prod(shape), place).reshape(shape)
        place += found.nbytes
        return found

    def columns(listed: Sequence[Quantity]) -> Any:
        return SimpleNamespace(
            **{each.name: column([rows[name] for name in each.dimensions], each.dtype) for each in listed})

    try:
        lines = columns((*STATES, *STEPS))
        record = SimpleNamespace(steps=lines, contact_count=column((steps,), np.int64), contacts=columns(CONTACTS),
                                 impacts=columns(IMPACTS), used=(contacts, impacts))  # fmt: skip
        own = column((steps, more), np.float64)
    except ValueError as error:
        raise RunFileError(f"{path}: a chunk of another scene at byte {block.start}") from error
    if place != len(numbers):
        raise RunFileError(f"{path}: a chunk of another scene at byte {block.start}")
    return record, own


def put_back(path: Path, block: Block, arrays: Sequence[NDArray[Any]]) -> None:
    """Copy a state into the arrays that it was written from.

    Raises
    ------
    RunFileError
        It is damaged, or of another scene.
    """
    numbers, place = numbers_of(path, block), 0
    if len(numbers) != sum(array.nbytes for array in arrays):
        raise RunFileError(f"{path}: a state of another scene at byte {block.start}")
    for array in arrays:
        array[...] = np.frombuffer(numbers, array.dtype, array.size, place).reshape(array.shape)
        place += array.nbytes

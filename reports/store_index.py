"""The index of a folder of runs: one JSON line per file, made again from the files where it is not true."""

from __future__ import annotations

import json
import os
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from iapb.errors import RunFileError
from reports.store_files import written_aside
from reports.store_read import read_head

INDEX_NAME = "index.jsonl"


@dataclass(frozen=True)
class RunEntry:
    """One line of the index."""

    file: str  # name within the folder
    title: str  # scene and world
    run_key: str
    content_hash: str
    status: str


def entry_of(path: Path) -> RunEntry:
    """Return the entry of a run file, from its attributes."""
    head = read_head(path)
    return RunEntry(
        path.name, str(head["title"]), str(head["run_key"]), str(head["content_hash"]), str(head["status"])
    )


def add_to_index(folder: Path, path: Path) -> None:
    """Append the entry of a new file; one short write, so that several processes may do it at once."""
    line = json.dumps(asdict(entry_of(path)), ensure_ascii=False) + "\n"
    handle = os.open(folder / INDEX_NAME, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    try:
        os.write(handle, line.encode())
    finally:
        os.close(handle)


def read_index(folder: Path) -> tuple[RunEntry, ...]:
    """Return the entries of all run files in `folder`, by file name; the files decide, not the index."""
    listed = _lines(folder / INDEX_NAME)
    files = sorted(folder.glob("*.h5"))
    entries = []
    for path in files:
        if path.name in listed:
            entries.append(listed[path.name])
        else:
            with suppress(RunFileError):  # a table, or damaged: not a run
                entries.append(entry_of(path))
    if {entry.file for entry in entries} != set(listed):
        _write_index(folder, entries)
    return tuple(entries)


def _lines(index: Path) -> dict[str, RunEntry]:
    entries: dict[str, RunEntry] = {}
    if index.is_file():
        for line in index.read_text(encoding="utf-8").splitlines():
            with suppress(ValueError, TypeError):  # a line cut off by a crash
                entry = RunEntry(**json.loads(line))
                entries[entry.file] = entry
    return entries


def _write_index(folder: Path, entries: list[RunEntry]) -> None:
    text = "".join(json.dumps(asdict(entry), ensure_ascii=False) + "\n" for entry in entries)
    with written_aside(folder / INDEX_NAME, replace=True) as aside:
        aside.write_text(text, encoding="utf-8")

"""Care of a folder of results: which files are whole, which can be trusted, which nothing needs any more.

Nothing is lost in silence: a damaged file is set aside under another name, so that it is computed again; what `gc`
removes can be computed again from its inputs, and only files that no present code would ask for are.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from iapb.errors import RunFileError
from reports.store.folder import INDEX_NAME, PARTIAL_SUFFIX, read_index
from reports.store.io import WRITING, opened
from reports.store.keys import SOURCES, evidence_version, run_key
from reports.store.runs import read_entry, read_provenance, read_run
from reports.store.schema import FORMAT

Progress = Callable[[int, int], None]

DAMAGED_SUFFIX = ".damaged"
_AS_JSON = ("scene", "law settings", "coupling settings")
WHOLE, DAMAGED, PARTIAL, FOREIGN, STALE, LEFTOVER = "whole", "damaged", "partial", "foreign", "stale", "leftover"


@dataclass(frozen=True)
class FileState:
    """One file: its state and why it is thought to be in it."""

    path: Path
    state: str
    why: str = ""

    @property
    def size(self) -> int:
        """Bytes."""
        return self.path.stat().st_size if self.path.is_file() else 0


def check_store(folder: Path | str, progress: Progress | None = None) -> tuple[FileState, ...]:
    """Read every result file below a folder (or this file) whole, seals and content hashes included; change nothing.

    `progress` is called as progress(files read, files in all).
    """
    paths, states = list(_files(Path(folder))), list[FileState]()
    for path in paths:
        if progress is not None:
            progress(len(states), len(paths))
        states.append(_state(path))
    return tuple(states)


def _files(folder: Path) -> Iterator[Path]:
    if folder.is_file():  # one that is named counts, whatever its name
        yield folder
    for path in sorted(folder.rglob("*")):
        if path.is_file() and (path.suffix == ".h5" or path.name.endswith((PARTIAL_SUFFIX, WRITING, DAMAGED_SUFFIX))):
            yield path


def _state(path: Path) -> FileState:
    if path.name.endswith(WRITING):
        return FileState(path, LEFTOVER, "a writer was stopped before it was done")
    if path.name.endswith(DAMAGED_SUFFIX):
        return FileState(path, LEFTOVER, "set aside as damaged")
    try:
        with opened(path, expected_format=None) as file:
            kind = str(file.attrs.get("format", ""))
        if kind == FORMAT:
            run = read_run(path)
            if path.name.endswith(PARTIAL_SUFFIX) or not run.complete:
                return FileState(path, PARTIAL, f"{run.steps} steps are readable; {run.stopped}")
            return FileState(path, WHOLE)
        if not kind.startswith("iapb"):
            return FileState(path, FOREIGN, "an HDF5 file of somebody else's")
        return FileState(path, WHOLE)
    except RunFileError as error:
        return FileState(path, DAMAGED, str(error).removeprefix(f"{path}: "))


def is_run(path: Path) -> bool:
    """Whether a file is a run or damaged; a table or somebody else's file is not."""
    try:
        with opened(path, expected_format=None) as file:
            return file.attrs.get("format") == FORMAT
    except RunFileError:
        return True


def repair_store(folder: Path | str, progress: Progress | None = None) -> tuple[FileState, ...]:
    """Set damaged files aside and write the index anew; return the state of every file before that.

    A file that was set aside is computed again when it is next asked for.
    """
    states = check_store(folder, progress)
    for state in states:
        if state.state == DAMAGED:
            os.replace(state.path, state.path.with_name(state.path.name + DAMAGED_SUFFIX))
    for index in Path(folder).rglob(INDEX_NAME):
        index.unlink()  # lines about files that changed would be believed
        read_index(index.parent)
    return states


def garbage(folder: Path | str) -> tuple[FileState, ...]:
    """Return the files that nothing needs: leftovers, partial runs that were finished, results of older code."""
    return tuple(_garbage(Path(folder)))


def _garbage(folder: Path) -> Iterator[FileState]:
    for path in _files(folder):
        if path.name.endswith((WRITING, DAMAGED_SUFFIX)):
            yield _state(path)
        elif path.name.endswith(PARTIAL_SUFFIX):
            if path.with_name(path.name.removesuffix(PARTIAL_SUFFIX)).is_file():
                yield FileState(path, PARTIAL, "the finished run is there")
        elif path.parent.name == "tables":
            if not _is_present_table(path):
                yield FileState(path, STALE, "a table of older code")
        elif _is_stale_run(path):
            yield FileState(path, STALE, "a run of older code")


def _is_stale_run(path: Path) -> bool:
    """Whether the code would now store this run under another key; a file that is no run is left alone."""
    try:
        stored = read_entry(path).run_key
        inputs = _inputs(path)
    except RunFileError:
        return False
    words = inputs["world"].split()  # the label of a run may add the rendering to the name of its world
    worlds = [" ".join(words[:count]) for count in range(1, len(words) + 1)]
    return bool(stored) and all(stored != run_key({**inputs, "world": world}) for world in worlds)


def _inputs(path: Path) -> dict[str, Any]:
    """What determined a run, as its runner gave it to the key."""
    names = {"scene": "scene/resolved", "law": "law/name", "law settings": "law/settings", "coupling": "coupling/name",
             "coupling settings": "coupling/settings", "world": "law/world"}  # fmt: skip
    with opened(path) as file:
        texts = {name: str(file[place].asstr()[()]) for name, place in names.items()}
    return {name: json.loads(text) if name in _AS_JSON else text for name, text in texts.items()}


def _is_present_table(path: Path) -> bool:
    """Whether the present code made this table."""
    try:
        return read_provenance(path).get(SOURCES) == evidence_version()
    except RunFileError:
        return False


def collect_garbage(folder: Path | str) -> tuple[FileState, ...]:
    """Remove what `garbage` lists; return it, sizes as they were taken before."""
    found = garbage(folder)
    for state in found:
        state.path.unlink()
    for index in Path(folder).rglob(INDEX_NAME):
        read_index(index.parent)
    return found

"""Check result files: read each completely, and compare it with its seal, a run also with its
content hash."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from iapb.errors import RunFileError
from reference.hdf5 import attribute_of
from reports.store.folder import PARTIAL_SUFFIX
from reports.store.io import WRITING, looks_ours, opened
from reports.store.runs import opened_run
from reports.store.schema import FORMAT, FORMAT_VERSION, TABLE_FORMAT

Progress = Callable[[int, int], None]

WHOLE = "whole"
DAMAGED = "damaged"
PARTIAL = "partial"
FOREIGN = "foreign"
LEFTOVER = "leftover"
OTHER = "other version"


@dataclass(frozen=True)
class FileState:
    """The state of a file, and the reason for it."""

    path: Path
    state: str
    why: str = ""


def check_store(folder: Path | str, progress: Progress | None = None) -> tuple[FileState, ...]:
    """Read every result file below a folder (or a single file) completely, and check its seal; the
    content hash too, if it is a run.

    `progress` is called as progress(files read, total files).
    """
    paths = list(_files(Path(folder)))
    states: list[FileState] = []
    for path in paths:
        if progress is not None:
            progress(len(states), len(paths))
        try:
            states.append(_state(path))
        except OSError as error:  # removed meanwhile, or not for us to read
            states.append(FileState(path, FOREIGN, f"cannot be read: {error.strerror or error}"))
    return tuple(states)


def is_run(path: Path) -> bool:
    """Return whether a file is a run or a damaged file of iapb; tables and foreign files are
    not."""
    try:
        return path.is_file() and _head(path)[0] == FORMAT
    except RunFileError:
        return looks_ours(path)


def _files(folder: Path) -> Iterator[Path]:
    if folder.is_file():  # a file given by name is checked, whatever its suffix
        yield folder
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path.name.endswith((".h5", PARTIAL_SUFFIX, WRITING)):
            yield path


def _state(path: Path) -> FileState:
    if path.name.endswith(WRITING):
        return FileState(path, LEFTOVER, "half written; remove it if no process is writing it")
    if not looks_ours(path):
        return FileState(path, FOREIGN, "no file of iapb: no seal, and nothing that says so")
    try:
        kind, version = _head(path)
        if kind not in (FORMAT, TABLE_FORMAT):
            return FileState(path, FOREIGN, "an HDF5 file of somebody else's")
        if version != FORMAT_VERSION:
            return FileState(
                path,
                OTHER,
                f"its format has version {version}, and this iapb reads {FORMAT_VERSION}",
            )
        if kind == FORMAT:
            with opened_run(path) as (run, _):
                if not run.complete or path.name.endswith(PARTIAL_SUFFIX):
                    return FileState(
                        path, PARTIAL, f"{run.steps_done} steps are readable; {run.stopped}"
                    )
    except RunFileError as error:
        return FileState(path, DAMAGED, str(error).removeprefix(f"{path}: "))
    return FileState(path, WHOLE)


def _head(path: Path) -> tuple[str, int]:
    """Return format and format version of a file."""
    with opened(path, expected_format=None) as file:
        return str(attribute_of(file, "format", "")), int(attribute_of(file, "format_version", 0))

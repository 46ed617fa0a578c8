"""Check result files: read each completely, and compare it with its seal, a run also with its
content hash; seal files again whose data are whole."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from iapb.errors import IapbError, RunFileError
from reference.hdf5 import Budget, attribute_of
from reports.store.folder import PARTIAL_SUFFIX
from reports.store.io import (
    WRITING,
    ChangedFileError,
    OpenFileError,
    data_checksum,
    data_seal,
    head_of,
    looks_ours,
    opened,
    sealed,
    write_whole,
)
from reports.store.runs import opened_run
from reports.store.schema import FORMAT, FORMAT_VERSION, TABLE_FORMAT
from reports.workers import executor

Progress = Callable[[int, int], None]

WHOLE = "whole"
DAMAGED = "damaged"
PARTIAL = "partial"
FOREIGN = "foreign"
LEFTOVER = "leftover"
OTHER = "other version"
CHANGED = "changed"
OPEN = "open"

_RISK = (
    "it differs from its seal; reading such a file can crash the HDF5 library, so another process "
    "read it"
)


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
    except OpenFileError as error:
        return FileState(path, OPEN, _said(error, path))
    except ChangedFileError:
        return _changed(path)
    except RunFileError as error:
        return FileState(path, DAMAGED, _said(error, path))
    return FileState(path, WHOLE)


def _said(error: Exception, path: Path) -> str:
    return str(error).removeprefix(f"{path}: ")


def _changed(path: Path) -> FileState:
    """Return the state of a file that differs from its seal, read in a process of its own."""
    try:
        with executor(1) as others:
            return others.submit(_compared, path).result()
    except IapbError:
        return FileState(path, DAMAGED, f"{_RISK}, and was killed")


def _compared(path: Path) -> FileState:
    """Return the state of a changed file: whether its data agree with their own checksum."""
    try:
        stated = data_seal(head_of(path))
        with opened(path, None, changed=True) as file:
            same = data_checksum(file, Budget(path, file)) == stated
            found = str(attribute_of(file, "format", ""))
        if same and found == FORMAT:
            with opened_run(path, changed=True):  # compares its content hash
                pass
    except (RunFileError, ValueError) as error:
        return FileState(path, DAMAGED, f"{_RISK}: {_said(error, path)}")
    if not same:
        return FileState(path, DAMAGED, f"{_RISK}: its data differ from their checksum")
    why = "attributes were added, the data are whole; `iapb store seal` seals it again"
    return FileState(path, CHANGED, f"{_RISK}: {why}")


def seal_again(state: FileState) -> None:
    """Seal a changed file whose data are whole."""
    write_whole(state.path, sealed(state.path.read_bytes()))


def _head(path: Path) -> tuple[str, int]:
    """Return format and format version of a file."""
    with opened(path, expected_format=None) as file:
        return str(attribute_of(file, "format", "")), int(attribute_of(file, "format_version", 0))

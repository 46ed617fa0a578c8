"""Maintenance of stores: find files that are incomplete, damaged or no longer needed.

Only files in a marked store (`reports.store.io.mark_store`) are ever renamed or removed, and only files of iapb, with
our format attribute and a seal that holds. Such a file that contradicts itself is renamed, so that it is computed
again; one whose seal is broken is named, and stays. What `gc` removes can be computed again from its inputs.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from iapb.errors import ArgumentError, RunFileError
from reference.hdf5 import try_file
from reports.store import io
from reports.store.folder import PARTIAL_SUFFIX
from reports.store.io import WRITING, is_ours, looks_ours, opened
from reports.store.keys import SOURCES, evidence_version, is_older_engine
from reports.store.parts import at_work, is_parts, read_head, remove_parts
from reports.store.runs import opened_run, read_provenance
from reports.store.schema import FORMAT, FORMAT_VERSION, TABLE_FORMAT

Progress = Callable[[int, int], None]

DAMAGED_SUFFIX = ".damaged"
_LOOKED_AT = (".h5", PARTIAL_SUFFIX, WRITING, DAMAGED_SUFFIX)
WHOLE, DAMAGED, PARTIAL, FOREIGN, STALE, LEFTOVER = "whole", "damaged", "partial", "foreign", "stale", "leftover"
OTHER = "other version"


@dataclass(frozen=True)
class FileState:
    """The state of a file or of a folder of parts, and the reason for it."""

    path: Path
    state: str
    why: str = ""

    @property
    def size(self) -> int:
        """Return the size [bytes]."""
        files = self.path.iterdir() if self.path.is_dir() else [self.path]
        return sum(file.stat().st_size for file in files if file.is_file())


def check_store(folder: Path | str, progress: Progress | None = None) -> tuple[FileState, ...]:
    """Read every result file below a folder (or a single file) completely, and check its seal and hashes.

    The folder need not be a marked store. `progress` is called as progress(files read, total files).
    """
    paths, states = list(_files(Path(folder))), list[FileState]()
    for path in paths:
        if progress is not None:
            progress(len(states), len(paths))
        try:
            states.append(_state(path))
        except OSError as error:  # removed meanwhile, or not for us to read
            states.append(FileState(path, FOREIGN, f"cannot be read: {error.strerror or error}"))
    return tuple(states)


def _files(folder: Path) -> Iterator[Path]:
    if folder.is_file():  # a file given by name is checked, whatever its suffix
        yield folder
    for path in sorted(folder.rglob("*")):
        if is_parts(path) or (path.is_file() and path.name.endswith(_LOOKED_AT) and not is_parts(path.parent)):
            yield path


def _state(path: Path) -> FileState:
    if io.is_aside(path):
        return FileState(path, LEFTOVER, "a process is writing it" if io.is_locked(path) else
                         "half written, and nobody writes it; without a seal it stays until you remove it")
    if is_parts(path):
        why = "a process is at work on it" if at_work(path) else "iapb run --resume goes on, repair makes it readable"
        return FileState(path, LEFTOVER, f"a run in the making: {why}")
    if path.name.endswith(WRITING) or not looks_ours(path):
        return FileState(path, FOREIGN, "no file of iapb: no seal, and nothing that says so")
    if path.name.endswith(DAMAGED_SUFFIX):
        return FileState(path, LEFTOVER, "set aside as damaged")
    try:
        kind, _, version = _head(path)
        if kind in (FORMAT, TABLE_FORMAT) and version != FORMAT_VERSION:
            return FileState(path, OTHER, f"its format has version {version}, and this iapb reads {FORMAT_VERSION}")
        if kind == FORMAT:
            with opened_run(path) as (run, _):
                if path.name.endswith(PARTIAL_SUFFIX) or not run.complete:
                    return FileState(path, PARTIAL, f"{run.steps} steps are readable; {run.stopped}")
        elif kind != TABLE_FORMAT:
            return FileState(path, FOREIGN, "an HDF5 file of somebody else's")
        return FileState(path, WHOLE)
    except RunFileError as error:
        return FileState(path, DAMAGED, str(error).removeprefix(f"{path}: "))


def is_run(path: Path) -> bool:
    """Return whether a file is a run or a damaged file of iapb; tables and foreign files are not."""
    try:
        return _head(path)[0] == FORMAT
    except RunFileError:
        return looks_ours(path)


def _head(path: Path) -> tuple[str, str, int]:
    """Return format, code and format version of a file."""
    try_file(path)
    with opened(path, expected_format=None) as file:
        found = file.attrs
        return str(found.get("format", "")), str(found.get("code", "")), int(found.get("format_version", 0))


def stores_below(folder: Path | str) -> tuple[Path, ...]:
    """Return the marked stores at and below a folder.

    Raises
    ------
    ArgumentError
        There is no marked store.
    """
    found = tuple(mark.parent for mark in sorted(Path(folder).rglob(io.MARK_NAME)) if io.is_store(mark.parent))
    if not found:
        raise ArgumentError("where", str(folder), f"a store of iapb ({io.MARK_NAME}) or a folder of stores")
    return found


def parts_of_killed(folder: Path | str) -> list[Path]:
    """Return the folders of parts in stores, at and below a folder, that no process is writing."""
    return [path for store in stores_below(folder) for path in sorted(store.iterdir())
            if is_parts(path) and not at_work(path)]


def repair_store(folder: Path | str, progress: Progress | None = None) -> tuple[FileState, ...]:
    """Rename the damaged files in all stores whose seal holds; return the earlier state of every file.

    A renamed file is computed again when it is next requested. One with a broken seal may be somebody's, and stays.
    """
    stores, states = stores_below(folder), check_store(folder, progress)
    return tuple(replace(state, why=f"{state.why} (left where it is)")
                 if state.state == DAMAGED and not (state.path.parent in stores and _set_aside(state.path)) else state
                 for state in states)


def _set_aside(path: Path) -> bool:
    aside = path.with_name(path.name + DAMAGED_SUFFIX)
    with suppress(OSError):  # in a folder that cannot be changed
        if is_ours(path) and not os.path.lexists(aside):
            os.rename(path, aside)
            return True
    return False


def garbage(folder: Path | str) -> tuple[FileState, ...]:
    """Return the files in stores that nothing needs: leftovers, unfinished runs that are finished now or of older code,
    results of older code.

    Results of user code (`RunStore(folder, code=…)`), results of versions that did not record their code, and files so
    young that a process may still be writing them do not belong to these.
    """
    return tuple(state for store in stores_below(folder) for state in _garbage(store))


def _garbage(store: Path) -> Iterator[FileState]:
    for path in io.abandoned(store):
        yield FileState(path, LEFTOVER, "a writer was stopped before it was done")
    for path in _files(store):
        if path.parent != store or path.is_symlink():
            continue
        name = path.name
        if is_parts(path):
            if io.is_old(path) and not at_work(path) and (why := _useless(path)):
                yield FileState(path, LEFTOVER, why)
        elif name.endswith(WRITING) or not is_ours(path):
            continue
        elif name.endswith(DAMAGED_SUFFIX):
            yield FileState(path, LEFTOVER, "set aside as damaged")
        elif name.endswith(PARTIAL_SUFFIX):
            if io.is_old(path) and _is_whole(path.with_suffix("")):
                yield FileState(path, PARTIAL, "the finished run is there")
        elif kind := _stale(path):
            yield FileState(path, STALE, f"a {kind} of older code")


def _is_whole(path: Path) -> bool:
    return path.is_file() and is_ours(path) and _state(path).state == WHOLE


def _useless(parts: Path) -> str:
    """Return why a run cannot be resumed from its parts; "" if it can, or if they are damaged."""
    if _is_whole(parts.with_suffix("")):
        return "the parts of a run that is finished"
    with suppress(RunFileError):
        return "the parts of a run of older code" if is_older_engine(str(read_head(parts).get("code", ""))) else ""
    return ""


def _stale(path: Path) -> str:
    """Return "run" or "table" if other code of iapb made a file; "" for all other files and those of later formats."""
    with suppress(RunFileError):
        kind, code, version = _head(path)
        if version > FORMAT_VERSION:
            return ""
        if kind == FORMAT:
            return "run" if is_older_engine(code) else ""
        return "table" if read_provenance(path).get(SOURCES, evidence_version()) != evidence_version() else ""
    return ""


def collect_garbage(found: Iterable[FileState]) -> None:
    """Remove the files that `garbage` has found."""
    for state in found:
        (remove_parts if is_parts(state.path) else io.remove_unless_locked)(state.path)

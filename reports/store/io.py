"""Result files: HDF5 with units and dimension scales, written atomically and sealed with a checksum.

A file is written under a temporary name, synced and renamed. Its seal is a checksum of the whole HDF5 content, appended
after it. HDF5's own checksums cover only chunks of numbers and some metadata, and one wrong byte elsewhere can crash
the HDF5 library (we have seen a double free, which ends the process). Therefore the seal is checked before the library
opens the file. HDF5 and all software based on it ignore bytes after the end that the file states.
"""

from __future__ import annotations

import errno
import fcntl
import hashlib
import json
import os
import re
import signal
import stat
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from threading import current_thread, main_thread
from typing import Any

import numpy as np

from iapb.errors import IapbError, RunFileError
from reference.hdf5 import Budget, check_items, check_size, read_dataset, try_file
from reports.store.schema import FORMAT, FORMAT_VERSION, TABLE_FORMAT

MARK_NAME = "iapb-store.json"
_STORE: dict[str, Any] = {
    "format": "iapb store", "format_version": 1,
    "note": "iapb store gc and repair act on the sealed files of iapb in this folder, and on nothing else",
}  # fmt: skip
WRITING = ".writing"  # suffix of a file that is not yet complete
_ASIDE = re.compile(rf"\.(.+\.h5(\.partial)?|\d+\.part|{re.escape(MARK_NAME)})\.\d+{re.escape(WRITING)}")
# A write takes seconds; older temporary files were left by killed writers.
_ABANDONED_AFTER_SECONDS = 3600.0

_MARK = b"\niapb sha256 "
SEAL = len(_MARK) + 64 + 1  # bytes: the mark, 64 hexadecimal digits, a newline
_HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_FORMATS = (FORMAT, TABLE_FORMAT)
PART_HEAD = b'{"format": "iapb part"'  # see `reports.store.parts`
_HEAD = 1 << 16  # bytes, among which the attributes of a file are
_BLOCK = 1 << 20
# Chunks of about this size: small enough to look at a part, large enough to compress.
_CHUNK_BYTES = 1 << 17


def _sync(path: Path) -> None:
    """Wait until a file, or the entries of a folder, are on the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextmanager
def written_aside(target: Path, *, replace: bool, synced: bool = True) -> Iterator[Path]:
    """Yield a temporary path to write to; afterwards move it to `target` atomically.

    A crash at any time leaves `target` unchanged. With ``replace=False`` a target that exists at the end is kept, and
    the temporary file is removed: the first of two writers wins. A file that is not `synced` may be lost, not damaged
    unseen, by a power failure.

    Raises
    ------
    RunFileError
        The file cannot be written; then nothing at `target` was changed.
    """
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.exists() and not target.is_file():
            raise OSError(errno.EEXIST, "a folder, a pipe or a device is in its place")
        aside, lock = _locked(target)
        try:
            yield aside
            if synced:
                _sync(aside)
            if replace:
                os.replace(aside, target)
            else:
                try:
                    os.link(aside, target)  # fails when the target exists, unlike a rename
                except FileExistsError:
                    return
                except OSError:  # a file system without hard links
                    if not target.exists():
                        os.rename(aside, target)
            if synced:
                _sync(target.parent)
        finally:
            aside.unlink(missing_ok=True)
            os.close(lock)
    except (OSError, RuntimeError) as error:
        named = Path(getattr(error, "filename", None) or target)
        if named not in target.parents and named.parent != target.parent:  # of another file, read meanwhile
            raise
        number = re.search(r"errno = (\d+)", str(error))  # the HDF5 library includes the number in its message
        why = getattr(error, "strerror", None) or (os.strerror(int(number[1])) if number else error)
        raise RunFileError(f"{target}: cannot be written: {why}; the previous file is unchanged") from error


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file atomically, and not synced; it raises the error of `written_aside`."""
    with written_aside(path.resolve(), replace=True, synced=False) as aside:
        aside.write_bytes(content.encode() if isinstance(content, str) else content)


def _locked(target: Path) -> tuple[Path, int]:
    """Return a new temporary file for a target, locked until it is closed or the process ends; no file is reused."""
    number = os.getpid()
    while True:
        path = target.with_name(f".{target.name}.{number}{WRITING}")
        try:
            file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o644)
        except FileExistsError:
            number += 1 << 22  # beyond the numbers of processes
            continue
        fcntl.flock(file, fcntl.LOCK_EX)
        return path, file


@contextmanager
def _held(path: Path) -> Iterator[bool]:
    """Lock a file, so that no process can start to write it; yield False if one does, or if it cannot be opened."""
    with ExitStack() as files:
        free = False
        with suppress(OSError):
            file = files.enter_context(path.open("r+b"))
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            free = True
        yield free


def is_locked(path: Path) -> bool:
    """Return whether a process is writing a file and holds its lock; False if the file does not exist."""
    with _held(path) as free:
        return not free and path.exists()


def remove_unless_locked(path: Path) -> None:
    """Remove a file if it is ours, now, and no process is writing it."""
    with suppress(OSError):
        if is_ours(path):
            with _held(path) as free:
                if free:
                    path.unlink()


def refuse_foreign(path: Path) -> None:
    """Raise RunFileError if there is a file at `path` that is not ours, and so may not be replaced."""
    if os.path.lexists(path) and not is_ours(path):
        raise RunFileError(f"{path}: is no whole file of iapb, and is not replaced: move it away")


def mark_store(folder: Path) -> None:
    """Create a folder if necessary, and mark it as a store; files are only ever removed from marked stores."""
    if not is_store(folder):
        with written_aside(folder / MARK_NAME, replace=False) as aside:
            aside.write_text(json.dumps(_STORE) + "\n", encoding="utf-8")


def is_store(folder: Path) -> bool:
    """Return whether a folder is marked as a store with a format that this version supports."""
    try:
        file = folder / MARK_NAME
        mark = json.loads(file.read_text(encoding="utf-8") if file.is_file() else "")  # a pipe would be waited for
        return bool(mark["format"] == _STORE["format"] and mark["format_version"] <= _STORE["format_version"])
    except (OSError, ValueError, TypeError, KeyError, RecursionError):
        return False


def is_old(path: Path) -> bool:
    """Return whether a file is so old that no process can still be writing it; False if it does not exist."""
    with suppress(FileNotFoundError):
        return time.time() - path.stat().st_mtime > _ABANDONED_AFTER_SECONDS
    return False


def abandoned(folder: Path) -> list[Path]:
    """Return the whole temporary files that killed writers left in a store; not those still written."""
    found = sorted(folder.glob(f".*{WRITING}")) if is_store(folder) else []
    return [path for path in found if is_aside(path) and is_old(path) and not is_locked(path) and is_ours(path)]


def is_aside(path: Path) -> bool:
    """Return whether a file has the name of a temporary file of `written_aside`."""
    return _ASIDE.fullmatch(path.name) is not None


def is_ours(path: Path) -> bool:
    """Return whether a file has our format attribute, or the head of a part, and a seal that holds.

    Only such files are ever renamed or removed. Links, pipes and files with two names are not ours.
    """
    with suppress(OSError, RunFileError):
        if _is_plain(path) and _ends(path)[0].startswith(PART_HEAD):
            return _seal_holds(path)
        try_file(path)
        with opened(path, expected_format=None) as file:
            return _is_plain(path) and file.attrs.get("format") in _FORMATS
    return False


def looks_ours(path: Path) -> bool:
    """Return whether a file is ours or was so before it was damaged: it ends like a seal, begins like a part, or its
    HDF5 head has our attributes."""
    if not _is_plain(path):
        return False
    head, end = _ends(path)
    return end.startswith(_MARK) or head.startswith(PART_HEAD) or (
        head.startswith(_HDF5_SIGNATURE) and b"\0format_version\0" in head
        and any(name.encode() in head for name in _FORMATS))


def _is_plain(path: Path) -> bool:
    found = path.lstat()
    return stat.S_ISREG(found.st_mode) and found.st_nlink == 1


def _ends(path: Path) -> tuple[bytes, bytes]:
    """Return the head of a file, and as many last bytes as a seal has."""
    with path.open("rb") as file:
        head = file.read(_HEAD)
        file.seek(max(path.stat().st_size - SEAL, 0))
        return head, file.read()


def sealed(content: bytes) -> bytes:
    """Return a file's content with its checksum appended."""
    return content + _MARK + hashlib.sha256(content).hexdigest().encode() + b"\n"


def _check_seal(path: Path) -> None:
    """Raise RunFileError unless `path` is an HDF5 file whose every byte agrees with its seal."""
    head, mark = _ends(path)
    if not head.startswith(_HDF5_SIGNATURE):
        raise RunFileError(f"{path}: not an HDF5 file, or damaged at its beginning")
    size = path.stat().st_size - SEAL
    if size < 0 or not mark.startswith(_MARK):
        raise RunFileError(f"{path}: no checksum at its end: the file was cut short, changed, or not written by iapb; "
                           "if it was a run, remove it to compute it again")
    if not _seal_holds(path):
        raise RunFileError(f"{path}: differs from its checksum, the file is damaged; remove it to compute it again")


def _seal_holds(path: Path) -> bool:
    size = max(path.stat().st_size - SEAL, 0)
    return _ends(path)[1] == _MARK + _checksum(path, size).encode() + b"\n"


def _checksum(path: Path, size: int) -> str:
    """Return sha256 of the first `size` bytes."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while size > 0 and (block := file.read(min(_BLOCK, size))):
            digest.update(block)
            size -= len(block)
    return digest.hexdigest()


_noted: list[int] = []  # Ctrl-C that came while a file is written


@contextmanager
def _noting_ctrl_c() -> Iterator[None]:
    """Note Ctrl-C and raise it at the end, or in `extend`: in a callback of h5py Python would drop the exception."""
    if current_thread() is not main_thread() or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, lambda number, frame: _noted.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        _raise_noted()


def _raise_noted() -> None:
    if _noted:
        _noted.clear()
        raise KeyboardInterrupt


@contextmanager
def new_file(path: Path, *, replace: bool, large: bool = False) -> Iterator[Any]:
    """Yield an HDF5 file to fill; afterwards it is sealed, synced, and moved to `path` atomically.

    It is filled in memory, so that a disk error occurs in our own write and not inside the HDF5 library. A `large` file
    may exceed the memory and is filled on disk.

    Raises
    ------
    RunFileError
        The file cannot be written; then nothing at `path` was changed.
    """
    with _noting_ctrl_c():
        yield from _new_file(path, replace, large)


def _new_file(path: Path, replace: bool, large: bool) -> Iterator[Any]:
    import h5py

    if not large:
        with h5py.File(path.name, "w", driver="core", backing_store=False) as file:
            yield file
            file.flush()
            image = file.id.get_file_image()
    with written_aside(path, replace=replace) as aside:
        if not large:
            aside.write_bytes(sealed(image))
            return
        with h5py.File(aside, "w", rdcc_nbytes=2 * _CHUNK_BYTES, locking=False) as file:
            yield file
        mark = _MARK + _checksum(aside, aside.stat().st_size).encode() + b"\n"
        with aside.open("ab") as end:
            end.write(mark)


@contextmanager
def opened(path: Path | str, expected_format: str | None = FORMAT) -> Iterator[Any]:
    """Open a file of this project for reading; with `expected_format` None, any format is accepted.

    A file outside of stores is first read in a process of its own (`reference.hdf5.try_file`).

    Raises
    ------
    RunFileError
        The file is absent, is not an HDF5 file, has another format, or cannot be read.
    """
    import h5py

    path = Path(path)
    if not path.is_file():
        what = "a folder, not a file" if path.is_dir() else "no regular file" if path.exists() else "no such file"
        raise RunFileError(f"{path}: {what}")
    try:
        _check_seal(path)
        if not is_store(path.parent):
            try_file(path)
        with h5py.File(path, "r", rdcc_nbytes=2 * _CHUNK_BYTES) as file:
            check_items(file)
            found = file.attrs.get("format")
            if expected_format not in (None, found):
                raise RunFileError(f"{path}: format is {found!r}: expected {expected_format!r}")
            version = int(file.attrs.get("format_version", 0)) if expected_format else FORMAT_VERSION
            if version != FORMAT_VERSION:
                earlier = version < FORMAT_VERSION
                more = "; simulate the run again, it will be stored beside this file" if earlier else ""
                raise RunFileError(f"{path}: format version is {version}, of {'an earlier' if earlier else 'a later'} "
                                   f"iapb: this one reads {FORMAT_VERSION}{more}")
            yield file
    except IapbError:
        raise
    except Exception as error:  # sealed, but made by other software: any error is possible
        raise RunFileError(f"{path}: cannot be read as {expected_format or 'a file of iapb'}: {error}") from error


def write_text(group: Any, name: str, text: str) -> None:
    """Write one text of any length as a scalar UTF-8 dataset."""
    import h5py

    group.create_dataset(name, data=text, dtype=h5py.string_dtype("utf-8"))


def write_values(group: Any, name: str, values: Any, *, growing: bool = False) -> Any:
    """Write an array or a sequence of texts; numbers get a chunked layout, shuffle, gzip and fletcher32.

    A `growing` array can be extended along its first axis.
    """
    import h5py

    array = np.asarray(values)
    if array.dtype.kind in "UO" or (array.size == 0 and isinstance(values, tuple)):
        texts = np.array([str(value) for value in values], object)
        return group.create_dataset(name, data=texts, dtype=h5py.string_dtype("utf-8"))
    if array.dtype == np.bool_:
        array = array.astype(np.uint8)  # netCDF has no truth values
    rows = max(_CHUNK_BYTES // max(int(np.prod(array.shape[1:])) * array.itemsize, 1), 1)
    largest: tuple[int | None, ...] = (None,) * array.ndim if array.size == 0 else array.shape
    if growing:
        largest = (None, *(length or None for length in array.shape[1:]))
    chunks = (rows if growing else min(rows, max(array.shape[0], 1)), *(max(length, 1) for length in array.shape[1:]))
    return group.create_dataset(name, data=array, chunks=chunks, maxshape=largest, compression="gzip",
                                compression_opts=4, shuffle=True, fletcher32=True)  # fmt: skip


def extend(dataset: Any, values: Any) -> None:
    """Append rows to a growing dataset."""
    _raise_noted()
    if len(values):
        first = len(dataset)
        dataset.resize(first + len(values), axis=0)
        dataset[first:] = np.asarray(values)


def write_scale(group: Any, dimension: str, values: Any, unit: str, *, growing: bool = False) -> Any:
    """Write the values along a dimension, make them its scale, and return it."""
    scale = write_values(group, dimension, values, growing=growing)
    scale.attrs["units"] = unit
    scale.make_scale(dimension)
    return scale


def write_quantity(
    group: Any, name: str, values: Any, scales: Sequence[Any], unit: str, meaning: str, *, growing: bool = False
) -> Any:
    """Write one quantity along dimensions with these scales."""
    dataset = write_values(group, name, values, growing=growing)
    dataset.attrs.update({"units": unit, "long_name": meaning})
    for axis, scale in enumerate(scales):
        dataset.dims[axis].attach_scale(scale)
    return dataset


def group_of(file: Any, name: str, path: Path | str) -> Any:
    """Return a group; raise RunFileError for a dataset in its place, because iterating over it might never end."""
    import h5py

    if not isinstance(file.get(name), h5py.Group):
        raise RunFileError(f"{path}: the group {name} is missing")
    return file[name]


def read_values(group: Any, name: str, budget: Budget) -> Any:
    """Return a dataset of `group` as an array, a text or a tuple of texts.

    Raises
    ------
    RunFileError
        There is no such dataset.
    ValueError
        It states more values than its bytes can hold, or fills more than the budget.
    """
    return read_dataset(_found(group, name, budget), budget)


def dataset_of(group: Any, name: str, budget: Budget) -> Any:
    """Return a dataset of `group` without reading its values; it raises the errors of `read_values`."""
    dataset = _found(group, name, budget)
    check_size(dataset, budget)
    return dataset


def _found(group: Any, name: str, budget: Budget) -> Any:
    import h5py

    within = isinstance(group, h5py.Group)  # "get" would read a whole dataset, of any stated length
    dataset = group.get(name) if within else None
    if not isinstance(dataset, h5py.Dataset):
        raise RunFileError(f"{budget}: {group.name}/{name} is missing")
    return dataset


def blocks(values: Any) -> Iterator[np.ndarray]:
    """Yield an array or a dataset in blocks of rows of about a megabyte; an empty one is yielded unchanged."""
    width = max(int(np.prod(values.shape[1:])) * values.dtype.itemsize, 1)
    rows = max(_BLOCK // width, 1)
    for first in range(0, max(len(values), 1), rows):
        yield values[first : first + rows]

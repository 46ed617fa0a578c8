"""Result files: HDF5 with units and dimension scales, written atomically and sealed with a
checksum.

A file is written under a temporary name, synced and renamed. Its seal is a checksum of the whole
HDF5 content and one of its data (datasets, and the attributes of a run), in HDF5's user block
before it. HDF5's own checksums cover only chunks of numbers and
some metadata, and one wrong byte elsewhere can crash the HDF5 library (we have seen a double free,
which ends the process). Therefore the seal is checked before the library opens the file. HDF5 and
all software based on it keep the user block as it is: opening a file for writing and closing it
leaves it whole, and an attribute that is added makes it differ from its seal.
"""

from __future__ import annotations

import errno
import fcntl
import hashlib
import os
import re
import secrets
import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from threading import current_thread, main_thread
from typing import Any

import numpy as np

from iapb.errors import IapbError, RunFileError
from reference.hdf5 import Budget, attribute_of, check_dataset
from reports.store.schema import ATTRIBUTES, FORMAT, FORMAT_VERSION, TABLE_FORMAT

WRITING = ".writing"  # suffix of a file that is not yet complete

_MARK = b"iapb sha256 "  # then the checksums of all bytes and of the data, 64 digits each
_USER_BLOCK = 512  # bytes before the HDF5 content; HDF5 allows no fewer
_HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_FORMATS = (FORMAT, TABLE_FORMAT)
_HEAD = 1 << 16  # bytes, among which the attributes of a file are
_BLOCK = 1 << 20
# Chunks of about this size: small enough to look at a part, large enough to compress.
_CHUNK_BYTES = 1 << 17


class ChangedFileError(RunFileError):
    """A file of iapb differs from its seal."""


class OpenFileError(RunFileError):
    """Another program holds the file open for writing."""


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

    A crash at any time leaves `target` unchanged. With ``replace=False`` a target that exists at
    the end is kept, and the temporary file is removed: the first of two writers wins. A file that
    is not `synced` may be lost, not damaged unseen, by a power failure.

    Raises
    ------
    RunFileError
        The file cannot be written; then nothing at `target` was changed.
    """
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.exists() and not target.is_file():
            raise OSError(errno.EEXIST, "a folder, a pipe or a device is in its place")
        aside = target.with_name(f".{target.name}.{secrets.token_hex(8)}{WRITING}")
        try:
            yield aside
            if synced:
                _sync(aside)
            _put_in_place(aside, target, replace)
            if synced:
                _sync(target.parent)
        finally:
            aside.unlink(missing_ok=True)
    except (OSError, RuntimeError) as error:
        named = Path(getattr(error, "filename", None) or target)
        # of another file, read meanwhile
        if named not in target.parents and named.parent != target.parent:
            raise
        raise RunFileError(
            f"{target}: cannot be written: {_reason(error)}; the previous file is unchanged"
        ) from error


def _put_in_place(aside: Path, target: Path, replace: bool) -> None:
    """Move a complete file to its place; a target that exists stays unless `replace`."""
    if replace:
        os.replace(aside, target)
        return
    try:
        os.link(aside, target)  # fails when the target exists, unlike a rename
    except FileExistsError:
        pass
    except OSError:  # a file system without hard links
        if not target.exists():
            os.rename(aside, target)


def _reason(error: OSError | RuntimeError) -> Any:
    """Return why a file could not be written; the HDF5 library has the number in its message."""
    if said := getattr(error, "strerror", None):
        return said
    number = re.search(r"errno = (\d+)", str(error))
    return os.strerror(int(number[1])) if number else error


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file atomically, and not synced; it raises the error of `written_aside`."""
    with written_aside(path.resolve(), replace=True, synced=False) as aside:
        aside.write_bytes(content.encode() if isinstance(content, str) else content)


def looks_ours(path: Path) -> bool:
    """Return whether a file is ours or was so before it was damaged: it has a seal, or its HDF5
    head has our attributes."""
    head = head_of(path)
    return head.startswith(_MARK) or (
        head.startswith((_HDF5_SIGNATURE, bytes(_USER_BLOCK) + _HDF5_SIGNATURE))
        and b"\0format_version\0" in head
        and any(name.encode() in head for name in _FORMATS)
    )


def head_of(path: Path) -> bytes:
    """Return the bytes of a file that hold its seal, and the attributes of an HDF5 file."""
    with path.open("rb") as file:
        return file.read(_HEAD)


def sealed(content: bytes, data: str = "") -> bytes:
    """Return HDF5 content behind a user block with its checksum and that of its data.

    A user block that it has is replaced, and gives the checksum of the data.
    """
    if content.startswith(_MARK):
        data = data or data_seal(content)
        content = content[_USER_BLOCK:]
    return _user_block(hashlib.sha256(content).hexdigest(), data) + content


def _user_block(whole: str, data: str) -> bytes:
    return f"{_MARK.decode()}{whole} {data}\n".encode().ljust(_USER_BLOCK, b"\0")


def data_seal(head: bytes) -> str:
    """Return the checksum of the data that a user block states."""
    first = head[:_USER_BLOCK].partition(b"\n")[0]
    return first.rpartition(b" ")[2].decode("ascii", "replace")


def data_checksum(file: Any, budget: Budget | None = None) -> str:
    """Return sha256 of all datasets, and of the attributes by which a run is read.

    budget : of a file that is not our own, whose datasets are checked first (see `dataset_at`)
    """
    import h5py

    digest = hashlib.sha256()
    datasets = dict[str, Any]()
    file.visititems(
        lambda name, item: datasets.update({name: item} if isinstance(item, h5py.Dataset) else {})
    )
    for name in ATTRIBUTES:
        digest.update(f"{name} {attribute_of(file, name)!r}\n".encode())
    for name, dataset in sorted(datasets.items()):
        if budget is not None:
            check_dataset(dataset, budget)
        digest.update(f"{name} {dataset.dtype.str} {dataset.shape}\n".encode())
        for block in blocks(dataset) if dataset.shape else [np.asarray(dataset[()])]:
            text = block.dtype.hasobject
            digest.update(repr(block.tolist()).encode() if text else block.tobytes())
    return digest.hexdigest()


def _check_seal(path: Path) -> None:
    """Raise RunFileError unless `path` is an HDF5 file whose every byte agrees with its seal."""
    _require_closed(path)
    head = head_of(path)
    if not head.startswith(_MARK):
        raise RunFileError(
            f"{path}: no seal at its beginning: not written by iapb, or damaged there; if it was a "
            "run, remove it to compute it again"
        )
    if head[:_USER_BLOCK] != _user_block(_checksum(path), data_seal(head)):
        raise ChangedFileError(
            f"{path}: differs from its seal: it was changed since iapb wrote it, or it is damaged; "
            "`iapb store check` tells which"
        )


def _require_closed(path: Path) -> None:
    """Raise OpenFileError if another program holds a file open for writing; HDF5 locks it then."""
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            raise OpenFileError(
                f"{path}: another program holds it open for writing; close it there first"
            ) from None
        except OSError:  # a file system without locks
            return


def _checksum(path: Path) -> str:
    """Return sha256 of the bytes behind the user block."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        file.seek(_USER_BLOCK)
        while block := file.read(_BLOCK):
            digest.update(block)
    return digest.hexdigest()


@contextmanager
def _noting_ctrl_c() -> Iterator[None]:
    """Note Ctrl-C and raise it at the end: in a callback of h5py Python would drop the
    exception."""
    if (
        current_thread() is not main_thread()
        or signal.getsignal(signal.SIGINT) is not signal.default_int_handler
    ):
        yield
        return
    noted: list[int] = []
    signal.signal(signal.SIGINT, lambda number, frame: noted.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if noted:
            raise KeyboardInterrupt


@contextmanager
def new_file(path: Path, *, replace: bool) -> Iterator[Any]:
    """Yield an HDF5 file to fill; afterwards it is sealed, synced, and moved to `path` atomically.

    It is filled in memory, so that a disk error occurs in our own write and not inside the HDF5
    library.

    Raises
    ------
    RunFileError
        The file cannot be written; then nothing at `path` was changed.
    """
    import h5py

    with _noting_ctrl_c():
        with h5py.File(
            path.name, "w", driver="core", backing_store=False, userblock_size=_USER_BLOCK
        ) as file:
            yield file
            file.flush()
            data = data_checksum(file)
            image = file.id.get_file_image()
        with written_aside(path, replace=replace) as aside:
            aside.write_bytes(sealed(image, data))


@contextmanager
def opened(
    path: Path | str, expected_format: str | None = FORMAT, changed: bool = False
) -> Iterator[Any]:
    """Open a file of this project for reading; with `expected_format` None, any format is accepted.

    changed : whether its bytes may differ from its seal; then the HDF5 library may crash

    Raises
    ------
    RunFileError
        The file is absent, is not an HDF5 file, has another format, or cannot be read.
    """
    import h5py

    path = Path(path)
    if not path.is_file():
        raise RunFileError(f"{path}: {'not a file' if path.exists() else 'no such file'}")
    if path.suffix in (".yaml", ".yml"):
        raise RunFileError(f"{path}: a scene, not a run; `iapb run {path}` makes a run of it")
    try:
        if not changed:
            _check_seal(path)
        with h5py.File(path, "r", rdcc_nbytes=2 * _CHUNK_BYTES) as file:
            found = attribute_of(file, "format")
            if expected_format not in (None, found):
                raise RunFileError(f"{path}: format is {found!r}: expected {expected_format!r}")
            version = int(attribute_of(file, "format_version", 0))
            if expected_format and version != FORMAT_VERSION:
                raise RunFileError(
                    f"{path}: format version is {version}, of another iapb: this one reads "
                    f"{FORMAT_VERSION}; simulate the run again, it will be stored beside this file"
                )
            yield file
    except IapbError:
        raise
    except Exception as error:  # sealed, but made by other software: any error is possible
        raise RunFileError(
            f"{path}: cannot be read as {expected_format or 'a file of iapb'}: {error}"
        ) from error


def write_text(group: Any, name: str, text: str) -> None:
    """Write one text of any length as a scalar UTF-8 dataset."""
    import h5py

    group.create_dataset(name, data=text, dtype=h5py.string_dtype("utf-8"))


def write_values(group: Any, name: str, values: Any) -> Any:
    """Write an array or a sequence of texts; numbers get a chunked layout, shuffle and gzip."""
    import h5py

    array = np.asarray(values)
    if array.dtype.kind in "UO" or (array.size == 0 and isinstance(values, tuple)):
        texts = np.array([str(value) for value in values], object)
        return group.create_dataset(name, data=texts, dtype=h5py.string_dtype("utf-8"))
    if array.dtype == np.bool_:
        array = array.astype(np.uint8)  # netCDF has no truth values
    rows = max(_CHUNK_BYTES // max(int(np.prod(array.shape[1:])) * array.itemsize, 1), 1)
    largest: tuple[int | None, ...] = (None,) * array.ndim if array.size == 0 else array.shape
    chunks = (min(rows, max(array.shape[0], 1)), *(max(length, 1) for length in array.shape[1:]))
    return group.create_dataset(
        name,
        data=array,
        chunks=chunks,
        maxshape=largest,
        compression="gzip",
        compression_opts=4,
        shuffle=True,
    )


def write_scale(group: Any, dimension: str, values: Any, unit: str) -> Any:
    """Write the values along a dimension, make them its scale, and return it."""
    scale = write_values(group, dimension, values)
    scale.attrs["units"] = unit
    scale.make_scale(dimension)
    return scale


def write_quantity(
    group: Any, name: str, values: Any, scales: Sequence[Any], unit: str, meaning: str
) -> Any:
    """Write one quantity along dimensions with these scales."""
    dataset = write_values(group, name, values)
    dataset.attrs.update({"units": unit, "long_name": meaning})
    for axis, scale in enumerate(scales):
        dataset.dims[axis].attach_scale(scale)
    return dataset


def blocks(values: Any) -> Iterator[np.ndarray]:
    """Yield an array or a dataset in blocks of rows of about a megabyte; an empty one is yielded
    unchanged."""
    width = max(int(np.prod(values.shape[1:])) * values.dtype.itemsize, 1)
    rows = max(_BLOCK // width, 1)
    for first in range(0, max(len(values), 1), rows):
        yield values[first : first + rows]

"""Result files: HDF5 with units and dimension scales, written atomically and sealed with a
checksum.

A file is written under a temporary name, synced and renamed. Its seal is a checksum of the whole
HDF5 content, appended after it. HDF5's own checksums cover only chunks of numbers and some
metadata, and one wrong byte elsewhere can crash the HDF5 library (we have seen a double free, which
ends the process). Therefore the seal is checked before the library opens the file. HDF5 and all
software based on it ignore bytes after the end that the file states.
"""

from __future__ import annotations

import errno
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
from reference.hdf5 import attribute_of
from reports.store.schema import FORMAT, FORMAT_VERSION, TABLE_FORMAT

WRITING = ".writing"  # suffix of a file that is not yet complete

_MARK = b"\niapb sha256 "
_SEAL = len(_MARK) + 64 + 1  # bytes: the mark, 64 hexadecimal digits, a newline
_HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_FORMATS = (FORMAT, TABLE_FORMAT)
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
    except (OSError, RuntimeError) as error:
        named = Path(getattr(error, "filename", None) or target)
        if (
            named not in target.parents and named.parent != target.parent
        ):  # of another file, read meanwhile
            raise
        number = re.search(
            r"errno = (\d+)", str(error)
        )  # the HDF5 library includes the number in its message
        why = getattr(error, "strerror", None) or (os.strerror(int(number[1])) if number else error)
        raise RunFileError(
            f"{target}: cannot be written: {why}; the previous file is unchanged"
        ) from error


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file atomically, and not synced; it raises the error of `written_aside`."""
    with written_aside(path.resolve(), replace=True, synced=False) as aside:
        aside.write_bytes(content.encode() if isinstance(content, str) else content)


def looks_ours(path: Path) -> bool:
    """Return whether a file is ours or was so before it was damaged: it ends like a seal, or its
    HDF5 head has our attributes."""
    head, end = _ends(path)
    return end.startswith(_MARK) or (
        head.startswith(_HDF5_SIGNATURE)
        and b"\0format_version\0" in head
        and any(name.encode() in head for name in _FORMATS)
    )


def _ends(path: Path) -> tuple[bytes, bytes]:
    """Return the head of a file, and as many last bytes as a seal has."""
    with path.open("rb") as file:
        head = file.read(_HEAD)
        file.seek(max(path.stat().st_size - _SEAL, 0))
        return head, file.read()


def sealed(content: bytes) -> bytes:
    """Return a file's content with its checksum appended."""
    return content + _MARK + hashlib.sha256(content).hexdigest().encode() + b"\n"


def _check_seal(path: Path) -> None:
    """Raise RunFileError unless `path` is an HDF5 file whose every byte agrees with its seal."""
    head, mark = _ends(path)
    if not head.startswith(_HDF5_SIGNATURE):
        raise RunFileError(f"{path}: not an HDF5 file, or damaged at its beginning")
    size = path.stat().st_size - _SEAL
    if size < 0 or not mark.startswith(_MARK):
        raise RunFileError(
            f"{path}: no checksum at its end: the file was cut short, changed, or not written by "
            f"iapb; "
            "if it was a run, remove it to compute it again"
        )
    if mark != _MARK + _checksum(path, size).encode() + b"\n":
        raise RunFileError(
            f"{path}: differs from its checksum, the file is damaged; remove it to compute it again"
        )


def _checksum(path: Path, size: int) -> str:
    """Return sha256 of the first `size` bytes."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while size > 0 and (block := file.read(min(_BLOCK, size))):
            digest.update(block)
            size -= len(block)
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
        with h5py.File(path.name, "w", driver="core", backing_store=False) as file:
            yield file
            file.flush()
            image = file.id.get_file_image()
        with written_aside(path, replace=replace) as aside:
            aside.write_bytes(sealed(image))


@contextmanager
def opened(path: Path | str, expected_format: str | None = FORMAT) -> Iterator[Any]:
    """Open a file of this project for reading; with `expected_format` None, any format is accepted.

    Raises
    ------
    RunFileError
        The file is absent, is not an HDF5 file, has another format, or cannot be read.
    """
    import h5py

    path = Path(path)
    if not path.is_file():
        what = (
            "a folder, not a file"
            if path.is_dir()
            else "no regular file"
            if path.exists()
            else "no such file"
        )
        raise RunFileError(f"{path}: {what}")
    try:
        _check_seal(path)
        with h5py.File(path, "r", rdcc_nbytes=2 * _CHUNK_BYTES) as file:
            found = attribute_of(file, "format")
            if expected_format not in (None, found):
                raise RunFileError(f"{path}: format is {found!r}: expected {expected_format!r}")
            version = (
                int(attribute_of(file, "format_version", 0)) if expected_format else FORMAT_VERSION
            )
            if version != FORMAT_VERSION:
                earlier = version < FORMAT_VERSION
                more = (
                    "; simulate the run again, it will be stored beside this file"
                    if earlier
                    else ""
                )
                raise RunFileError(
                    f"{path}: format version is {version}, of "
                    f"{'an earlier' if earlier else 'a later'} "
                    f"iapb: this one reads {FORMAT_VERSION}{more}"
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

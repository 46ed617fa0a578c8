"""Safety of HDF5 files from other people: read first by a process that may crash, and within a budget of bytes."""

from __future__ import annotations

import os
import resource
from contextlib import suppress
from functools import lru_cache
from math import prod
from pathlib import Path
from typing import Any

from iapb.errors import RunFileError

READ_BUDGET = 1 << 29  # bytes that one file may fill; a caller may allow more
_PER_BYTE = 64  # a large file may fill so many bytes for each of its own; a run at rest is packed forty times
_KINDS = {1: "a soft link", 64: "a link to another file"}  # by HDF5's number of the kind; a hard link has 0
_DEEPEST, _MOST_ITEMS = 32, 10_000  # groups in groups, and links in all; HDF5 itself crashes on very deep ones
_PACKERS, _FILTERS = {1, 32000}, {1, 2, 3, 32000}  # deflate and lzf; also shuffle and fletcher32
_MOST_PACKED = 1100  # largest expansion factor: deflate makes at most 1032 bytes of one
_UNPACKED_SMALL = 1 << 20  # bytes that any dataset may state
_TEXT = 64  # bytes that Python adds to a text
_ROWS = 1 << 20  # bytes of a piece that is read and dropped
_SECONDS, _BYTES_PER_SECOND = 2, 1 << 20  # that reading may take of the processor: tens of times what it takes


def try_file(path: Path) -> None:
    """Read a file in a forked process; raise RunFileError if the HDF5 library crashes on it, or does not end.

    A few wrong bytes can make the library write beyond its memory, or follow a list that has no end.
    """
    if path.is_file():  # else for the caller to name
        found = path.stat()
        if not _ends(path, found.st_ino, found.st_size, found.st_mtime_ns):
            raise RunFileError(f"{path}: damaged or forged: the HDF5 library crashes on it, or does not end")


@lru_cache(512)  # commands open a file several times
def _ends(path: Path, number: int, size: int, changed: int) -> bool:
    import h5py  # in this process, else each child would load it

    child = os.fork()
    if not child:
        try:
            os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            resource.setrlimit(resource.RLIMIT_CPU, (_SECONDS + size // _BYTES_PER_SECOND,) * 2)
            with h5py.File(path) as file:
                _read_all(file)
        finally:
            os._exit(0)  # what is raised, the caller meets itself
    return not os.WIFSIGNALED(os.waitpid(child, 0)[1])


def _read_all(file: Any) -> None:
    """Read every attribute and every dataset, in pieces."""
    check_items(file)
    items = [file]
    for item in items:
        dict(item.attrs)
        if hasattr(item, "values"):
            items += item.values()
            continue
        with suppress(ValueError):
            check_size(item, Budget(file.filename, file))
            if item.dtype.hasobject or not item.shape:
                read_dataset(item, Budget(file.filename, file))
                continue
            rows = max(_ROWS // max(prod(item.shape[1:]) * item.dtype.itemsize, 1), 1)
            for first in range(0, len(item), rows):
                item[first : first + rows]


class Budget:
    """The bytes that may still be read from one file; its text is the path.

    file : open.  allowed : by default READ_BUDGET, or more for a large file.
    """

    def __init__(self, path: Path | str, file: Any, allowed: int | None = None) -> None:
        self.path, self.file_size = path, file.id.get_filesize()
        self.allowed = self.left = max(READ_BUDGET, _PER_BYTE * self.file_size) if allowed is None else allowed

    def __str__(self) -> str:
        return str(self.path)

    def take(self, size: int, what: str) -> None:
        """Count bytes; raise ValueError if more than allowed are read."""
        self.left -= size
        if self.left < 0:
            raise ValueError(f"{what} asks for more than the {self.allowed} bytes that may be read (argument budget)")


def check_items(file: Any) -> None:
    """Raise ValueError for what a file from other people may not hold, before any value is read.

    HDF5 can refer to other files by links, as storage of a dataset, or as parts of a virtual dataset, and it opens them
    without asking. A malicious file could thereby show the content of any file that the user may read. Groups are
    walked level by level, because the library's own walk is recursive.
    """
    import h5py

    groups, count, size = [(file.id, "", 0)], 0, file.id.get_filesize()
    _check_texts(file.id, "", size)
    while groups:
        group, path, depth = groups.pop()
        links: list[tuple[bytes, int]] = []
        group.links.iterate(lambda name, link, links=links: links.append((name, int(link.type))), info=True)
        count += len(links)
        if depth > _DEEPEST or count > _MOST_ITEMS:
            raise ValueError(f"{path[:80]} and others: expected at most {_DEEPEST} groups in one another and "
                             f"{_MOST_ITEMS} items")
        for key, kind in links:
            name = f"{path}/{key.decode(errors='replace')}"
            if kind:
                raise ValueError(f"{name} is {_KINDS.get(kind, f'a link of the kind {kind}')}: expected a file without "
                                 "links")
            item = h5py.h5o.open(group, key)
            _check_texts(item, name, size)
            if isinstance(item, h5py.h5g.GroupID):
                groups.append((item, name, depth + 1))
            elif isinstance(item, h5py.h5d.DatasetID):
                _check_storage(item, name)


def _check_texts(item: Any, name: str, size: int) -> None:
    """Refuse an attribute of many texts: each may be the same one, as long as the file."""
    import h5py

    for number in range(h5py.h5a.get_num_attrs(item)):
        if h5py.h5a.get_info(item, index=number).data_size * size <= READ_BUDGET:
            continue  # so few bytes hold few texts; to open an attribute takes ten times as long
        attribute = h5py.h5a.open(item, index=number)
        count, kind = prod(attribute.shape or ()), attribute.get_type().get_class()
        long = kind in (h5py.h5t.STRING, h5py.h5t.VLEN) and attribute.name != b"DIMENSION_LIST"
        if long and count > 1 and count * size > READ_BUDGET:
            raise ValueError(f"{name}: an attribute of {count} texts: expected one")


def _check_storage(dataset: Any, name: str) -> None:
    import h5py

    made = dataset.get_create_plist()
    if made.get_external_count():
        raise ValueError(f"{name} is stored in another file")
    if made.get_layout() == h5py.h5d.VIRTUAL:
        raise ValueError(f"{name} is put together from other datasets")
    filters = [made.get_filter(number)[0] for number in range(made.get_nfilters())]
    if set(filters) - _FILTERS or sum(each in _PACKERS for each in filters) > 1:
        raise ValueError(f"{name} is packed by the filters {filters}: expected gzip or lzf, once")


def check_size(dataset: Any, budget: Budget) -> None:
    """Raise ValueError if a dataset states more values than its bytes can hold, or a piece exceeds the budget."""
    stored, width, name = dataset.id.get_storage_size(), dataset.dtype.itemsize, dataset.name
    if dataset.shape is None:
        raise ValueError(f"{name} has no values")
    if dataset.nbytes > _UNPACKED_SMALL + _MOST_PACKED * stored:
        raise ValueError(f"{name} states {dataset.size} values, more than its bytes can hold")
    pieces = [prod(dataset.shape[1:]) * width, prod(dataset.chunks or (0,)) * width]
    if dataset.compression and _MOST_PACKED * stored > budget.allowed:  # a chunk may unpack to more than it states
        dataset.id.chunk_iter(lambda chunk: pieces.append(_MOST_PACKED * chunk.size) if _MOST_PACKED * chunk.size >
                              pieces[-1] else None)
    if max(pieces) > budget.allowed:
        raise ValueError(f"a piece of {name} may fill {max(pieces)} bytes: {budget.allowed} may be read "
                         "(argument budget)")


def read_dataset(dataset: Any, budget: Budget) -> Any:
    """Return a dataset as an array, a text or a tuple of texts; what it fills is taken from the budget.

    Raises
    ------
    ValueError
        It states more values than its bytes can hold, or fills more than the budget.
    """
    import h5py

    check_size(dataset, budget)
    kind = h5py.check_string_dtype(dataset.dtype)
    if kind is None:
        if dataset.dtype.hasobject:
            raise ValueError(f"{dataset.name} holds neither numbers nor texts")
        budget.take(dataset.nbytes, dataset.name)
        return dataset[()]
    longest = max(kind.length or budget.file_size, 1)  # many entries may refer to one text
    texts, rows, found = dataset.asstr(), max(budget.allowed // (8 * longest), 1), list[str]()
    if dataset.shape == ():
        return str(texts[()])
    if len(dataset.shape) != 1:
        raise ValueError(f"{dataset.name} is no list of texts")
    for first in range(0, len(dataset), rows):
        piece = [str(text) for text in texts[first : first + rows]]
        budget.take(sum(map(len, piece)) + _TEXT * len(piece), dataset.name)
        found += piece
    return tuple(found)

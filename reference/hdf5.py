"""What iapb reads of an HDF5 file: items that a format names, stored in the file itself, within a
budget of bytes.

HDF5 can refer to other files: by links, as storage of a dataset, or as parts of a virtual dataset.
It opens them without asking, so a file could show the content of any file that the user may read.
Therefore a reader opens only the items that its format names, each by `group_at`, `dataset_at` or
`values_at`, and attributes by `attribute_of`.
"""

from __future__ import annotations

from math import prod
from pathlib import Path
from typing import Any

READ_BUDGET = 1 << 29  # bytes that one file may fill; a caller may allow more
# a large file may fill so many bytes for each of its own; a run at rest is packed forty times
_PER_BYTE = 64
_PACKERS = {1, 32000}  # HDF5's numbers of deflate and lzf
_FILTERS = _PACKERS | {2, 3}  # also those that shuffle bytes and add checksums
_MOST_PACKED = 1100  # largest expansion factor: deflate makes at most 1032 bytes of one
_UNPACKED_SMALL = 1 << 20  # bytes that any dataset may state
_MOST_VALUES = 16  # values of an attribute
_TEXT = 64  # bytes that Python adds to a text


class Budget:
    """The bytes that may still be read from one file; its text is the path.

    file : open.  allowed : by default READ_BUDGET, or more for a large file.
    """

    def __init__(self, path: Path | str, file: Any, allowed: int | None = None) -> None:
        self.path = path
        self.file_size = file.id.get_filesize()
        if allowed is None:
            allowed = max(READ_BUDGET, _PER_BYTE * self.file_size)
        self.allowed = allowed
        self.left = allowed

    def __str__(self) -> str:
        return str(self.path)

    def take(self, size: int, what: str) -> None:
        """Count bytes; raise ValueError if more than allowed are read."""
        self.left -= size
        if self.left < 0:
            raise ValueError(
                f"{what} asks for more than the {self.allowed} bytes that may be read (argument budget)"
            )


def group_at(group: Any, name: str) -> Any:
    """Return the group at a path below `group`.

    Raises
    ------
    ValueError
        There is no such group, or a link is on the way.
    """
    import h5py

    found = _item_at(group, name)
    if not isinstance(found, h5py.Group):
        raise ValueError(f"{name} is a dataset: expected a group")
    return found


def dataset_at(group: Any, name: str, budget: Budget) -> Any:
    """Return the dataset at a path below `group` without reading its values.

    Raises
    ------
    ValueError
        There is no such dataset, a link is on the way, its values are not in this file, or its size
        is beyond its bytes or the budget.
    """
    import h5py

    found = _item_at(group, name)
    if not isinstance(found, h5py.Dataset):
        raise ValueError(f"{name} is a group: expected a dataset")
    check_dataset(found, budget)
    return found


def check_dataset(dataset: Any, budget: Budget) -> None:
    """Raise ValueError if the values of a dataset are not in its file, or its size is beyond its
    bytes or the budget."""
    _check_storage(dataset)
    _check_size(dataset, budget)


def values_at(group: Any, name: str, budget: Budget) -> Any:
    """Return a dataset as an array, a text or a tuple of texts; what it fills is taken from the
    budget.

    Raises
    ------
    ValueError
        It cannot be opened (see `dataset_at`), holds neither numbers nor texts, or fills more than
        the budget.
    """
    import h5py

    dataset = dataset_at(group, name, budget)
    kind = h5py.check_string_dtype(dataset.dtype)
    if kind is None:
        if dataset.dtype.hasobject:
            raise ValueError(f"{dataset.name} holds neither numbers nor texts")
        budget.take(dataset.nbytes, dataset.name)
        return dataset[()]
    texts = dataset.asstr()
    if dataset.shape == ():
        return str(texts[()])
    if len(dataset.shape) != 1:
        raise ValueError(f"{dataset.name} is no list of texts")
    longest = max(kind.length or budget.file_size, 1)  # many entries may refer to one text
    rows = max(budget.allowed // (8 * longest), 1)
    found: list[str] = []
    for first in range(0, len(dataset), rows):
        piece = [str(text) for text in texts[first : first + rows]]
        budget.take(sum(map(len, piece)) + _TEXT * len(piece), dataset.name)
        found += piece
    return tuple(found)


def attribute_of(item: Any, name: str, default: Any = None) -> Any:
    """Return an attribute of a file, group or dataset, `default` if it is absent.

    Raises
    ------
    ValueError
        It has more than a few values; each may be a text as long as the file.
    """
    if name not in item.attrs:
        return default
    count = prod(item.attrs.get_id(name).shape or ())
    if count > _MOST_VALUES:
        raise ValueError(
            f"the attribute {name} has {count} values: expected at most {_MOST_VALUES}"
        )
    return item.attrs[name]


def _item_at(group: Any, name: str) -> Any:
    import h5py

    found = group
    for part in name.split("/"):
        link = found.get(part, getlink=True) if isinstance(found, h5py.Group) else None
        if link is None:
            raise ValueError(f"{group.name.rstrip('/')}/{name} is missing")
        if not isinstance(link, h5py.HardLink):
            kind = (
                "a link to another file" if isinstance(link, h5py.ExternalLink) else "a soft link"
            )
            raise ValueError(
                f"{group.name.rstrip('/')}/{name} is {kind}: expected a file without links"
            )
        found = found[part]
    return found


def _check_storage(dataset: Any) -> None:
    import h5py

    name = dataset.name
    made = dataset.id.get_create_plist()
    if made.get_external_count():
        raise ValueError(f"{name} is stored in another file")
    if made.get_layout() == h5py.h5d.VIRTUAL:
        raise ValueError(f"{name} is put together from other datasets")
    filters = [made.get_filter(number)[0] for number in range(made.get_nfilters())]
    if set(filters) - _FILTERS or sum(each in _PACKERS for each in filters) > 1:
        raise ValueError(f"{name} is packed by the filters {filters}: expected gzip or lzf, once")


def _check_size(dataset: Any, budget: Budget) -> None:
    """Raise ValueError if a dataset states more values than its bytes can hold, or a piece exceeds
    the budget."""
    name = dataset.name
    stored = dataset.id.get_storage_size()
    width = dataset.dtype.itemsize
    if dataset.shape is None:
        raise ValueError(f"{name} has no values")
    if dataset.nbytes > _UNPACKED_SMALL + _MOST_PACKED * stored:
        raise ValueError(f"{name} states {dataset.size} values, more than its bytes can hold")
    largest = max(prod(dataset.shape[1:]), prod(dataset.chunks or (0,))) * width
    # a chunk may unpack to more than it states
    if dataset.compression and _MOST_PACKED * stored > budget.allowed:
        sizes: list[int] = []
        dataset.id.chunk_iter(lambda chunk: sizes.append(chunk.size))
        largest = max(largest, _MOST_PACKED * max(sizes, default=0))
    if largest > budget.allowed:
        raise ValueError(
            f"a piece of {name} may fill {largest} bytes: {budget.allowed} may be read (argument budget)"
        )

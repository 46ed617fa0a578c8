"""Datasets as every file of this project has them: checksummed, compressed, with units and dimension scales."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from iapb.errors import RunFileError
from reports.store_files import written_aside
from reports.store_seal import seal

# Chunks of about this size: small enough to look at a part, large enough to compress.
_CHUNK_BYTES = 1 << 17
_COMPRESSION_LEVEL = 4
_MOST_PACKED = 1100  # times: deflate makes at most 1032 bytes of one
_UNPACKED_SMALL = 1 << 20  # bytes that anything may state


@contextmanager
def new_file(path: Path, *, replace: bool) -> Iterator[Any]:
    """Give an HDF5 file to fill; afterwards it is sealed, synced, and moved to `path` in one step.

    It is filled in memory, so that a disk that fails meets our write, not one somewhere inside the HDF5 library.

    Raises
    ------
    RunFileError
        If the disk or the folder does not take it; then nothing at `path` was changed.
    """
    import h5py

    with h5py.File(path.name, "w", driver="core", backing_store=False) as file:
        yield file
        file.flush()
        image = file.id.get_file_image()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with written_aside(path, replace=replace) as aside:
            aside.write_bytes(image)
            seal(aside)
    except OSError as error:
        why = error.strerror or error
        raise RunFileError(f"{path}: cannot be written: {why}; what was there is as it was") from error


def write_text(group: Any, name: str, text: str) -> None:
    """Write one text of any length as a scalar UTF-8 dataset."""
    import h5py

    group.create_dataset(name, data=text, dtype=h5py.string_dtype("utf-8"))


def write_values(group: Any, name: str, values: Any) -> Any:
    """Write an array or a sequence of texts; numbers get a chunked layout, shuffle, gzip and fletcher32."""
    import h5py

    array = np.asarray(values)
    if array.dtype.kind in "UO" or (array.size == 0 and isinstance(values, tuple)):
        texts = [str(value) for value in values]
        return group.create_dataset(name, data=np.array(texts, object), dtype=h5py.string_dtype("utf-8"))
    if array.dtype == np.bool_:
        array = array.astype(np.uint8)  # netCDF has no truth values
    return group.create_dataset(
        name,
        data=array,
        chunks=_chunk_shape(array),
        maxshape=(None,) * array.ndim if array.size == 0 else array.shape,
        compression="gzip",
        compression_opts=_COMPRESSION_LEVEL,
        shuffle=True,
        fletcher32=True,
    )


def _chunk_shape(array: np.ndarray) -> tuple[int, ...]:
    width = max(int(np.prod(array.shape[1:])) * array.itemsize, 1)
    rows = min(max(_CHUNK_BYTES // width, 1), max(array.shape[0], 1))
    return (rows, *(max(length, 1) for length in array.shape[1:]))


def write_scale(group: Any, dimension: str, values: Any, unit: str) -> None:
    """Write the values along a dimension, and make them its scale."""
    scale = write_values(group, dimension, values)
    scale.attrs["units"] = unit
    scale.make_scale(dimension)


def write_quantity(
    group: Any, name: str, values: Any, dimensions: Sequence[str], unit: str, meaning: str
) -> Any:
    """Write one quantity; the scales of its dimensions must be in `group` already."""
    dataset = write_values(group, name, values)
    dataset.attrs["units"] = unit
    dataset.attrs["long_name"] = meaning
    for axis, dimension in enumerate(dimensions):
        dataset.dims[axis].attach_scale(group[dimension])
    return dataset


def mark_plottable(group: Any, signal: str, axes: Sequence[str]) -> None:
    """Make `group` an NXdata, so that a viewer knows what to draw; ``"."`` is an axis without values."""
    import h5py

    group.attrs["NX_class"] = "NXdata"
    group.attrs["signal"] = signal
    group.attrs.create("axes", list(axes), dtype=h5py.string_dtype("utf-8"))


def read_values(group: Any, name: str, path: str) -> Any:
    """Return a dataset of `group` as an array, or as a tuple of texts.

    Raises
    ------
    RunFileError
        If there is no such dataset, or it states more values than its bytes can hold.
    """
    import h5py

    within = isinstance(group, h5py.Group)  # "in" would read a dataset through, however long it says it is
    if not within or name not in group or not isinstance(group[name], h5py.Dataset):
        raise RunFileError(f"{path}: {group.name}/{name} is missing")
    dataset = group[name]
    if dataset.nbytes > _UNPACKED_SMALL + _MOST_PACKED * dataset.id.get_storage_size():
        raise RunFileError(f"{path}: {group.name}/{name} states {dataset.size} values, more than its bytes can hold")
    if h5py.check_string_dtype(dataset.dtype) is None:
        return dataset[()]
    texts = dataset.asstr()[()]
    return str(texts) if dataset.shape == () else tuple(str(text) for text in texts)

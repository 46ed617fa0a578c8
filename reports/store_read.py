"""Read a Run back from HDF5, and judge whether the file can be trusted."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from operator import index
from pathlib import Path
from typing import Any

import numpy as np

from iapb.errors import RunFileError
from iapb.run import ContactTable, EffectRow, ImpactTable, Run
from reports.store_datasets import read_values
from reports.store_keys import content_hash
from reports.store_layout import FORMAT, FORMAT_VERSION, GROUPS, JSON_TEXTS, TEXTS
from reports.store_seal import check_seal

_HEAD = ("title", "status", "run_key", "content_hash", "dt")


@contextmanager
def opened(path: Path | str, expected_format: str | None = FORMAT) -> Iterator[Any]:
    """Open a file of this project for reading; a format of None takes any.

    Raises
    ------
    RunFileError
        If the file is absent, is no HDF5 file, has another format, or fails in any way while it is read.
    """
    import h5py

    path = Path(path)
    if not path.is_file():
        raise RunFileError(f"{path}: {'a folder, not a file' if path.is_dir() else 'no such file'}")
    check_seal(path)
    try:
        with h5py.File(path, "r") as file:
            if expected_format is not None:
                _check_format(file, path, expected_format)
            yield file
    except RunFileError:
        raise
    except Exception as error:  # whole, but made by something else: can fail anywhere, with anything
        raise RunFileError(f"{path}: cannot be read as {expected_format or 'a file of iapb'}: {error}") from error


def _check_format(file: Any, path: Path, expected: str) -> None:
    found = file.attrs.get("format")
    if found != expected:
        raise RunFileError(f"{path}: format is {found!r}: expected {expected!r}")
    version = int(file.attrs.get("format_version", 0))
    if version > FORMAT_VERSION:
        raise RunFileError(f"{path}: format version is {version}, of a later iapb: this one reads {FORMAT_VERSION}")
    if version < FORMAT_VERSION:
        raise RunFileError(f"{path}: format version is {version}, of an earlier iapb: this one reads {FORMAT_VERSION}; "
                           "simulate the run again, it will be stored beside this file")


def read_run(path: Path | str) -> Run:
    """Return the run in a file, partial or complete.

    The seal is checked first and the content hash last, so a file that was changed is never taken for a run.

    Raises
    ------
    RunFileError
        If the file is absent, damaged or not a run.
    """
    with opened(path) as file:
        run = Run(**_texts(file, path), **_head(file), **_arrays(file, path))
        if content_hash(run) != file.attrs["content_hash"]:
            raise RunFileError(f"{path}: the results differ from their content hash, the file is damaged")
        return run


def read_provenance(path: Path | str) -> dict[str, str]:
    """Return where a run or a table comes from, as texts by name.

    Raises
    ------
    RunFileError
        If the file is damaged, or an entry is no text.
    """
    with opened(path, expected_format=None) as file:
        group = _group(file, "provenance", path)
        found = {name: read_values(group, name, str(path)) for name in group}
    for name, text in found.items():
        if not isinstance(text, str):
            raise RunFileError(f"{path}: provenance/{name} is no text")
    return found


def _group(file: Any, name: str, path: Path | str) -> Any:
    """Return a group; a dataset in its place could be gone through for ever."""
    import h5py

    if not isinstance(file.get(name), h5py.Group):
        raise RunFileError(f"{path}: the group {name} is missing")
    return file[name]


def read_head(path: Path | str) -> dict[str, Any]:
    """Return a run file's attributes: title, status, run_key, content_hash, dt. Reads no array.

    Raises
    ------
    RunFileError
        If the file is absent, damaged, no run, or lacks one of them.
    """
    with opened(path) as file:
        head = dict(file.attrs)
    absent = [name for name in _HEAD if name not in head]
    if absent:
        raise RunFileError(f"{path}: {', '.join(absent)} missing among its attributes")
    return head


def _texts(file: Any, path: Path | str) -> dict[str, Any]:
    texts = {}
    for group, name, attribute in TEXTS:
        text = read_values(file[group], name, str(path))
        texts[attribute] = json.loads(text) if attribute in JSON_TEXTS else text
    return texts


def _range(ends: Any) -> tuple[int, int]:
    start, stop = ends
    return index(start), index(stop)


def _head(file: Any) -> dict[str, Any]:
    ranges = {name: _range(file.attrs[name]) for name in ("tool_dofs", "tool_coordinates")}
    return {
        "dt": float(file.attrs["dt"]),
        "complete": file.attrs["status"] == "complete",
        "stopped": str(file.attrs.get("stopped", "")),
        **ranges,
    }


def _arrays(file: Any, path: Path | str) -> dict[str, Any]:
    place = str(path)
    group = {
        name: {quantity.name: _numbers(file[name], quantity.name, place) for quantity in quantities}
        for name, (quantities, _, _) in GROUPS.items()
    }
    for name, quantity in (("contacts", "is_new"), ("impacts", "solved")):  # truth values are stored as numbers
        group[name][quantity] = group[name][quantity].astype(np.bool_)
    return {
        "coordinate_names": read_values(file["mechanism"], "coordinate", place),
        "coordinate_units": read_values(file["mechanism"], "coordinate_unit", place),
        "velocity_names": read_values(file["mechanism"], "velocity", place),
        "velocity_units": read_values(file["mechanism"], "velocity_unit", place),
        "body_names": read_values(file["mechanism"], "body", place),
        "time": read_values(file["trajectory"], "time", place),
        "contacts": ContactTable(**group["contacts"]),
        "impacts": ImpactTable(**group["impacts"]),
        "energy": _energy(_group(file, "energy", place), place),
        "effects": _effects(file["effects"], place),
        **group["trajectory"],
        **group["steps"],
        **group["timings"],
    }


def _numbers(group: Any, name: str, path: str) -> np.ndarray:
    values = read_values(group, name, path)
    if not (isinstance(values, np.ndarray) and values.dtype.kind in "biuf" and values.ndim):
        raise RunFileError(f"{path}: {group.name}/{name} is no list of numbers")
    return values


def _energy(group: Any, path: str) -> dict[str, Any]:
    return {name: _numbers(group, name, path) for name in group if not group[name].is_scale}


def _effects(group: Any, path: str) -> tuple[EffectRow, ...]:
    names, active, reasons = (read_values(group, name, path) for name in ("effect", "active", "reason"))
    rows = zip(names, active, reasons, strict=True)
    return tuple(EffectRow(name, bool(on), reason) for name, on, reason in rows)

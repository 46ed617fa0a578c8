"""A Run as a file: write it, read it back, and check it for damage."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields
from operator import index
from pathlib import Path
from typing import Any

import numpy as np

from iapb.errors import RunFileError
from iapb.run import ContactTable, EffectRow, ImpactTable, Run, coordinates_of, energy_dimension, unit_of
from reports.provenance import collect_provenance
from reports.store.io import (
    dataset_of,
    extend,
    new_file,
    new_large_file,
    opened,
    read_values,
    write_quantity,
    write_scale,
    write_text,
)
from reports.store.keys import content_hash, plain
from reports.store.schema import (
    FORMAT,
    FORMAT_VERSION,
    GROUPS,
    JSON_TEXTS,
    SENTENCES,
    STATE_ATTRIBUTES,
    TEXTS,
)


@dataclass(frozen=True)
class RunEntry:
    """The description of a run in its file, without arrays; it is also a line of the index."""

    file: str  # name within the folder
    title: str  # scene and world
    run_key: str
    content_hash: str
    status: str


def write_run(
    path: Path | str,
    run: Run,
    *,
    key: str = "",
    provenance: Mapping[str, str] | None = None,
    replace: bool = False,
    more: Callable[[Any], None] | None = None,
) -> Path:
    """Write one run to a temporary file, sync it, and move it to `path` atomically.

    Parameters
    ----------
    path
        The file to write.
    key
        Run key (`reports.store.keys.run_key`), empty for a run outside of a store.
    provenance
        Texts by name; `collect_provenance()` by default.
    replace
        Whether a file at `path` is replaced. Otherwise an existing file is not changed.
    more
        Writes additional groups into the open file; readers of the run ignore them.
    """
    store_run(path, run, key=key, provenance=provenance, replace=replace, more=more)
    return Path(path)


def store_run(
    path: Path | str,
    run: Run,
    *,
    key: str,
    code: str = "",
    provenance: Mapping[str, str] | None = None,
    replace: bool = False,
    more: Callable[[Any], None] | None = None,
) -> RunEntry:
    """Write one run like `write_run`, with the label of its code; return the entry of the new file."""
    path = Path(path)
    with new_file(path, replace=replace) as file:
        _write_run(file, run, key, code, provenance)
        file.attrs["content_hash"] = content_hash(run)
        if more is not None:
            more(file)
        return _entry(file, path)


def store_parts(
    path: Path | str, parts: Iterator[Run], *, stopped: str = "", key: str, code: str = "", replace: bool = False
) -> RunEntry:
    """Write a run that is given in consecutive parts, in constant memory; the content hash is that of the whole run.

    `stopped` is the reason why the run is incomplete, or "".
    """
    path = Path(path)
    with new_large_file(path, replace=replace) as file:
        distrust: tuple[str, ...] = ()
        for number, part in enumerate(parts):
            distrust = distrust or part.distrust
            if number == 0:
                _write_run(file, part, key, code, None, growing=True)
            else:
                _append(file, part)
        file.attrs.update({"status": "partial" if stopped else "complete", "stopped": stopped,
                           "distrust": json.dumps(distrust, ensure_ascii=False)})  # fmt: skip
        file.attrs["content_hash"] = content_hash(_run_in(file, path))
        return _entry(file, path)


def _write_run(file: Any, run: Run, key: str, code: str, provenance: Mapping[str, str] | None, *,
               growing: bool = False) -> None:  # fmt: skip
    _write_head(file, run, key, code)
    for group, name, attribute in TEXTS:
        value = getattr(run, attribute)
        write_text(file.require_group(group), name, _json(value) if attribute in JSON_TEXTS else value)
    _write_names(file, run)
    for group in GROUPS:
        _write_group(file.create_group(group), group, run, growing)
    _write_energy(file.create_group("energy", track_order=True), run, growing)
    _write_effects(file.create_group("effects"), run)
    file.create_group("provenance", track_order=True)
    for name, text in (collect_provenance() if provenance is None else provenance).items():
        write_text(file["provenance"], name, text)


def _append(file: Any, part: Run) -> None:
    """Append a part; its first state equals the last one in the file."""
    for name, (quantities, record_of) in GROUPS.items():
        group = file[name]
        for quantity in quantities:
            values = getattr(record_of(part), quantity.name)
            if quantity.dimensions[0] == "step_edge":
                values = values + group[quantity.name][-1]
            extend(group[quantity.name], values[int(quantity.dimensions[0] in ("time", "step_edge")):])
        _lengthen_scales(group, {each.dimensions[0]: each.name for each in quantities}, part)
    energy = file["energy"]
    dimensions = {energy_dimension(part, name): name for name in part.energy}
    for name, values in part.energy.items():
        extend(energy[name], values[int(energy_dimension(part, name) == "time"):])
    _lengthen_scales(energy, dimensions, part)


def _lengthen_scales(group: Any, dimensions: Mapping[str, str], part: Run) -> None:
    """Extend the dimension scales of growing dimensions to the length of their quantities."""
    for dimension, name in dimensions.items():
        scale, length = group[dimension], len(group[name])
        extend(scale, part.time[1:] if dimension == "time" else np.arange(len(scale), length))


def _json(value: Any) -> str:
    return json.dumps(plain(value), ensure_ascii=False, indent=1)


def _write_head(file: Any, run: Run, key: str, code: str) -> None:
    file.attrs["format"] = FORMAT
    file.attrs["format_version"] = FORMAT_VERSION
    file.attrs["title"] = f"{run.scene_name} · {run.world}"
    file.attrs["status"] = "complete" if run.complete else "partial"
    file.attrs["stopped"] = run.stopped
    for name in SENTENCES:
        file.attrs[name] = json.dumps(getattr(run, name), ensure_ascii=False)
    file.attrs["run_key"] = key
    file.attrs["code"] = code
    file.attrs["dt"] = float(run.dt)
    file.attrs["tool_dofs"] = run.tool_dofs
    file.attrs["tool_coordinates"] = run.tool_coordinates


def _write_names(file: Any, run: Run) -> None:
    group = file.create_group("mechanism")
    write_scale(group, "coordinate", run.coordinate_names, "1")
    write_quantity(group, "coordinate_unit", run.coordinate_units, ("coordinate",), "1", "unit of each coordinate")
    write_scale(group, "velocity", run.velocity_names, "1")
    write_quantity(group, "velocity_unit", run.velocity_units, ("velocity",), "1", "unit of each velocity")
    write_scale(group, "body", run.body_names, "1")


def _write_group(group: Any, name: str, run: Run, growing: bool = False) -> None:
    quantities, record_of = GROUPS[name]
    record = record_of(run)
    for quantity in quantities:
        values = getattr(record, quantity.name)
        for dimension, length in zip(quantity.dimensions, values.shape, strict=True):
            if dimension not in group:
                write_scale(group, dimension, *coordinates_of(run, dimension, length), growing=growing)
        dataset = write_quantity(
            group, quantity.name, values, quantity.dimensions, unit_of(quantity, run), quantity.meaning, growing=growing
        )
        if quantity.name == "state":
            dataset.attrs.update(STATE_ATTRIBUTES)


def _write_energy(group: Any, run: Run, growing: bool = False) -> None:
    for name, values in run.energy.items():
        dimension = energy_dimension(run, name)
        if dimension not in group:
            write_scale(group, dimension, *coordinates_of(run, dimension, len(values)), growing=growing)
        write_quantity(group, name, values, (dimension,), "J", name.replace("_", " "), growing=growing)


def _write_effects(group: Any, run: Run) -> None:
    write_scale(group, "effect", tuple(effect.name for effect in run.effects), "1")
    active = [int(effect.active) for effect in run.effects]
    reasons = tuple(effect.reason for effect in run.effects)
    write_quantity(group, "active", np.array(active, np.int8), ("effect",), "1", "1 where the effect was on")
    write_quantity(group, "reason", reasons, ("effect",), "1", "why")
    ignores = tuple(effect.ignores for effect in run.effects)
    write_quantity(group, "ignores", ignores, ("effect",), "1", "field of the scene that the law ignored, or empty")


def read_run(path: Path | str) -> Run:
    """Return the run in a file, partial or complete.

    The seal is checked first and the content hash last, so a changed file is never accepted as a run.

    Raises
    ------
    RunFileError
        The file is absent, damaged or not a run.
    """
    return read_stored(path)[0]


def read_stored(path: Path | str) -> tuple[Run, RunEntry]:
    """Return the run in a file and the entry of the file; it raises the errors of `read_run`."""
    with opened(path) as file:
        entry = _entry(file, path)
        return _judged(Run(**_texts(file, path), **_head(file), **_arrays(file, path, read_values)), entry, path), entry


def _judged(run: Run, entry: RunEntry, path: Path | str) -> Run:
    if content_hash(run) != entry.content_hash:
        raise RunFileError(f"{path}: the results differ from their content hash, the file is damaged")
    return run


@contextmanager
def opened_run(path: Path | str) -> Iterator[tuple[Run, RunEntry]]:
    """Yield a run whose arrays stay in its file, to be read in `blocks`, and the entry of the file.

    The file is checked like in `read_stored`, but in constant memory.
    """
    with opened(path) as file:
        run, entry = _run_in(file, path), _entry(file, path)
        yield _judged(run, entry, path), entry


def _run_in(file: Any, path: Path | str) -> Run:
    return Run(**_texts(file, path), **_head(file), **_arrays(file, path, dataset_of))


def read_provenance(path: Path | str) -> dict[str, str]:
    """Return the provenance of a run or a table, as texts by name.

    Raises
    ------
    RunFileError
        The file is damaged, or an entry is not a text.
    """
    with opened(path, expected_format=None) as file:
        group = _group(file, "provenance", path)
        found = {name: read_values(group, name, str(path)) for name in group}
    for name, text in found.items():
        if not isinstance(text, str):
            raise RunFileError(f"{path}: provenance/{name} is no text")
    return found


def _group(file: Any, name: str, path: Path | str) -> Any:
    """Return a group; raise RunFileError for a dataset in its place, because iterating over it might never end."""
    import h5py

    if not isinstance(file.get(name), h5py.Group):
        raise RunFileError(f"{path}: the group {name} is missing")
    return file[name]


def read_entry(path: Path | str) -> RunEntry:
    """Return the entry of a run file, without reading an array.

    Raises
    ------
    RunFileError
        The file is absent, damaged or not a run, or its entry is incomplete.
    """
    with opened(path) as file:
        return _entry(file, path)


def _entry(file: Any, path: Path | str) -> RunEntry:
    names = [field.name for field in fields(RunEntry) if field.name != "file"]
    absent = [name for name in names if name not in file.attrs]
    if absent:
        raise RunFileError(f"{path}: {', '.join(absent)} missing among its attributes")
    return RunEntry(Path(path).name, *(str(file.attrs[name]) for name in names))


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
        **{name: tuple(map(str, json.loads(file.attrs.get(name, "[]")))) for name in SENTENCES},
        **ranges,
    }


def _arrays(file: Any, path: Path | str, read: Callable[[Any, str, str], Any]) -> dict[str, Any]:
    """Return the names and arrays of a run; `read` is `read_values` (arrays in memory) or `dataset_of` (on disk)."""
    place = str(path)
    group = {
        name: {quantity.name: _numbers(read, file[name], quantity.name, place) for quantity in quantities}
        for name, (quantities, _) in GROUPS.items()
    }
    for name, quantity in (("contacts", "is_new"), ("impacts", "solved")):  # truth values are stored as numbers
        group[name][quantity] = _Truths(group[name][quantity])
        if read is read_values:
            group[name][quantity] = group[name][quantity][:]
    return {
        "coordinate_names": read_values(file["mechanism"], "coordinate", place),
        "coordinate_units": read_values(file["mechanism"], "coordinate_unit", place),
        "velocity_names": read_values(file["mechanism"], "velocity", place),
        "velocity_units": read_values(file["mechanism"], "velocity_unit", place),
        "body_names": read_values(file["mechanism"], "body", place),
        "time": _numbers(read, file["trajectory"], "time", place),
        "contacts": ContactTable(**group["contacts"]),
        "impacts": ImpactTable(**group["impacts"]),
        "energy": _energy(read, _group(file, "energy", place), place),
        "effects": _effects(file["effects"], place),
        **group["trajectory"],
        **group["steps"],
        **group["timings"],
    }


class _Truths:
    """An array of booleans that are stored as numbers 0 and 1, in a file or in memory."""

    dtype = np.dtype(np.bool_)

    def __init__(self, numbers: Any) -> None:
        self._numbers, self.shape = numbers, numbers.shape

    def __len__(self) -> int:
        return len(self._numbers)

    def __getitem__(self, rows: Any) -> np.ndarray:
        return np.asarray(self._numbers[rows]).astype(np.bool_)


def _numbers(read: Callable[[Any, str, str], Any], group: Any, name: str, path: str) -> Any:
    values = read(group, name, path)
    if not (hasattr(values, "dtype") and values.dtype.kind in "biuf" and values.ndim):
        raise RunFileError(f"{path}: {group.name}/{name} is no list of numbers")
    return values


def _energy(read: Callable[[Any, str, str], Any], group: Any, path: str) -> dict[str, Any]:
    return {name: _numbers(read, group, name, path) for name in group if not group[name].is_scale}


def _effects(group: Any, path: str) -> tuple[EffectRow, ...]:
    names, active, reasons = (read_values(group, name, path) for name in ("effect", "active", "reason"))
    ignores = read_values(group, "ignores", path) if "ignores" in group else ("",) * len(names)  # not in old files
    rows = zip(names, active, reasons, ignores, strict=True)
    return tuple(EffectRow(name, bool(on), reason, ignored) for name, on, reason, ignored in rows)

"""A Run as a file: written, read back, and judged whether it can be trusted."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from operator import index
from pathlib import Path
from typing import Any

import numpy as np

from iapb.errors import RunFileError
from iapb.run import ContactTable, EffectRow, ImpactTable, Run, coordinates_of, energy_dimension, unit_of
from reports.provenance import collect_provenance
from reports.store.io import (
    mark_plottable,
    new_file,
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
    """What a run file says of itself, without its arrays: a line of the index."""

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
    """Write one run: aside first, synced, then moved to `path` in one step.

    Parameters
    ----------
    path
        The file to make.
    key
        Run key (`reports.store.keys.run_key`), empty for a run that belongs to no store.
    provenance
        Texts by name; `collect_provenance()` by default.
    replace
        Whether a file at `path` is replaced. Otherwise an existing file stays as it is.
    more
        Writes groups of its own into the open file; who reads the run passes over them.
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
    """Write one run as `write_run` does, with the label of its code; return what the new file says of itself."""
    path = Path(path)
    with new_file(path, replace=replace) as file:
        _write_head(file, run, key, code)
        for group, name, attribute in TEXTS:
            value = getattr(run, attribute)
            write_text(file.require_group(group), name, _json(value) if attribute in JSON_TEXTS else value)
        _write_names(file, run)
        for group in GROUPS:
            _write_group(file.create_group(group), group, run)
        _write_energy(file.create_group("energy", track_order=True), run)
        _write_effects(file.create_group("effects"), run)
        file.create_group("provenance", track_order=True)
        for name, text in (collect_provenance() if provenance is None else provenance).items():
            write_text(file["provenance"], name, text)
        if more is not None:
            more(file)
        return _entry(file, path)


def _json(value: Any) -> str:
    return json.dumps(plain(value), ensure_ascii=False, indent=1)


def _write_head(file: Any, run: Run, key: str, code: str) -> None:
    file.attrs["NX_class"] = "NXroot"
    file.attrs["default"] = "trajectory"
    file.attrs["format"] = FORMAT
    file.attrs["format_version"] = FORMAT_VERSION
    file.attrs["title"] = f"{run.scene_name} · {run.world}"
    file.attrs["status"] = "complete" if run.complete else "partial"
    file.attrs["stopped"] = run.stopped
    for name in SENTENCES:
        file.attrs[name] = json.dumps(getattr(run, name), ensure_ascii=False)
    file.attrs["run_key"] = key
    file.attrs["code"] = code
    file.attrs["content_hash"] = content_hash(run)
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


def _write_group(group: Any, name: str, run: Run) -> None:
    quantities, record_of, signal = GROUPS[name]
    record = record_of(run)
    for quantity in quantities:
        values = getattr(record, quantity.name)
        for dimension, length in zip(quantity.dimensions, values.shape, strict=True):
            if dimension not in group:
                write_scale(group, dimension, *coordinates_of(run, dimension, length))
        dataset = write_quantity(
            group, quantity.name, values, quantity.dimensions, unit_of(quantity, run), quantity.meaning
        )
        if quantity.name == "state":
            dataset.attrs.update(STATE_ATTRIBUTES)
        if quantity.name == signal:
            mark_plottable(group, signal, [quantity.dimensions[0], *["."] * (len(quantity.dimensions) - 1)])


def _write_energy(group: Any, run: Run) -> None:
    for name, values in run.energy.items():
        dimension = energy_dimension(run, name)
        if dimension not in group:
            write_scale(group, dimension, *coordinates_of(run, dimension, len(values)))
        write_quantity(group, name, values, (dimension,), "J", name.replace("_", " "))
    if run.energy:
        first = next(iter(run.energy))
        mark_plottable(group, first, [energy_dimension(run, first)])


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

    The seal is checked first and the content hash last, so a file that was changed is never taken for a run.

    Raises
    ------
    RunFileError
        If the file is absent, damaged or not a run.
    """
    return read_stored(path)[0]


def read_stored(path: Path | str) -> tuple[Run, RunEntry]:
    """Return the run in a file and what the file says of itself; raises as `read_run`."""
    with opened(path) as file:
        entry = _entry(file, path)
        run = Run(**_texts(file, path), **_head(file), **_arrays(file, path))
        if content_hash(run) != entry.content_hash:
            raise RunFileError(f"{path}: the results differ from their content hash, the file is damaged")
        return run, entry


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


def read_entry(path: Path | str) -> RunEntry:
    """Return what a run file says of itself. Reads no array.

    Raises
    ------
    RunFileError
        If the file is absent, damaged, no run, or does not say it.
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
    ignores = read_values(group, "ignores", path) if "ignores" in group else ("",) * len(names)  # files of before
    rows = zip(names, active, reasons, ignores, strict=True)
    return tuple(EffectRow(name, bool(on), reason, ignored) for name, on, reason, ignored in rows)

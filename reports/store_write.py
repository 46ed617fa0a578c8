"""Write a Run to HDF5."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from iapb.run import Run
from reports.provenance import collect_provenance
from reports.store_datasets import mark_plottable, new_file, write_quantity, write_scale, write_text
from reports.store_keys import content_hash, plain
from reports.store_layout import (
    FORMAT,
    FORMAT_VERSION,
    GROUPS,
    JSON_TEXTS,
    STATE_ATTRIBUTES,
    TEXTS,
    coordinates_of,
    energy_dimension,
    unit_of,
)


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
        Run key (`reports.store_keys.run_key`), empty for a run that belongs to no store.
    provenance
        Texts by name; `collect_provenance()` by default.
    replace
        Whether a file at `path` is replaced. Otherwise an existing file stays as it is.
    more
        Writes groups of its own into the open file; who reads the run passes over them.
    """
    path = Path(path)
    with new_file(path, replace=replace) as file:
        _write_head(file, run, key)
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
    return path


def _json(value: Any) -> str:
    return json.dumps(plain(value), ensure_ascii=False, indent=1)


def _write_head(file: Any, run: Run, key: str) -> None:
    file.attrs["NX_class"] = "NXroot"
    file.attrs["default"] = "trajectory"
    file.attrs["format"] = FORMAT
    file.attrs["format_version"] = FORMAT_VERSION
    file.attrs["title"] = f"{run.scene_name} · {run.world}"
    file.attrs["status"] = "complete" if run.complete else "partial"
    file.attrs["stopped"] = run.stopped
    file.attrs["run_key"] = key
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

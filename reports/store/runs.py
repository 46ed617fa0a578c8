"""A Run as a file: write it, read it back, and check it for damage."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from operator import index
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from iapb.errors import RunFileError
from iapb.numerics.schema import Quantity
from iapb.run import (
    ContactTable,
    EffectRow,
    ImpactTable,
    Run,
    coordinates_of,
    energy_dimension,
    unit_of,
)
from reference.hdf5 import Budget, attribute_of, dataset_at, group_at, values_at
from reports.provenance import collect_provenance
from reports.store import io, schema
from reports.store.keys import content_hash, plain

Reader = Callable[[Any, str, Budget], Any]  # (group, name, budget): `values_at` or `dataset_at`
TIME = Quantity("time", ("time",), np.float64, "s", "")


class RunEntry(NamedTuple):
    """The description of a run in its file, without arrays."""

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
    """
    store_run(path, run, key=key, provenance=provenance, replace=replace)
    return Path(path)


def store_run(
    path: Path | str,
    run: Run,
    *,
    key: str,
    replace: bool = False,
    provenance: Mapping[str, str] | None = None,
) -> RunEntry:
    """Write one run like `write_run`; return the entry of the new file."""
    path = Path(path)
    with io.new_file(path, replace=replace) as file:
        _write_run(file, run, key, provenance)
        file.attrs["content_hash"] = content_hash(run)
        return _entry(file, path)


def _columns(run: Run) -> Iterator[tuple[str, Quantity, Any]]:
    """Yield group, declaration and values of every array of a run."""
    for group, (listed, record_of) in schema.GROUPS.items():
        yield from (
            (group, quantity, getattr(record_of(run), quantity.name)) for quantity in listed
        )
    for name, values in run.energy.items():
        meaning = name.replace("_", " ")
        yield (
            "energy",
            Quantity(name, (energy_dimension(run, name),), np.float64, "J", meaning),
            values,
        )


def _write_run(file: Any, run: Run, key: str, provenance: Mapping[str, str] | None) -> None:
    file.attrs.update(
        {
            "format": schema.FORMAT,
            "format_version": schema.FORMAT_VERSION,
            "title": f"{run.scene_name} · {run.world}",
            "status": "complete" if run.complete else "partial",
            "stopped": run.stopped,
            "run_key": key,
            "dt": float(run.dt),
            "energies": json.dumps([*run.energy]),
            "every": run.every,
            "tool_dofs": run.tool_dofs,
            "tool_coordinates": run.tool_coordinates,
            **{
                name: json.dumps(getattr(run, name), ensure_ascii=False)
                for name in schema.SENTENCES
            },
        }
    )
    for group, name, attribute in schema.TEXTS:
        value = getattr(run, attribute)
        if attribute in schema.JSON_TEXTS:
            value = json.dumps(plain(value), ensure_ascii=False, indent=1)
        io.write_text(file.require_group(group), name, value)
    names = file.create_group("mechanism")
    for dimension in ("coordinate", "velocity", "body"):
        scale = io.write_scale(names, dimension, getattr(run, f"{dimension}_names"), "1")
        if dimension != "body":
            units = getattr(run, f"{dimension}_units")
            io.write_quantity(
                names, f"{dimension}_unit", units, [scale], "1", f"unit of each {dimension}"
            )
    for name in (*schema.GROUPS, "energy", "effects", "provenance"):
        file.create_group(name, track_order=name in ("energy", "provenance"))
    # a look-up takes 0.1 ms
    groups = {name: file[name] for name in file}
    scales = dict[tuple[str, str], Any]()
    for group, quantity, values in _columns(run):
        for dimension, length in zip(quantity.dimensions, values.shape, strict=True):
            if (group, dimension) not in scales:
                scales[group, dimension] = io.write_scale(
                    groups[group], dimension, *coordinates_of(run, dimension, length)
                )
        along = [scales[group, name] for name in quantity.dimensions]
        dataset = io.write_quantity(
            groups[group], quantity.name, values, along, unit_of(quantity, run), quantity.meaning
        )
        if quantity.name == "state":
            dataset.attrs.update(schema.STATE_ATTRIBUTES)
    effects = file["effects"]
    scale = io.write_scale(effects, "effect", tuple(effect.name for effect in run.effects), "1")
    active = np.array([effect.active for effect in run.effects], np.int8)
    io.write_quantity(effects, "active", active, [scale], "1", "1 where the effect was on")
    for name, meaning in (
        ("reason", "why"),
        ("ignores", "field of the scene that the law ignored, or empty"),
    ):
        texts = tuple(getattr(effect, name) for effect in run.effects)
        io.write_quantity(effects, name, texts, [scale], "1", meaning)
    for name, text in (collect_provenance() if provenance is None else provenance).items():
        io.write_text(file["provenance"], name, text)


def read_run(path: Path | str, budget: int | None = None) -> Run:
    """Return the run in a file, partial or complete; a changed file is never accepted as a run.

    budget : bytes that its values may fill, by default `reference.hdf5.READ_BUDGET` or 64 times the
        file's size.

    Raises
    ------
    RunFileError
        The file is absent, damaged or not a run.
    """
    return read_stored(path, budget)[0]


def read_stored(path: Path | str, budget: int | None = None) -> tuple[Run, RunEntry]:
    """Return the run in a file and the entry of the file; it raises the errors of `read_run`."""
    with opened_run(path, values_at, budget) as found:
        return found


@contextmanager
def opened_run(
    path: Path | str,
    read: Reader = dataset_at,
    budget: int | None = None,
    changed: bool = False,
) -> Iterator[tuple[Run, RunEntry]]:
    """Yield a run whose arrays stay in its file, to be read in `blocks`, and the entry of the file.

    The file is checked completely, in constant memory. `changed`: see `io.opened`.
    """
    with io.opened(path, changed=changed) as file:
        run = _run_in(file, path, read, budget)
        entry = _entry(file, path)
        _check(run)
        if content_hash(run) != entry.content_hash:
            raise RunFileError(
                f"{path}: the results differ from their content hash, the file is damaged"
            )
        yield run, entry


def read_provenance(path: Path | str) -> dict[str, str]:
    """Return the provenance of a run or a table, as texts by name.

    Raises
    ------
    RunFileError
        The file is damaged, or an entry is not a text.
    """
    with io.opened(path, expected_format=None) as file:
        group = group_at(file, "provenance")
        budget = Budget(path, file)
        found = {name: values_at(group, name, budget) for name in group}
    for name, text in found.items():
        if not isinstance(text, str):
            raise RunFileError(f"{path}: provenance/{name} is no text")
    return found


def read_entry(path: Path | str) -> RunEntry:
    """Return the entry of a run file, without reading an array.

    Raises
    ------
    RunFileError
        The file is absent, damaged or not a run, or its entry is incomplete.
    """
    with io.opened(path) as file:
        return _entry(file, path)


def _entry(file: Any, path: Path | str) -> RunEntry:
    names = RunEntry._fields[1:]
    values = [attribute_of(file, name) for name in names]
    if absent := [name for name, value in zip(names, values, strict=True) if value is None]:
        raise RunFileError(f"{path}: {', '.join(absent)} missing among its attributes")
    return RunEntry(Path(path).name, *map(str, values))


def _check(run: Run) -> None:
    """Raise ValueError if two lengths contradict each other, if tables point out of a run, or a
    name has two lines."""
    lengths = {
        "time": run.steps + 1,
        "step_edge": run.steps + 1,
        "step": run.steps,
        "body": len(run.body_names),
        "coordinate": len(run.coordinate_names),
        "velocity": len(run.velocity_names),
    }
    for group, quantity, values in _columns(run):
        for dimension, length in zip(quantity.dimensions, values.shape, strict=True):
            absent = dimension == "step" and length == 0  # of another engine
            if lengths.setdefault(dimension, length) != length and not absent:
                raise ValueError(
                    f"{group}/{quantity.name} has {length} along {dimension}, not {lengths[dimension]}"
                )
    for name, values, most in (
        ("contacts/offsets", run.contacts.offsets, lengths["contact"]),
        ("impacts/step", run.impacts.step, run.steps - 1),
    ):
        last = 0
        for block in io.blocks(values):
            line = np.concatenate(([last], block, [most]))
            if (wrong := np.flatnonzero(np.diff(line) < 0)).size:
                raise ValueError(
                    f"{name} holds {line[wrong[0] + 1]} after {line[wrong[0]]}: expected numbers "
                    f"that "
                    f"never fall, up to {most}"
                )
            last = line[-2]
    texts = [
        getattr(run, attribute)
        for _, name, attribute in schema.TEXTS
        if name in ("name", "world", "kernel")
    ]
    texts += [
        run.stopped,
        *run.coordinate_names,
        *run.velocity_names,
        *run.body_names,
        *run.remarks,
        *run.distrust,
    ]
    for text in (
        *texts,
        *(part for row in run.effects for part in (row.name, row.reason, row.ignores)),
    ):
        if len(str(text).splitlines()) > 1:
            raise ValueError(f"the name {text!r} has more than one line")


def _run_in(file: Any, path: Path | str, read: Reader, budget: int | None = None) -> Run:
    """Return the run in an open file; `read` is `values_at` (arrays in memory) or `dataset_at`
    (on disk)."""
    place = Budget(path, file, budget)
    texts = {
        attribute: values_at(file, f"{group}/{name}", place)
        for group, name, attribute in schema.TEXTS
    }
    tables = {
        group: {quantity.name: _numbers(read, file, group, quantity, place) for quantity in listed}
        for group, (listed, _) in schema.GROUPS.items()
    }
    lists = [
        values_at(file, f"effects/{name}", place)
        for name in ("effect", "active", "reason", "ignores")
    ]
    energies = json.loads(attribute_of(file, "energies", "[]"))
    parts: dict[str, Any] = texts | {
        attribute: json.loads(texts[attribute]) for attribute in schema.JSON_TEXTS
    }
    parts |= {
        name: tuple(map(str, json.loads(attribute_of(file, name, "[]"))))
        for name in schema.SENTENCES
    }
    for name in ("tool_dofs", "tool_coordinates"):
        start, stop = attribute_of(file, name)
        parts[name] = index(start), index(stop)
    for name in ("coordinate", "velocity"):
        parts[f"{name}_names"] = values_at(file, f"mechanism/{name}", place)
        parts[f"{name}_units"] = values_at(file, f"mechanism/{name}_unit", place)
    return Run(
        **parts,
        body_names=values_at(file, "mechanism/body", place),
        **tables["trajectory"],
        **tables["steps"],
        **tables["timings"],
        dt=float(attribute_of(file, "dt")),
        every=index(attribute_of(file, "every")),
        complete=attribute_of(file, "status") == "complete",
        stopped=str(attribute_of(file, "stopped", "")),
        time=_numbers(read, file, "trajectory", TIME, place),
        contacts=ContactTable(**tables["contacts"]),
        impacts=ImpactTable(**tables["impacts"]),
        energy={
            name: _numbers(read, file, "energy", TIME._replace(name=name), place)
            for name in energies
        },
        effects=tuple(
            EffectRow(name, bool(on), reason, ignored)
            for name, on, reason, ignored in zip(*lists, strict=True)
        ),
    )


def _numbers(read: Reader, file: Any, group: str, quantity: Quantity, budget: Budget) -> Any:
    values = read(file, f"{group}/{quantity.name}", budget)
    if not (hasattr(values, "dtype") and values.dtype.kind in "biuf" and values.ndim):
        raise RunFileError(f"{budget}: {group}/{quantity.name} is no list of numbers")
    return values.astype(np.bool_) if quantity.dtype is np.bool_ else values

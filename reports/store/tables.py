"""Tables of results, and records of evidence, as HDF5 files.

    write_table("summary.h5", "small", titled(("point", "energy_lost [J]"), rows))

opens as ``xarray.open_dataset(path, engine="h5netcdf", group="small")``; the first column is the coordinate of the
rows.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from iapb.errors import RunFileError
from iapb.names import one_of
from reference.hdf5 import Budget, attribute_of, dataset_at, group_at, values_at
from reports.provenance import collect_provenance
from reports.store import io
from reports.store.keys import hash_of, plain
from reports.store.schema import FORMAT_VERSION, TABLE_FORMAT
from verification.table import Column, Table

RECORDS = "records"


def write_table(path: Path | str, name: str, table: Table, *, title: str = "", command: str = "") -> Path:
    """Write a table to its own file atomically, replacing an older file; `command` makes the table again.

    A column of numbers and None becomes an array with NaN, any other one texts.
    """
    path = Path(path)
    with io.new_file(path, replace=True) as file:
        write_head(file, collect_provenance())
        group = file.create_group(name, track_order=True)
        group.attrs.update({"title": title, "command": command})
        scales: list[Any] = []  # of the first column, along the rows
        for column in table.columns:
            values, unit = _stored(table.column(column.key)), column.unit or "1"
            if scales:
                io.write_quantity(group, column.key, values, scales, unit, column.title)
            else:
                scales = [io.write_scale(group, column.key, values, unit)]
                scales[0].attrs["long_name"] = column.title
        file.attrs["content_hash"] = hash_of([name, table.titles, table.rows])
    return path


def _stored(values: Sequence[Any]) -> Any:
    if all(value is None or (isinstance(value, int | float) and not isinstance(value, bool)) for value in values):
        return np.array(values, float if None in values else None)
    return tuple(map(str, values))


def write_head(file: Any, provenance: Mapping[str, str]) -> None:
    """Write what every file of tables begins with."""
    file.attrs.update({"format": TABLE_FORMAT, "format_version": FORMAT_VERSION})
    for name, text in provenance.items():
        io.write_text(file.require_group("provenance"), name, text)


def read_columns(path: Path | str, name: str | None = None) -> dict[str, tuple[str, Any]]:
    """Return unit and values of each column of the table `name` of a file, or of its first one, by the column's name.

    Raises
    ------
    RunFileError
        The file is absent, damaged or not a file of tables, or it has no such table.
    """
    with io.opened(path, TABLE_FORMAT) as file:
        tables = [each for each in file if each != "provenance"]
        if not tables or name not in (None, *tables):
            raise RunFileError(f"{path}: no table {name!r}: expected {one_of(str(name), tables)}")
        group, budget, found = group_at(file, name or tables[0]), Budget(path, file), dict[str, tuple[str, Any]]()
        for key in group:
            unit = str(attribute_of(dataset_at(group, key, budget), "units", "1"))
            found[key] = unit, values_at(group, key, budget)
        if len({len(values) for _, values in found.values()}) > 1:
            raise RunFileError(f"{path}: the columns of the table {group.name} have different lengths")
        return found


def read_table(path: Path | str, name: str | None = None) -> Table:
    """Return the table `name` of a file, or its first one; it raises the errors of `read_columns`."""
    found = read_columns(path, name)
    columns = tuple(Column(key, "" if unit == "1" else unit) for key, (unit, _) in found.items())
    lists = [values.tolist() if hasattr(values, "tolist") else values for _, values in found.values()]
    return Table(columns, tuple(zip(*lists, strict=True)))


def write_record(
    path: Path, value: Any, title: str, *, runs: Sequence[str] = (), command: str = "",
    provenance: Mapping[str, str] | None = None,
) -> Path:
    """Write any records as one text of JSON; see `plain` for the types, `runs` are the files behind the records."""
    with io.new_file(path, replace=True) as file:
        write_head(file, collect_provenance() if provenance is None else provenance)
        group = file.create_group(RECORDS)
        group.attrs.update({"title": title, "command": command, "runs": "\n".join(runs)})
        text = json.dumps(plain(value), ensure_ascii=False)
        io.write_text(group, "json", text)
        file.attrs["content_hash"] = hash_of(text)
    return path


def read_record(path: Path) -> Any:
    """Return the records in a file as lists and mappings; it raises the errors of `read_columns`."""
    with io.opened(path, TABLE_FORMAT) as file:
        return json.loads(values_at(file, f"{RECORDS}/json", Budget(path, file)))

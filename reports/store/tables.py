"""Tables behind figures and claims, as HDF5: named columns with units and descriptions.

    write_table("out/tables/fig03.h5", Table("fig03", (Column("restitution", e, "1", "…"), Column("energy", …))))

opens as ``xarray.open_dataset(path, engine="h5netcdf", group="fig03")``; the first column is the coordinate of the
rows unless it repeats values.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from iapb.errors import ArgumentError, RunFileError
from iapb.names import one_of
from reports.provenance import collect_provenance
from reports.store.io import (
    extend,
    new_file,
    opened,
    read_values,
    write_quantity,
    write_scale,
    write_text,
)
from reports.store.keys import add_array, plain
from reports.store.schema import FORMAT_VERSION, TABLE_FORMAT

ROW = "row"
RECORDS = "records"  # name of the table of one text


@dataclass(frozen=True)
class Column:
    """One column: an array of numbers or booleans, or a tuple of texts; all columns of a table have the same length.

    `unit` is in SI, ``"1"`` for a pure number or a text.
    """

    name: str
    values: Any  # (rows,)
    unit: str
    description: str


@dataclass(frozen=True)
class Table:
    """Named columns of equal length.

    `runs` are the names of the run files behind the numbers, `command` is the command that reproduces the table.
    """

    name: str
    columns: tuple[Column, ...]
    title: str = ""
    runs: tuple[str, ...] = ()
    command: str = ""

    def __getitem__(self, name: str) -> Any:
        """Return the values of a column."""
        for column in self.columns:
            if column.name == name:
                return column.values
        raise ArgumentError("column", name, one_of(name, [column.name for column in self.columns], "one of: "))


def write_table(path: Path | str, table: Table, provenance: Mapping[str, str] | None = None) -> Path:
    """Write one table to its own file, replacing an older file. See `write_tables`."""
    return write_tables(path, (table,), provenance)


def write_tables(path: Path | str, tables: Sequence[Table], provenance: Mapping[str, str] | None = None) -> Path:
    """Write tables to one file atomically, each to its own group.

    Raises
    ------
    ArgumentError
        The columns of a table differ in length, or two tables or two columns have the same name.
    """
    path = Path(path)
    if not _are_names([table.name for table in tables]):
        raise ArgumentError("tables", [table.name for table in tables], "different names without '/'")
    for table in tables:
        names, lengths = [column.name for column in table.columns], [len(column.values) for column in table.columns]
        if not _are_names(names) or len(set(lengths)) > 1 or ROW in names:
            raise ArgumentError(f"columns of {table.name}", dict(zip(names, lengths, strict=True)),
                                f"columns of one length, with different names without '/', none named {ROW!r}")
    with new_file(path, replace=True) as file:
        for table in tables:
            _write(file.create_group(table.name, track_order=True), table)
        _write_head(file, tables, provenance)
    return path


@contextmanager
def growing_table(path: Path, others: Sequence[Table]) -> Iterator[Callable[[Table], None]]:
    """Yield a function that appends a part of a numeric table; afterwards the tables `others` are written.

    All parts have the same name and the same columns; the first column increases. The result is the file that
    `write_tables` would write, but made in constant memory.
    """
    with new_file(path, replace=True, large=True) as file:
        parts: list[Table] = []

        def append(part: Table) -> None:
            if not parts:
                _write(file.create_group(part.name, track_order=True), part, growing=True)
                parts.append(part)
                return
            for column in part.columns:
                extend(file[part.name][column.name], _hashable(column.values))

        yield append
        for table in others:
            _write(file.create_group(table.name, track_order=True), table)
        stored = [replace(part, columns=tuple(replace(column, values=file[part.name][column.name])
                                              for column in part.columns)) for part in parts]  # fmt: skip
        _write_head(file, [*stored, *others], None)


def _write_head(file: Any, tables: Sequence[Table], provenance: Mapping[str, str] | None) -> None:
    file.attrs.update({"default": tables[0].name, "format": TABLE_FORMAT, "format_version": FORMAT_VERSION})
    for name, text in (collect_provenance() if provenance is None else provenance).items():
        write_text(file.require_group("provenance"), name, text)
    file.attrs["content_hash"] = tables_hash(tables)


def read_table(path: Path | str, name: str | None = None) -> Table:
    """Return the table `name` of a file, or its first one.

    Raises
    ------
    RunFileError
        The file is absent, damaged or not a file of tables, or it has no such table.
    """
    tables = read_tables(path)
    if name is None:
        return next(iter(tables.values()))
    if name not in tables:
        raise RunFileError(f"{path}: no table {name!r}: expected {one_of(name, tables)}")
    return tables[name]


def read_tables(path: Path | str) -> dict[str, Table]:
    """Return all tables of a file by name, the default table first; it raises the errors of `read_table`."""
    with opened(path, TABLE_FORMAT) as file:
        names = sorted(set(file) - {"provenance"}, key=lambda name: name != file.attrs["default"])
        tables = {name: _read(file[name], str(path)) for name in names}
        if tables_hash(list(tables.values())) != file.attrs["content_hash"]:
            raise RunFileError(f"{path}: the numbers differ from their content hash, the file is damaged")
        return tables


def tables_hash(tables: Sequence[Table]) -> str:
    """Return sha256 of all columns of all tables, in the order of the tables' names."""
    digest = hashlib.sha256()
    for table in sorted(tables, key=lambda table: table.name):
        for column in table.columns:
            add_array(digest, f"{table.name}/{column.name}", _hashable(column.values))
    return digest.hexdigest()


def _is_text(values: Any) -> bool:
    return len(values) > 0 and isinstance(values[0], str)


def _hashable(values: Any) -> Any:
    """Return a column in its stored form: texts as bytes, booleans as small integers."""
    if _is_text(values):
        return np.frombuffer("\0".join(values).encode(), np.uint8)
    array = values if hasattr(values, "dtype") else np.asarray(values)  # a dataset in a file is not read here
    return array.astype(np.uint8) if array.dtype == np.bool_ else array


def _are_names(names: Sequence[str]) -> bool:
    return len(set(names)) == len(names) > 0 and all(name and "/" not in name for name in names)


def _write(group: Any, table: Table, *, growing: bool = False) -> None:
    """Write a table; a `growing` table has no texts, and its first column increases."""
    first = table.columns[0]
    distinct = not _is_text(first.values) and len(np.unique(first.values)) == len(first.values) > 0
    dimension = first.name if distinct else ROW
    if distinct:
        write_scale(group, dimension, first.values, first.unit, growing=growing)
        group[dimension].attrs["long_name"] = first.description
    else:
        write_scale(group, dimension, np.arange(len(first.values), dtype=np.int64), "1")
    for column in table.columns[1:] if distinct else table.columns:
        values = tuple(column.values) if _is_text(column.values) else column.values
        write_quantity(group, column.name, values, (dimension,), column.unit, column.description, growing=growing)
    group.attrs.update({"title": table.title, "command": table.command, "runs": "\n".join(table.runs)})


def _read(group: Any, path: str) -> Table:
    if not hasattr(group, "keys"):  # iterating over a dataset in a table's place might never end
        raise RunFileError(f"{path}: {group.name} is no table")
    columns = tuple(Column(name, read_values(group, name, path), str(group[name].attrs["units"]),
                           str(group[name].attrs["long_name"])) for name in group if name != ROW)  # fmt: skip
    runs = tuple(str(group.attrs["runs"]).split("\n")) if group.attrs["runs"] else ()
    return Table(group.name.strip("/"), columns, str(group.attrs["title"]), runs, str(group.attrs["command"]))


def write_record(
    path: Path, value: Any, title: str, *, runs: Sequence[str] = (), command: str = "",
    provenance: Mapping[str, str] | None = None,
) -> Path:
    """Write any records as JSON, in a table of one text; see `plain` for the types."""
    column = Column("json", (json.dumps(plain(value), ensure_ascii=False),), "1", "the records as JSON")
    return write_table(path, Table(RECORDS, (column,), title, tuple(runs), command), provenance)


def read_record(path: Path) -> Any:
    """Return the records in a file as lists and mappings; it raises the errors of `read_table`."""
    return json.loads(read_table(path, RECORDS)["json"][0])

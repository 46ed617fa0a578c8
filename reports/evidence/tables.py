"""The tables under figures and claims, as columns of an HDF5 file that anybody can open."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from reports.store.tables import Column as StoredColumn
from reports.store.tables import Table as StoredTable
from verification.finding import Table


def numbers_tables(records: Any) -> tuple[StoredTable, ...]:
    """Return what is stored of each Table among the records, wherever it hangs, named after its holder."""
    found: dict[str, Table] = {}
    for name, numbers in _walk(records, "table"):
        label, count = name, 2
        while label in found:
            label, count = f"{name}_{count}", count + 1
        found[label] = numbers
    return tuple(numbers_table(name, numbers) for name, numbers in found.items() if numbers.rows)


def _walk(value: Any, name: str) -> Iterator[tuple[str, Table]]:
    if isinstance(value, Table):
        yield name, value
    elif is_dataclass(value) and not isinstance(value, type):
        own = str(getattr(value, "id", None) or getattr(value, "key", None) or name)
        for field in fields(value):
            yield from _walk(getattr(value, field.name), _safe(own))
    elif isinstance(value, Mapping):
        for key, item in value.items():
            yield from _walk(item, _safe(str(key)))
    elif isinstance(value, list | tuple):
        for item in value:
            yield from _walk(item, name)


def numbers_table(name: str, numbers: Table) -> StoredTable:
    """Return a Table as it is stored: its outcomes are a column of words."""
    units = [*(column.unit or "1" for column in numbers.columns), "1"]
    columns = [
        StoredColumn(f"{index:02d} {_safe(title)}", _column([row[index] for row in numbers.cells]), unit, title)
        for index, (title, unit) in enumerate(zip(numbers.titles, units, strict=False))
    ]
    return StoredTable(name, tuple(columns), numbers.note, command="iapb reproduce")


def _column(values: list[Any]) -> Any:
    if all(value is None or isinstance(value, int | float | bool | np.number) for value in values):
        return np.array([np.nan if value is None else float(value) for value in values])
    return tuple("" if value is None else str(value) for value in values)


def _safe(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9_]+", "_", text).strip("_") or "table"

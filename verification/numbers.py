"""The numbers that pages quote: a flat mapping of key -> value, kept as a table of a finding.

A key names the unit, such as ``largest_error_mm``. Each value is a number, a text or None. Numbers
that depend on measured times are kept in a table of their own, so that two reports can be compared.
Most are one column of a table, counted or summed in some of its rows: a `quote`, written in YAML.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from verification.table import Columns, Table, titled

# names of the two tables
NUMBERS = "numbers"
TIMES = "numbers from times"
Values = Mapping[str, Any]

# How a number is made of rows, and of the values of one of their columns, those that are not None.
TAKE: dict[str, Callable[[Table, list[Any]], Any]] = {
    "rows": lambda rows, _: len(rows.rows),
    "held": lambda rows, _: rows.holds.count(True),
    "failed": lambda rows, _: rows.holds.count(False),
    "open": lambda rows, _: rows.holds.count(None),
    "told": lambda rows, _: len(rows.decided),
    "sum": lambda _, values: sum(values),
    "least": lambda _, values: min(values, default=None),
    "most": lambda _, values: max(values, default=None),
    "median": lambda _, values: float(np.median(values)) if values else None,
}
LIMITS = {
    "above": operator.gt,
    "at least": operator.ge,
    "at most": operator.le,
    "below": operator.lt,
}


def quoted(quotes: Mapping[str, Mapping[str, Any]], tables: Mapping[str, Table]) -> Values:
    """Return the numbers of quotes by table and name; a quote is the arguments of `quote`."""
    return {
        name: quote(tables[key], **given)
        for key, named in quotes.items()
        for name, given in named.items()
    }


def quote(
    table: Table,
    take: str,
    of: str = "",
    where: Mapping[str, Any] = MappingProxyType({}),
    times: float = 1,
) -> Any:
    """Return a number of a table; None if there is no value to take.

    Parameters
    ----------
    take : a key of TAKE; of : the column that it takes
    where : column -> the value in the rows that count, or a limit such as {"above": 0.05}
    times : factor of the number, such as 1000 for millimetres
    """
    rows = table.only(
        all(_fits(row[key], wanted) for key, wanted in where.items()) for row in table.records()
    )
    values = [value for value in rows[of] if value is not None] if of else []
    found = TAKE[take](rows, values)
    return found if found is None or times == 1 else times * found


def _fits(value: Any, wanted: Any) -> bool:
    """Return whether a value is the wanted one, or within the wanted limit."""
    if not isinstance(wanted, Mapping):
        return bool(value == wanted)
    ((how, limit),) = wanted.items()
    return bool(LIMITS[how](value, limit))


def value_tables(values: Values, timed: Values | None = None) -> dict[str, Table]:
    """Return the tables of numbers by name; `timed` are those that depend on measured times."""
    tables = {NUMBERS: titled(("key", "value"), values.items())}
    if timed:
        tables[TIMES] = titled(("key", "value"), timed.items(), kinds=Columns(timed=("value",)))
    return tables


def read_values(tables: Mapping[str, Table]) -> dict[str, Any]:
    """Return the numbers in the tables of a finding by key; empty if it has none."""
    return {
        key: value
        for name in (NUMBERS, TIMES)
        if name in tables
        for key, value in tables[name].rows
    }

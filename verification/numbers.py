"""The numbers that pages quote: a flat mapping of key -> value, kept as a table of a finding.

A key names the unit, such as ``largest_error_mm``. Each value is a number, a text or None. Numbers
that depend on measured times are kept in a table of their own, so that two reports can be compared.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from verification.table import Columns, Table, titled

# names of the two tables
NUMBERS = "numbers"
TIMES = "numbers from times"
Values = Mapping[str, Any]


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

"""Overview of the hard cases: a row per case (failures of the engine first) and a column per method or world."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from reports.figures.numbers import power_of_ten
from verification.finding import Finding
from verification.hard_cases.findings import ENGINE, STABLE
from verification.table import Table

# verdict -> its mark and the class of its colour: shape as well as colour
MARKS = {
    STABLE: ("●", "good"), "gains energy": ("✕", "bad"), "wrong motion": ("▲", "bad"), "failed": ("✶", "bad"),
    "restitution unmet": ("■", "limited"), "depends on rounding": ("□", "limited"), "refused": ("○", "open"),
    "timed out": ("◇", "open"), "out of memory": ("◆", "open"),
}  # fmt: skip
KINDS = {"impact": "Impacts, by method", "motion": "Motions, by world"}
Row = Mapping[str, Any]


# (title, methods, rows); each row is a case and, for each method, a cell: (mark, class, words, decade)
Matrix = tuple[str, list[str], list[tuple[str, list[tuple[str, str, str, str] | None]]]]


def matrices(numbers: Table) -> list[Matrix]:
    """Return a matrix of the impacts and one of the motions, from a table with a row per case and method."""
    found: list[Matrix] = []
    for kind, title in KINDS.items():
        cases: dict[str, dict[str, Row]] = {}
        for row in numbers.where(kind=kind).records():
            cases.setdefault(row["case"], {})[row["method"]] = row
        methods = sorted({name for row in cases.values() for name in row}, key=lambda name: (name not in ENGINE, name))
        order = sorted(cases, key=lambda case: _rank(tuple(cases[case].values())))
        if cases:
            found.append((title, methods, [(case, [_cell(cases[case].get(method)) for method in methods])
                                           for case in order]))  # fmt: skip
    return found


def worst_first(cases: Sequence[Finding]) -> list[Finding]:
    """Return the cases in the order of the matrix; cases without a table are last."""
    rows = {case.key: case.tables[case.key].records() for case in cases if case.key in case.tables}
    return sorted(cases, key=lambda case: _rank(rows[case.key]) if case.key in rows else (9, 0.0, 0))


def _rank(rows: Sequence[Row]) -> tuple[int, float, int]:
    """Return a sort key: failures of the engine first, then the largest ratio of its error or energy gain to the
    allowed one, then the number of failing methods."""
    ours = [row for row in rows if row["method"] in ENGINE]
    failing = sum(row["outcome"] != STABLE for row in rows)
    return (int(all(row["outcome"] == STABLE for row in ours)), -max(map(_share, ours), default=0.0), -failing)


def _share(row: Row) -> float:
    pairs = (("energy gain", "gain allowed"), ("forward error", "error allowed"))
    return max((row[found] / row[allowed] for found, allowed in pairs if row.get(found) and row.get(allowed)),
               default=0.0)  # fmt: skip


def _cell(row: Row | None) -> tuple[str, str, str, str] | None:
    if row is None:
        return None
    value = row["energy gain"] if row["outcome"] == "gains energy" else row["forward error"]
    return (*MARKS[row["outcome"]], row["outcome"], decade(value))


def decade(value: float | None) -> str:
    """Return the power of ten at or below an error or gain, as text; "" for zero and None."""
    return power_of_ten(10.0 ** math.floor(math.log10(value))) if value is not None and value > 0.0 else ""

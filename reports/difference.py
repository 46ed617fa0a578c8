"""Compare two reports number by number: which agree exactly, which agree within a tolerance, and which differ.

Measured times are not judged, because they depend on the machine and its load. Sentences are not judged either: their
numbers are in tables and are compared there. Each table states which of its columns hold times (`Table.timed`) and
which hold sentences (`Table.prose`).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from reports.numbers_file import ReportNumbers
from verification.finding import Table

EXACT, CLOSE, DIFFERS = "exact", "close", "differs"
TIMING, PROSE, ONLY_OLD, ONLY_NEW = "timing", "prose", "only old", "only new"
# Another processor orders and rounds sums differently: by some 1e-16 per step, which grows over thousands of steps.
TOLERANCE = 1e-9
# A difference below this is rounding: errors of 1e-16 need not repeat to any digit, nor a solver's 1e-11 to three.
ROUNDING = 1e-12
# The text of a cell whose case was not run because a smaller case took too long (reference.complementarity).
LEFT_OUT = "left out"


@dataclass(frozen=True)
class Cell:
    """One number, text or verdict in both reports; `gap` is the relative difference of its numbers."""

    table: str
    column: str
    row: str
    old: Any
    new: Any
    state: str
    gap: float = 0.0


@dataclass(frozen=True)
class Difference:
    """The result of a comparison.

    cells : every cell of either report
    tables_old, tables_new : tables that only the old or only the new report has
    runs_same, runs_other : runs of both reports that are equal to the last bit, and those that are not
    runs_single : runs that only one report has
    """

    cells: tuple[Cell, ...]
    tables_old: tuple[str, ...]
    tables_new: tuple[str, ...]
    runs_same: int
    runs_other: tuple[str, ...]
    runs_single: int

    def count(self, state: str) -> int:
        """Return the number of cells in a state."""
        return sum(cell.state == state for cell in self.cells)

    def of(self, state: str) -> tuple[Cell, ...]:
        """Return the cells in a state, the largest gap first."""
        return tuple(sorted((cell for cell in self.cells if cell.state == state), key=lambda cell: -cell.gap))

    def by_part(self) -> dict[str, Counter[str]]:
        """Return the number of cells in each state by part of the report.

        The part is the text before the first "/" or comma in the name of a table.
        """
        found: dict[str, Counter[str]] = {}
        for cell in self.cells:
            part = cell.table.partition("/")[0].partition(",")[0]
            found.setdefault(part, Counter())[cell.state] += 1
        return found


def compare_reports(old: ReportNumbers, new: ReportNumbers, tolerance: float = TOLERANCE) -> Difference:
    """Compare two reports; numbers are close if they differ by at most `tolerance` of the larger, or by ROUNDING."""
    both = [name for name in old.tables if name in new.tables]
    cells = [cell for name in both for cell in _cells(name, old.tables[name], new.tables[name], tolerance)]
    runs = {command: new.runs[command] == content for command, content in old.runs.items() if command in new.runs}
    return Difference(
        tuple(cells), _only(old.tables, new.tables), _only(new.tables, old.tables), sum(runs.values()),
        tuple(command for command, same in runs.items() if not same), len(set(old.runs) ^ set(new.runs)),
    )  # fmt: skip


def _only(first: Mapping[str, Any], second: Mapping[str, Any]) -> tuple[str, ...]:
    return tuple(name for name in first if name not in second)


def _cells(table: str, old: Table, new: Table, tolerance: float) -> Iterator[Cell]:
    old_rows, new_rows = _rows(old, new)
    timed, prose = {*old.timed, *new.timed}, {*old.prose, *new.prose}
    timed_rows = old.timed_rows or new.timed_rows
    for row in dict.fromkeys((*old_rows, *new_rows)):
        first, second = old_rows.get(row, {}), new_rows.get(row, {})
        for column in dict.fromkeys((*first, *second)):
            if column not in first or column not in second:
                state, gap = ONLY_OLD if column in first else ONLY_NEW, 0.0
                by_time = timed_rows
            else:
                state, gap = compare_values(first[column], second[column], tolerance)
                by_time = column in timed or LEFT_OUT in (first[column], second[column])
            state = TIMING if by_time else PROSE if column in prose and state == DIFFERS else state
            yield Cell(table, column, row, first.get(column), second.get(column), state, gap)


def _rows(old: Table, new: Table) -> tuple[dict[str, dict[str, Any]], dict[str, dict[str, Any]]]:
    """Return the rows of both tables by name.

    If the tables have equally many rows, a row is named by its number and its first cell, else by its first cell alone,
    with a number after repeated names. If measured times decide which rows exist, a row is named by all untimed cells.
    """
    if old.timed_rows or new.timed_rows:
        return _named(_distinct(_untimed_cells(old)), old), _named(_distinct(_untimed_cells(new)), new)
    if len(old.rows) == len(new.rows):
        names = [f"{number}: {row[0]}" if row else str(number) for number, row in enumerate(old.cells, 1)]
        return _named(names, old), _named(names, new)
    return _named(_distinct(_first_cells(old)), old), _named(_distinct(_first_cells(new)), new)


def _first_cells(table: Table) -> list[str]:
    return [str(row[0]) if row else "" for row in table.cells]


def _untimed_cells(table: Table) -> list[str]:
    kept = [index for index, column in enumerate(table.titles) if column not in table.timed]
    return [", ".join(str(row[index]) for index in kept) for row in table.cells]


def _distinct(names: Sequence[str]) -> list[str]:
    """Return the names, each repeated one with a number after it."""
    seen: Counter[str] = Counter()
    found = []
    for name in names:
        seen[name] += 1
        found.append(name if seen[name] == 1 else f"{name} ({seen[name]})")
    return found


def _named(names: Sequence[str], table: Table) -> dict[str, dict[str, Any]]:
    columns = _distinct(table.titles)
    return {name: dict(zip(columns, row, strict=True)) for name, row in zip(names, table.cells, strict=True)}


def compare_values(old: Any, new: Any, tolerance: float) -> tuple[str, float]:
    """Return the state of a comparison of two cells, and their relative difference; texts must be equal."""
    if _same(old, new):
        return EXACT, 0.0
    if old is None or new is None:
        return (ONLY_NEW if old is None else ONLY_OLD), 0.0
    if _is_number(old) and _is_number(new):
        gap = _gap(float(old), float(new))
        return (CLOSE if gap <= tolerance else DIFFERS), gap
    return DIFFERS, math.inf


def _same(old: Any, new: Any) -> bool:
    both_nan = _is_number(old) and _is_number(new) and math.isnan(old) and math.isnan(new)
    return both_nan or (isinstance(old, bool) == isinstance(new, bool) and old == new)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _gap(old: float, new: float) -> float:
    """Return the relative difference, 0 if the difference is within rounding."""
    if old == new:
        return 0.0
    largest = max(abs(old), abs(new))
    if not math.isfinite(largest):
        return math.inf
    return 0.0 if abs(old - new) <= ROUNDING else abs(old - new) / largest

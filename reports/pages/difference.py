"""Compare two reports number by number: which agree exactly, which agree within a tolerance, and
which differ.

Measured times are not judged, because they depend on the machine and its load. Sentences are not
judged either: their numbers are in tables and are compared there. Each table states which of its
columns hold times (`Table.timed`) and which hold sentences (`Table.prose`).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import compress
from os.path import commonprefix
from typing import Any

from reports.pages.numbers_file import ReportNumbers
from reports.provenance import PEERS, machine_parts
from verification.table import Table

EXACT = "exact"
CLOSE = "close"
DIFFERS = "differs"
TIMING = "timing"
PROSE = "prose"
ONLY_OLD = "only old"
ONLY_NEW = "only new"
# Another processor orders and rounds sums differently: by some 1e-16 per step, which grows over
# thousands of steps.
TOLERANCE = 1e-9
# A difference below this is rounding: errors of 1e-16 need not repeat to any digit, nor a solver's
# 1e-11 to three.
ROUNDING = 1e-12
# The text of a cell whose case was not run because a smaller case took too long
# (reference.complementarity).
LEFT_OUT = "left out"

# Columns of the printed table, which has a row per part of the report; each column with the states
# that it counts.
PARTS = (
    ("the same", (EXACT,)),
    ("within the tolerance", (CLOSE,)),
    ("differ", (DIFFERS,)),
    ("in one only", (ONLY_OLD, ONLY_NEW)),
    ("times, not judged", (TIMING,)),
    ("other sentences", (PROSE,)),
)
SHOWN = 20  # lines; the rest is counted
_WIDEST = 34  # letters of a cell
_BEFORE = 10  # letters before the first that differs
# Facts that must be equal for equal results to the last bit, besides those of the machine:
# OPENBLAS_CORETYPE selects another BLAS kernel on the same processor. Some of the packages compared
# with are not in the lock file.
_BITWISE = ("lock", "sources", *PEERS)


@dataclass(frozen=True)
class Cell:
    """One number, text or verdict in both reports; `gap` is the relative difference of its
    numbers."""

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
    runs_same, runs_other : runs of both reports that are equal to the last bit, and those that are
        not
    runs_single : runs that only one report has
    """

    cells: tuple[Cell, ...]
    tables_old: tuple[str, ...]
    tables_new: tuple[str, ...]
    runs_same: int
    runs_other: tuple[str, ...]
    runs_single: int

    @property
    def agree(self) -> bool:
        """Whether no cell differs, and both reports have the same cells and tables."""
        apart = self.count(DIFFERS) + self.count(ONLY_OLD) + self.count(ONLY_NEW)
        return not (apart or self.tables_old or self.tables_new)

    def count(self, state: str) -> int:
        """Return the number of cells in a state."""
        return sum(cell.state == state for cell in self.cells)

    def of(self, state: str) -> tuple[Cell, ...]:
        """Return the cells in a state, the largest gap first."""
        return tuple(
            sorted((cell for cell in self.cells if cell.state == state), key=lambda cell: -cell.gap)
        )


def compare_reports(
    old: ReportNumbers, new: ReportNumbers, tolerance: float = TOLERANCE
) -> Difference:
    """Compare two reports; numbers are close if they differ by at most `tolerance` of the larger,
    or by ROUNDING."""
    cells = [
        cell
        for name, table in old.tables.items()
        if name in new.tables
        for cell in _cells(name, table, new.tables[name], tolerance)
    ]
    runs = {
        command: new.runs[command] == content
        for command, content in old.runs.items()
        if command in new.runs
    }
    alone = [
        tuple(name for name in first.tables if name not in second.tables)
        for first, second in ((old, new), (new, old))
    ]
    return Difference(
        tuple(cells),
        alone[0],
        alone[1],
        sum(runs.values()),
        tuple(command for command, same in runs.items() if not same),
        len(set(old.runs) ^ set(new.runs)),
    )


def _cells(table: str, old: Table, new: Table, tolerance: float) -> Iterator[Cell]:
    timed = {*old.timed, *new.timed}
    prose = {*old.prose, *new.prose}
    timed_rows = old.kinds.timed_rows or new.kinds.timed_rows
    names = [_names(one, timed_rows) for one in (old, new)]
    if len(old.rows) == len(new.rows) and not timed_rows:
        names = [[f"{number}: {name}" for number, name in enumerate(names[0], 1)]] * 2
    old_rows, new_rows = (
        {
            name: dict(zip(_distinct(one.titles), row, strict=True))
            for name, row in zip(_distinct(own), one.cells, strict=True)
        }
        for one, own in zip((old, new), names, strict=True)
    )
    for row in dict.fromkeys((*old_rows, *new_rows)):
        first = old_rows.get(row, {})
        second = new_rows.get(row, {})
        for column in dict.fromkeys((*first, *second)):
            pair = first.get(column), second.get(column)
            if column in first and column in second:
                state, gap = compare_values(*pair, tolerance)
                by_time = column in timed or LEFT_OUT in pair
            else:
                state, gap = (ONLY_OLD if column in first else ONLY_NEW), 0.0
                by_time = timed_rows
            if by_time:
                state = TIMING
            elif state == DIFFERS and column in prose:
                state = PROSE
            yield Cell(table, column, row, *pair, state, gap)


def _names(table: Table, timed_rows: bool) -> list[str]:
    """Return the first cell of each row; if measured times decide which rows exist, all its untimed
    cells."""
    if not timed_rows:
        return [str(row[0]) if row else "" for row in table.cells]
    untimed = [column not in table.timed for column in table.titles]
    return [", ".join(map(str, compress(row, untimed))) for row in table.cells]


def _distinct(names: Sequence[str]) -> list[str]:
    """Return the names, each repeated one with a number after it."""
    seen = Counter[str]()
    found = []
    for name in names:
        seen[name] += 1
        found.append(name if seen[name] == 1 else f"{name} ({seen[name]})")
    return found


def compare_values(old: Any, new: Any, tolerance: float) -> tuple[str, float]:
    """Return the state of a comparison of two cells, and their relative difference; texts must be
    equal."""
    same = old == new or (old != old and new != new)  # NaN is NaN
    if same and isinstance(old, bool) == isinstance(new, bool):
        return EXACT, 0.0
    if old is None or new is None:
        return (ONLY_NEW if old is None else ONLY_OLD), 0.0
    numbers = isinstance(old, int | float) and isinstance(new, int | float)
    if not numbers or isinstance(old, bool) or isinstance(new, bool):
        return DIFFERS, math.inf
    largest = max(abs(old), abs(new))
    if not math.isfinite(largest):
        return DIFFERS, math.inf
    apart = abs(old - new)
    gap = float(apart / largest) if apart > ROUNDING else 0.0
    return (CLOSE if gap <= tolerance else DIFFERS), gap


def sentences(found: Difference, tolerance: float) -> Iterator[str]:
    """Yield sentences that give the numbers of equal, close and different cells, tables and
    runs."""
    exact, close, differs, prose = (found.count(state) for state in (EXACT, CLOSE, DIFFERS, PROSE))
    yield (
        f"Of {exact + close + differs} numbers and words in both reports, {exact} are exactly the "
        f"same, {close} "
        f"agree within {tolerance:.0e} or {ROUNDING:.0e}, whichever is more, and {differs} differ."
    )
    yield f"{found.count(TIMING)} measured times, and what is made from them, are not judged."
    if prose:
        yield f"{prose} sentences differ; they are not judged: their numbers stand in tables."
    old = found.count(ONLY_OLD)
    new = found.count(ONLY_NEW)
    if old or new or found.tables_old or found.tables_new:
        yield (
            f"{old} are only in the old report and {new} only in the new one, besides "
            f"{len(found.tables_old)} and "
            f"{len(found.tables_new)} whole tables."
        )
    for title, tables in (("old", found.tables_old), ("new", found.tables_new)):
        if tables:
            yield f"Only in the {title} report: {', '.join(tables)}."
    yield (
        f"Of {found.runs_same + len(found.runs_other)} runs behind both, {found.runs_same} are "
        f"the same to the last "
        f"bit; {found.runs_single} are behind one only."
    )


def lines(found: Difference) -> Iterator[str]:
    """Yield a line for each of the SHOWN largest differences: table, row, column, both values,
    relative difference."""
    for cell in found.of(DIFFERS)[:SHOWN]:
        share = f" ({cell.gap:.1e} of it)" if math.isfinite(cell.gap) else ""
        old = str(cell.old)
        new = str(cell.new)
        start = max(len(commonprefix([old, new])) - _BEFORE, 0)
        yield (
            f"{cell.table}, row {_short(cell.row)}, {_short(cell.column)}: "
            f"{_short(old, start)} -> {_short(new, start)}{share}"
        )


def parts(found: Difference) -> Iterator[tuple[str, ...]]:
    """Yield table rows: the part of the report, then the number of its cells in each of the states
    of PARTS.

    The part is the text before the first "/" or comma in the name of a table.
    """
    counts: dict[str, Counter[str]] = {}
    for cell in found.cells:
        counts.setdefault(cell.table.partition("/")[0].partition(",")[0], Counter())[
            cell.state
        ] += 1
    for part, count in counts.items():
        yield part, *(str(sum(count[state] for state in states) or "") for _, states in PARTS)


def _short(text: str, start: int = 0) -> str:
    """Return a text of at most _WIDEST letters; a longer one without the letters before `start`."""
    if len(text) <= _WIDEST:
        return text
    lead = "…" if start else ""
    rest = lead + text[start:]
    return rest if len(rest) <= _WIDEST else rest[: _WIDEST - 1] + "…"


def unlike(old: Mapping[str, str], new: Mapping[str, str]) -> tuple[str, ...]:
    """Return the provenance facts that differ and because of which two reports need not agree to
    the last bit."""
    facts = [
        machine_parts(given) | {name: given.get(name, "") for name in _BITWISE}
        for given in (old, new)
    ]
    return tuple(name for name in facts[0] if facts[0][name] != facts[1][name])

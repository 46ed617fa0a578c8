"""A comparison of two reports as text: sentences, a table by part, and a line for each of the largest differences."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from reports.difference import (
    CLOSE,
    DIFFERS,
    EXACT,
    ONLY_NEW,
    ONLY_OLD,
    PROSE,
    ROUNDING,
    TIMING,
    Cell,
    Difference,
)
from reports.provenance import PEERS, machine_parts

# Columns of the table, which has a row per part of the report; each column with the states that it counts.
PARTS = (("the same", (EXACT,)), ("within the tolerance", (CLOSE,)), ("differ", (DIFFERS,)),
         ("in one only", (ONLY_OLD, ONLY_NEW)), ("times, not judged", (TIMING,)),
         ("other sentences", (PROSE,)))  # fmt: skip
SHOWN = 20  # lines; the rest is counted
_WIDEST = 34  # letters of a cell
# Facts that must be equal for equal results to the last bit, besides those of the machine: OPENBLAS_CORETYPE selects
# another BLAS kernel on the same processor. Some of the packages compared with are not in the lock file.
_BITWISE = ("lock", "sources", *PEERS)


def sentences(found: Difference, tolerance: float) -> Iterator[str]:
    """Yield sentences that give the numbers of equal, close and different cells, tables and runs."""
    exact, close, differs = (found.count(state) for state in (EXACT, CLOSE, DIFFERS))
    judged = exact + close + differs
    yield (f"Of {judged} numbers and words in both reports, {exact} are exactly the same, {close} agree within "
           f"{tolerance:.0e} or {ROUNDING:.0e}, whichever is more, and {differs} differ.")  # fmt: skip
    yield f"{found.count(TIMING)} measured times, and what is made from them, are not judged."
    if found.count(PROSE):
        yield f"{found.count(PROSE)} sentences differ; they are not judged: their numbers stand in tables."
    old, new = found.count(ONLY_OLD), found.count(ONLY_NEW)
    if old or new or found.tables_old or found.tables_new:
        yield (f"{old} are only in the old report and {new} only in the new one, besides {len(found.tables_old)} and "
               f"{len(found.tables_new)} whole tables.")  # fmt: skip
    for title, tables in (("old", found.tables_old), ("new", found.tables_new)):
        if tables:
            yield f"Only in the {title} report: {', '.join(tables)}."
    runs = found.runs_same + len(found.runs_other)
    yield (f"Of {runs} runs behind both, {found.runs_same} are the same to the last bit; {found.runs_single} are "
           "behind one only.")  # fmt: skip


def lines(found: Difference) -> Iterator[str]:
    """Yield a line for each of the SHOWN largest differences: table, row, column, both values, relative difference."""
    for cell in found.of(DIFFERS)[:SHOWN]:
        old, new = _values(cell)
        share = f" ({cell.gap:.1e} of it)" if math.isfinite(cell.gap) else ""
        yield f"{cell.table}, row {_short(cell.row)}, {_short(cell.column)}: {old} -> {new}{share}"


def parts(found: Difference) -> Iterator[tuple[str, ...]]:
    """Yield table rows: the part of the report, then the number of its cells in each of the states of PARTS."""
    for part, count in found.by_part().items():
        yield part, *(str(sum(count[state] for state in states) or "") for _, states in PARTS)


def _values(cell: Cell) -> tuple[str, str]:
    """Return both values as text; long texts start shortly before their first difference."""
    old, new = str(cell.old), str(cell.new)
    parted = next((i for i, (a, b) in enumerate(zip(old, new, strict=False)) if a != b), 0)
    start = max(0, parted - 8) if max(len(old), len(new)) > _WIDEST else 0
    return _short(old[start:]), _short(new[start:])


def _short(text: Any) -> str:
    text = str(text)
    return text if len(text) <= _WIDEST else text[: _WIDEST - 1] + "…"


def unlike(old: Mapping[str, str], new: Mapping[str, str]) -> tuple[str, ...]:
    """Return the provenance facts that differ and because of which two reports need not agree to the last bit."""
    facts = [machine_parts(given) | {name: given.get(name, "") for name in _BITWISE} for given in (old, new)]
    return tuple(name for name in facts[0] if facts[0][name] != facts[1][name])

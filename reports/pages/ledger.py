"""From the results of the claims to the lines of the ledger and the sentences of the first page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from reports.figures.condition_map import condition_map
from reports.figures.figure import Figure, Numbers
from reports.pages.records import LIMITED, NOT_TESTABLE, REFUTED, REPRODUCED, Claim, Verdict

if TYPE_CHECKING:
    from verification.claims import ClaimResult, Table

_SHOWN_ROWS = 12  # of a claim's trials: those that fail first, as they are what one looks for
_SUBJECTS = (
    ("Energy", ("C01", "C02", "C04", "C08")),
    ("Redundant contacts", ("C03", "C05", "C06")),
    ("Geometry and walls", ("C07", "C17")),
    ("Trajectory", ("C10", "C13")),
    ("Forces", ("C11", "C14")),
    ("Weak devices", ("C09", "C12", "C16")),
    ("Coming to rest", ("C15",)),
)
_WORST_FIRST = (REFUTED, LIMITED, REPRODUCED, NOT_TESTABLE)


def ledger(results: Sequence[ClaimResult]) -> tuple[Claim, ...]:
    """Return one line of the ledger for each result."""
    return tuple(_line(result) for result in results)


def _line(result: ClaimResult) -> Claim:
    return Claim(
        result.id, result.statement, result.place, result.verdict, result.finding, result.quantity,
        result.conditions, result.tolerance, result.fails, _trials(result.table), _map(result),
    )


def _trials(table: Table) -> Numbers:
    """Return the first rows of a claim's table, failures first, with their outcome."""
    order = sorted(range(len(table.rows)), key=lambda k: {False: 0, True: 1, None: 2}[table.holds[k]])
    words = {True: "holds", False: "fails", None: "cannot tell"}
    rows = tuple((*table.rows[k], words[table.holds[k]]) for k in order[:_SHOWN_ROWS])
    hidden = len(table.rows) - len(rows)
    note = f"{len(rows)} of {len(table.rows)} trials, those that fail first." if hidden else ""
    return Numbers((*(column.heading for column in table.columns), "outcome"), rows, digits=3, note=note)


def _map(result: ClaimResult) -> Figure | None:
    """Return the map over the claim's two conditions, where it has them and they are numbers."""
    table = result.table
    if result.map_axes is None or not table.rows:
        return None
    x, y = (table.column(name) for name in result.map_axes)
    if not all(isinstance(value, int | float) for value in (*x, *y)):
        return None
    headings = {column.name: column.heading for column in table.columns}
    split = None if result.map_panels is None else _named(result.map_panels, table.column(result.map_panels))
    return condition_map(
        f"map-{result.id}", "Where it holds", f"{result.held} of {result.decided} trials hold.",
        (headings[result.map_axes[0]], x), (headings[result.map_axes[1]], y), table.holds, split,
    )


def _named(name: str, values: Sequence[Any]) -> list[str]:
    return [value if isinstance(value, str) else f"{name} {value:g}" for value in values]


def verdicts(claims: Sequence[Claim]) -> tuple[Verdict, ...]:
    """Return one verdict per subject: the worst of its claims, in the words of that claim's finding."""
    found = {claim.id: claim for claim in claims}
    given = ((subject, [found[name] for name in names if name in found]) for subject, names in _SUBJECTS)
    return tuple(_verdict(subject, members) for subject, members in given if members)


def _verdict(subject: str, members: Sequence[Claim]) -> Verdict:
    worst = min(members, key=lambda claim: _WORST_FIRST.index(claim.outcome))
    held = sum(claim.outcome == REPRODUCED for claim in members)
    count = f"{held} of {len(members)} claims reproduced. " if len(members) > 1 else ""
    return Verdict(subject, worst.outcome, f"{count}{worst.id}: {worst.headline}", worst.id)

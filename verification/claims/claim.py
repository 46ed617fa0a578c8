"""Claim and ClaimResult: what is claimed, how a trial decides, and what came of it.

The verdict follows from the trials by one rule, for every claim alike (`verdict_of_trials` and `overall`): nobody types
it in.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from verification.finding import LIMITED, NOT_COMPUTED, NOT_TESTABLE, Failure, Row, Table, verdict_of_trials

if TYPE_CHECKING:
    from verification.claims.study import Study


@dataclass(frozen=True)
class Claim:
    """A statement of the paper as a computation.

    Attributes
    ----------
    id : key of the ledger, C01 to C22
    statement : the claim in our words; place : where the paper makes it
    quantity : what is measured; tolerance : when a trial counts as holding, and why there
    measure : study -> trials, not yet judged
    holds : one trial -> True, False, or None where it cannot tell; a pure function of the row
    finding : judged trials -> one sentence with numbers
    map_axes : two condition columns over which the outcome is best drawn; map_panels : the column that splits maps
    """

    id: str
    statement: str
    place: str
    quantity: str
    tolerance: str
    measure: Callable[[Study], Table]
    holds: Callable[[Row], bool | None]
    finding: Callable[[Table], str]
    map_axes: tuple[str, str] | None = None
    map_panels: str | None = None

    def judge(self, table: Table) -> Table:
        """Return the table with the outcome of each trial."""
        return replace(table, holds=tuple(self.holds(row) for row in table.records()))

    def check(self, study: Study) -> ClaimResult:
        """Measure, judge and conclude."""
        return self.conclude(self.judge(self.measure(study)))

    def not_computed(self) -> ClaimResult:
        """Return the record of a claim of which nothing was measured."""
        return ClaimResult(self.id, self.statement, self.place, self.quantity, self.tolerance, NOT_COMPUTED,
                           "Not computed.", "", "", (), Table(()), self.map_axes, self.map_panels)  # fmt: skip

    def conclude(self, table: Table) -> ClaimResult:
        """Return the record of a judged table."""
        parts = parts_of(table)
        return ClaimResult(
            self.id, self.statement, self.place, self.quantity, self.tolerance, overall(parts), self.finding(table),
            ranges(table), _where_it_fails(table), parts, table, self.map_axes, self.map_panels,
        )  # fmt: skip


@dataclass(frozen=True)
class Part:
    """A part of a claim that is judged by itself: in how many of the trials that could tell it held."""

    name: str
    verdict: str
    held: int
    decided: int


@dataclass(frozen=True)
class ClaimResult:
    """What came of a claim: plain data for a report.

    conditions : the range over which it was computed; fails : where it does not hold, empty if nowhere
    parts : the verdict of each part of the claim, one of no name where it has no parts
    failures : the cases that raised; they are in nothing else
    """

    id: str
    statement: str
    place: str
    quantity: str
    tolerance: str
    verdict: str
    finding: str
    conditions: str
    fails: str
    parts: tuple[Part, ...]
    table: Table
    map_axes: tuple[str, str] | None = None
    map_panels: str | None = None
    failures: tuple[Failure, ...] = ()

    @property
    def held(self) -> int:
        """Trials in which the claim held."""
        return sum(part.held for part in self.parts)

    @property
    def decided(self) -> int:
        """Trials that could tell."""
        return sum(part.decided for part in self.parts)


def overall(parts: Sequence[Part]) -> str:
    """Return the verdict of a claim from those of its parts: that of all, or limited where they differ."""
    verdicts = {part.verdict for part in parts if part.verdict != NOT_TESTABLE}
    if not verdicts:
        return NOT_TESTABLE
    return verdicts.pop() if len(verdicts) == 1 else LIMITED


def parts_of(table: Table) -> tuple[Part, ...]:
    """Return the parts of a claim with their verdicts."""
    return tuple(
        Part(name, verdict_of_trials(trials.holds), sum(h is True for h in trials.holds),
             sum(h is not None for h in trials.holds))
        for name, trials in _by_part(table).items()
    )  # fmt: skip


def _by_part(table: Table) -> dict[str, Table]:
    names = [column.key for column in table.columns if column.part]
    if not names:
        return {"": table}
    return {part: table.where(**{names[0]: part}) for part in dict.fromkeys(table.column(names[0]))}


def ranges(table: Table) -> str:
    """Return the conditions of a table in words: each with its values, or its ends where there are many."""
    parts = []
    for column in table.columns:
        if column.condition and table.rows:
            parts.append(f"{column.key} {_span(table.column(column.key))} {column.unit}".rstrip())
    return "; ".join(parts)


def _where_it_fails(table: Table) -> str:
    """In how many trials, and where; apart for each part of the claim."""
    failures = {part: _failures(trials) for part, trials in _by_part(table).items()}
    return "; ".join(f"{part}: {text}" if part else text for part, text in failures.items() if text)


def _failures(table: Table) -> str:
    failed = table.that(False)
    if not failed.rows:
        return ""
    decided = sum(outcome is not None for outcome in table.holds)
    if len(failed.rows) == decided:
        return f"in all {decided} trials"
    return f"in {len(failed.rows)} of {decided} trials, with {ranges(failed).replace('; ', ', ')}"


_LISTED = 8  # more values than this are given by their ends


def _span(values: list[Any]) -> str:
    found = {value for value in values if value is not None}
    if any(isinstance(value, str) for value in found):
        return ", ".join(sorted(map(str, found)))
    ordered = sorted(found)
    if len(ordered) > _LISTED:
        return f"{ordered[0]:g} to {ordered[-1]:g}"
    return ", ".join(f"{value:g}" for value in ordered)

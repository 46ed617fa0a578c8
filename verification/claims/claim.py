"""Claim: a statement of the paper, the cases on which it is tested, and the rule that decides one trial.

The rule of `verification.finding` computes the Finding of every claim from its trials. No verdict is written by hand.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from verification.finding import (
    NOT_COMPUTED,
    Column,
    Finding,
    Part,
    Region,
    Row,
    Table,
    finding_of,
    judge_part,
    ranges,
    table_of,
)

if TYPE_CHECKING:
    from verification.claims.study import Study


@dataclass(frozen=True)
class Claim:
    """A statement of the paper as a computation.

    Attributes
    ----------
    id : key of the claim in the ledger, C01 to C22
    statement : the claim in our words; place : where the paper makes it
    quantity : what is measured; tolerance : the limit up to which a trial holds, and the reason for it
    columns : the columns of a trial; the columns marked `part` split the claim into parts
    cases : study -> the cases to test; trials : (study, case) -> the trials of one case
    holds : one trial -> True, False, or None if the trial cannot decide; a pure function of the row
    finding : judged trials -> one sentence with numbers
    runs : (world, rendering) of the runs that a trial uses; empty unless the cases are conditions of the peg
    draw : (study, region) -> fresh cases inside a region, which confirm it; None if the claim has no fresh cases
    axes : the two condition columns that are the axes of the plotted maps, and the column that splits the maps
    """

    id: str
    statement: str
    place: str
    quantity: str
    tolerance: str
    columns: tuple[Column, ...]
    cases: Callable[[Study], Iterable[Any]]
    trials: Callable[[Study, Any], Iterable[Row]]
    holds: Callable[[Row], bool | None]
    finding: Callable[[Table], str]
    runs: tuple[tuple[str, str], ...] = ()
    draw: Callable[[Study, Region], Iterable[Any]] | None = None
    axes: tuple[str, ...] = ()

    def measure(self, study: Study, cases: Iterable[Any] | None = None) -> Table:
        """Return the judged trials of the given cases; by default of all cases."""
        chosen = tuple(self.cases(study) if cases is None else cases)
        study.make_ahead(chosen if self.runs else (), self.runs)
        return self.judge(table_of(self.columns, study.each(chosen, partial(self.trials, study))))

    def judge(self, table: Table) -> Table:
        """Return the table with the outcome of each trial."""
        outcomes = tuple(self.holds(row) for row in table.records())
        return replace(table, holds=outcomes, timed_rows=any(column.timed for column in table.columns))

    def check(self, study: Study) -> Finding:
        """Measure and judge all trials and return the finding; fresh trials confirm its regions."""
        return self.conclude(self.measure(study), study)

    def conclude(self, table: Table, study: Study | None = None) -> Finding:
        """Return the finding of judged trials; without a study it draws no fresh trials."""
        parts = [judge_part(name, trials, self._fresh(study, name)) for name, trials in by_part(table).items()]
        return self._found(self.finding(table), parts, table)

    def not_computed(self) -> Finding:
        """Return the finding of a claim that has no measured trials."""
        return self._found("", [Part("Not computed.", NOT_COMPUTED)], Table(self.columns))

    def _found(self, answer: str, parts: Iterable[Part], table: Table) -> Finding:
        details = {"place": self.place, "quantity": self.quantity, "tolerance": self.tolerance}
        found = finding_of(self.id, self.id, self.statement, answer, parts, {self.id: table})
        return replace(found, details=details | {"conditions": ranges(table)}, axes=self.axes)

    def _fresh(self, study: Study | None, name: str) -> Callable[[Region], Table] | None:
        """Return the function that draws and judges fresh trials of a part inside a region."""
        draw = self.draw
        if study is None or draw is None:
            return None

        def drawn(region: Region) -> Table:
            table = self.measure(study, draw(study, region))
            trials = by_part(table).get(name, replace(table, rows=(), holds=()))
            return trials.only(region.contains(row) for row in trials.records())

        return drawn


def by_part(table: Table) -> dict[str, Table]:
    """Return the trials of each part by the part's name; a claim without parts has one part named ""."""
    marked = [column.key for column in table.columns if column.part]
    names = [", ".join(row[key] for key in marked) for row in table.records()]
    return {part: table.only(name == part for name in names) for part in dict.fromkeys(names)} or {"": table}

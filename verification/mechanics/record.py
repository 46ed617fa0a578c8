"""Finding: what one study of the mechanics measured, as plain data for a report."""

from __future__ import annotations

from dataclasses import dataclass

from iapb.errors import ArgumentError
from iapb.names import one_of
from verification.finding import Table

DEPTHS = ("quick", "full")


@dataclass(frozen=True)
class Finding:
    """A table with what must hold in every row.

    title : in a few words
    statement : what must hold
    tolerance : how closely, and why so closely
    table : one row per trial, `table.holds` its outcome (None: nothing to judge)
    skipped : why nothing was measured; empty where something was
    """

    title: str
    statement: str
    tolerance: str
    table: Table
    skipped: str = ""

    @property
    def passed(self) -> bool | None:
        """Whether every row that can tell holds; None where none can."""
        decided = [outcome for outcome in self.table.holds if outcome is not None]
        return all(decided) if decided else None

    @property
    def failures(self) -> Table:
        """The rows that do not hold."""
        return self.table.that(False)


def check_depth(depth: str) -> None:
    """Raise ArgumentError unless the depth is one of DEPTHS."""
    if depth not in DEPTHS:
        raise ArgumentError("depth", depth, one_of(depth, DEPTHS))

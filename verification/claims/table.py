"""Table: the trials of a claim, one row per trial, with the outcome of each. Plain data, no names of others."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

Row = Mapping[str, Any]


@dataclass(frozen=True)
class Column:
    """One quantity of every trial: a `condition` was chosen, a `part` is judged apart, the others are measured.

    A `timed` one is a measured time or made from some: it need not repeat.
    """

    name: str
    unit: str = ""
    condition: bool = False
    part: bool = False
    timed: bool = False

    @property
    def heading(self) -> str:
        """Name with its unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


@dataclass(frozen=True)
class Table:
    """Trials of a claim.

    columns : what each row holds, in order
    rows : one tuple per trial: numbers, texts, or None where a quantity does not apply
    holds : per trial, whether the claim held; None where the trial cannot tell (a tie, a limit never reached)
    """

    columns: tuple[Column, ...]
    rows: tuple[tuple[Any, ...], ...]
    holds: tuple[bool | None, ...] = ()

    def column(self, name: str) -> list[Any]:
        """Return the values of one column."""
        index = [column.name for column in self.columns].index(name)
        return [row[index] for row in self.rows]

    def records(self) -> list[dict[str, Any]]:
        """Return the rows as dictionaries by column name."""
        names = [column.name for column in self.columns]
        return [dict(zip(names, row, strict=True)) for row in self.rows]

    def where(self, **values: Any) -> Table:
        """Return the trials in which the named columns have these values."""
        kept = [all(row[name] == value for name, value in values.items()) for row in self.records()]
        return self._only(kept)

    def that(self, outcome: bool | None) -> Table:
        """Return the trials with this outcome."""
        return self._only([held is outcome for held in self.holds])

    def _only(self, kept: Sequence[bool]) -> Table:
        rows = tuple(row for row, keep in zip(self.rows, kept, strict=True) if keep)
        holds = tuple(held for held, keep in zip(self.holds, kept, strict=False) if keep)
        return Table(self.columns, rows, holds)


def table_of(columns: Sequence[Column], records: Iterable[Row]) -> Table:
    """Return a table of these columns from dictionaries; what a dictionary lacks is None."""
    return Table(tuple(columns), tuple(tuple(record.get(c.name) for c in columns) for record in records))

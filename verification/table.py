"""Table: the rows of a study, the description of each column, and whether what is claimed holds in
each row."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

Row = Mapping[str, Any]

HOLDS = "holds"  # heading of the outcomes in printed tables
WORDS = {True: "yes", False: "no", None: "cannot tell"}  # words for the outcomes
_UNIT = re.compile(r"^(?P<key>.*\S) \[(?P<unit>[^\[\]]+)\]$")


@dataclass(frozen=True)
class Columns:
    """The columns of a table that are more than a measured value, by key or title.

    Attributes
    ----------
    conditions : their values are chosen by the study, not measured
    parts : the rows with the same values in them form one part, which is judged separately
    counts : numbers of the cases of a row, such as the impacts of a batch whose worst one is judged
    timed : measured times and values computed from them; they may differ in the next run
    prose : sentences; the numbers in them are compared through other tables
    timed_rows : True if the selection of rows depends on measured times
    """

    conditions: tuple[str, ...] = ()
    parts: tuple[str, ...] = ()
    counts: tuple[str, ...] = ()
    timed: tuple[str, ...] = ()
    prose: tuple[str, ...] = ()
    timed_rows: bool = False


@dataclass(frozen=True)
class Column:
    """One quantity of every row: its name in code and in print, and its unit; "" if there is
    none."""

    key: str
    unit: str = ""

    @property
    def title(self) -> str:
        """The key with the unit."""
        return f"{self.key} [{self.unit}]" if self.unit else self.key


@dataclass(frozen=True)
class Table:
    """Rows of numbers, texts or None ("does not apply"), and the description of each column.

    Attributes
    ----------
    holds : whether the claim holds, one entry per row; None if the row cannot decide; empty if
        nothing is judged
    digits : significant digits in print; note : text printed below the table
    kinds : which columns are conditions, parts, times ...
    """

    columns: tuple[Column, ...]
    rows: tuple[tuple[Any, ...], ...] = ()
    holds: tuple[bool | None, ...] = ()
    digits: int = 3
    note: str = ""
    kinds: Columns = Columns()

    def __getitem__(self, key: str) -> list[Any]:
        """Return the values of one column."""
        index = self.keys.index(key)
        return [row[index] for row in self.rows]

    def records(self) -> list[dict[str, Any]]:
        """Return the rows as dictionaries by key."""
        return [dict(zip(self.keys, row, strict=True)) for row in self.rows]

    def by_title(self) -> list[dict[str, Any]]:
        """Return the rows as dictionaries by title, as a `Check` returns them."""
        return [dict(zip(self.titles, row, strict=False)) for row in self.rows]

    def only(self, kept: Iterable[bool]) -> Table:
        """Return the rows whose entry in `kept` is true, with their outcomes."""
        chosen = [k for k, keep in enumerate(kept) if keep]
        holds = tuple(self.holds[k] for k in chosen) if self.holds else ()
        return replace(self, rows=tuple(self.rows[k] for k in chosen), holds=holds)

    def where(self, **values: Any) -> Table:
        """Return the rows in which the named columns have these values."""
        return self.only(
            all(row[key] == value for key, value in values.items()) for row in self.records()
        )

    def select(self, keys: Sequence[str]) -> Table:
        """Return the table with these columns, in this order."""
        at = [self.keys.index(key) for key in keys]
        kept = tuple(tuple(row[k] for k in at) for row in self.rows)
        return replace(self, columns=tuple(self.columns[k] for k in at), rows=kept)

    def judged(self, holds: Callable[[dict[str, Any]], bool | None]) -> Table:
        """Return the table with the outcome `holds(row)` of every row."""
        return replace(self, holds=tuple(holds(row) for row in self.records()))

    @property
    def decided(self) -> list[bool]:
        """The outcomes of the rows that have one."""
        return [outcome for outcome in self.holds if outcome is not None]

    @property
    def passed(self) -> bool | None:
        """Whether the claim holds in every row with an outcome; None if no row has one."""
        return all(self.decided) if self.decided else None

    @property
    def keys(self) -> list[str]:
        """Keys of the columns."""
        return [column.key for column in self.columns]

    @property
    def titles(self) -> tuple[str, ...]:
        """Printed headings; the heading of the outcomes comes last."""
        return (*(column.title for column in self.columns), *([HOLDS] if self.holds else ()))

    @property
    def cells(self) -> tuple[tuple[Any, ...], ...]:
        """Printed rows; if the table has outcomes, each row ends with its outcome in words."""
        if not self.holds:
            return self.rows
        return tuple((*row, WORDS[held]) for row, held in zip(self.rows, self.holds, strict=True))

    def of_kind(self, names: Collection[str]) -> list[Column]:
        """Return the columns that are named, by key or title."""
        return [one for one in self.columns if one.key in names or one.title in names]

    @property
    def timed(self) -> tuple[str, ...]:
        """Titles of the timed columns; the outcomes are included, since they may depend on any
        measured value."""
        found = tuple(column.title for column in self.of_kind(self.kinds.timed))
        return (*found, HOLDS) if found and self.holds else found

    @property
    def prose(self) -> tuple[str, ...]:
        """Titles of the columns of sentences."""
        return tuple(column.title for column in self.of_kind(self.kinds.prose))


def titled(
    titles: Sequence[str],
    rows: Iterable[Sequence[Any]] = (),
    digits: int = 3,
    note: str = "",
    kinds: Columns = Columns(),
) -> Table:
    """Return a table from titles such as "step [ms]": the brackets hold the unit; the rest is the
    key."""
    columns = tuple(column_of(title) for title in titles)
    return Table(columns, tuple(tuple(row) for row in rows), (), digits, note, kinds)


def table_from(rows: Iterable[Row], **more: Any) -> Table:
    """Return a table of dictionaries whose keys carry the unit; they are the columns, in the order
    of appearance.

    A row without a value has None in its place. `more` are other arguments of `titled`.
    """
    given = list(rows)
    titles = dict.fromkeys(title for row in given for title in row if title != HOLDS)
    return titled(tuple(titles), ([row.get(title) for title in titles] for row in given), **more)


def column_of(title: str) -> Column:
    """Return the column of a title such as "step [ms]"."""
    match = _UNIT.match(title)
    return Column(match["key"], match["unit"]) if match else Column(title)


def by_part(table: Table) -> dict[str, Table]:
    """Return the rows of each part by the part's name; a table without parts has one part named
    ""."""
    marked = [column.key for column in table.of_kind(table.kinds.parts)]
    names = [", ".join(row[key] for key in marked) for row in table.records()]
    return {part: table.only(name == part for name in names) for part in dict.fromkeys(names)} or {
        "": table
    }

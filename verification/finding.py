"""Finding: what a study found, the one record that every study returns and that reports store and print.

A Finding answers a question by a sentence with its number, a verdict, the parts that were judged, and the tables
behind them. A case that raises costs its own row: `attempt` records it as a Failure and the study goes on.
Nothing here knows a page or a file.
"""

from __future__ import annotations

import re
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from iapb.errors import ArgumentError
from iapb.names import one_of

Case = TypeVar("Case")
Result = TypeVar("Result")
Row = Mapping[str, Any]

# WHERE: every trial inside a region that `Part.region` names holds. MIXED: some hold, and no region is confirmed.
REPRODUCED, WHERE, MIXED, REFUTED, NOT_TESTABLE, NOT_COMPUTED = VERDICTS = (
    "reproduced", "reproduced where", "mixed", "refuted", "not testable here", "not computed in this run",
)  # fmt: skip
LIMITED = MIXED
# What fails in more trials than it holds in is refuted, not "true with exceptions".
LEAST_SHARE = 0.5
# What is unknown of one part keeps the whole from being reproduced.
WORST_FIRST = (REFUTED, MIXED, NOT_COMPUTED, NOT_TESTABLE, WHERE, REPRODUCED)
DEPTHS = ("quick", "full")
HOLDS = "holds"  # heading of the outcomes, where a table is printed
WORDS = {True: "yes", False: "no", None: "cannot tell"}  # of an outcome
FAILED_CASES = "not computed"  # name of the table of cases that failed
_UNIT = re.compile(r"^(?P<key>.*\S) \[(?P<unit>[^\[\]]+)\]$")


@dataclass(frozen=True)
class Column:
    """One quantity of every row.

    key : by which code finds it; heading : in words, by default the key; unit : empty where there is none
    condition : chosen, not measured; part : rows with the same value are judged apart
    timed : a measured time, or made from some: it need not repeat
    prose : sentences, whose numbers stand in other tables and are compared there
    """

    key: str
    unit: str = ""
    heading: str = ""
    condition: bool = False
    part: bool = False
    timed: bool = False
    prose: bool = False

    @property
    def title(self) -> str:
        """Heading with its unit."""
        words = self.heading or self.key
        return f"{words} [{self.unit}]" if self.unit else words


@dataclass(frozen=True)
class Table:
    """Rows of numbers, texts or None ("does not apply"), with what each column is.

    holds : per row, whether what is claimed held; None where the row cannot tell; empty where nothing is judged
    digits : significant digits in print; note : printed below
    timed_rows : which rows there are depends on measured times
    """

    columns: tuple[Column, ...]
    rows: tuple[tuple[Any, ...], ...] = ()
    holds: tuple[bool | None, ...] = ()
    digits: int = 4
    note: str = ""
    timed_rows: bool = False

    def column(self, key: str) -> list[Any]:
        """Return the values of one column."""
        index = self.keys.index(key)
        return [row[index] for row in self.rows]

    def records(self) -> list[dict[str, Any]]:
        """Return the rows as dictionaries by key."""
        return [dict(zip(self.keys, row, strict=True)) for row in self.rows]

    def where(self, **values: Any) -> Table:
        """Return the rows in which the named columns have these values."""
        return self._only([all(row[key] == value for key, value in values.items()) for row in self.records()])

    def that(self, outcome: bool | None) -> Table:
        """Return the rows with this outcome."""
        return self._only([held is outcome for held in self.holds])

    def select(self, keys: Sequence[str]) -> Table:
        """Return the table with these columns, in this order."""
        at = [self.keys.index(key) for key in keys]
        kept = tuple(tuple(row[k] for k in at) for row in self.rows)
        return replace(self, columns=tuple(self.columns[k] for k in at), rows=kept)

    def judged(self, holds: Callable[[dict[str, Any]], bool | None]) -> Table:
        """Return the table with the outcome of every row."""
        return replace(self, holds=tuple(holds(row) for row in self.records()))

    def without(self, *keys: str) -> Table:
        """Return the table without these columns."""
        return self.select([key for key in self.keys if key not in keys])

    @property
    def passed(self) -> bool | None:
        """Whether every row that can tell holds; None where none can."""
        decided = [outcome for outcome in self.holds if outcome is not None]
        return all(decided) if decided else None

    @property
    def keys(self) -> list[str]:
        """Key of each column."""
        return [column.key for column in self.columns]

    @property
    def titles(self) -> tuple[str, ...]:
        """Headings in print, the outcomes' last."""
        return (*(column.title for column in self.columns), *([HOLDS] if self.holds else ()))

    @property
    def cells(self) -> tuple[tuple[Any, ...], ...]:
        """Rows in print: each with its outcome in words, where there are outcomes."""
        if not self.holds:
            return self.rows
        return tuple((*row, WORDS[held]) for row, held in zip(self.rows, self.holds, strict=True))

    @property
    def timed(self) -> tuple[str, ...]:
        """Titles of what need not repeat; an outcome rests on all that is measured."""
        found = tuple(column.title for column in self.columns if column.timed)
        return (*found, HOLDS) if found and self.holds else found

    @property
    def prose(self) -> tuple[str, ...]:
        """Titles of the columns of sentences."""
        return tuple(column.title for column in self.columns if column.prose)

    def _only(self, kept: Sequence[bool]) -> Table:
        rows = tuple(row for row, keep in zip(self.rows, kept, strict=True) if keep)
        return replace(self, rows=rows, holds=tuple(h for h, keep in zip(self.holds, kept, strict=False) if keep))


def table_of(columns: Sequence[Column], records: Iterable[Row], **options: Any) -> Table:
    """Return a table of these columns from dictionaries; what a dictionary lacks is None."""
    rows = tuple(tuple(record.get(column.key) for column in columns) for record in records)
    return Table(tuple(columns), rows, **options)


def titled(
    titles: Sequence[str], rows: Iterable[Sequence[Any]] = (), digits: int = 4, note: str = "",
    timed: Sequence[str] = (), timed_rows: bool = False, prose: Sequence[str] = (),
) -> Table:
    """Return a table from titles such as "step [ms]": the unit in brackets, the rest is key and heading.

    `timed` and `prose` name some of the titles.
    """
    for kind, names in (("timed", timed), ("prose", prose)):
        if unknown := [name for name in names if name not in titles]:
            raise ValueError(f"{kind} columns {unknown}: expected some of {tuple(titles)}")
    found = [(_UNIT.match(title), title) for title in titles]
    columns = tuple(
        Column(match["key"] if match else title, match["unit"] if match else "",
               timed=title in timed, prose=title in prose)
        for match, title in found
    )  # fmt: skip
    return Table(columns, tuple(tuple(row) for row in rows), (), digits, note, timed_rows)


@dataclass(frozen=True)
class Part:
    """A part of the answer that is judged by itself.

    name : where the parts of one question are told apart; sentence : what was found, with its number
    held, decided : trials in which it held, of those that could tell; fails : the conditions of those that fail
    timed : measured times are in it
    """

    sentence: str
    verdict: str
    name: str = ""
    held: int = 0
    decided: int = 0
    fails: str = ""
    timed: bool = False


@dataclass(frozen=True)
class Failure:
    """A case that could not be computed.

    case : the case, as its row is named
    error : type of the exception; reason : first line of its message
    traceback : where it was raised
    """

    case: str
    error: str
    reason: str
    traceback: str = ""


@dataclass(frozen=True)
class Finding:
    """What a study found.

    key : of the question, such as "C07" or "mechanics"; title : its heading
    question : what is asked, and how; answer : what was found, in one sentence with its number
    verdict : one of VERDICTS; parts : what it was made from
    tables : by name; a figure asks for one as "<key>/<name>"
    details : what else a reader needs, by label (place, tolerance, source, law ...)
    axes : keys of the columns over which the outcome is best drawn: across, up, and what splits the maps
    failures : the cases that raised; their rows are missing from the tables
    timed : the verdict or the answer rests on measured times
    """

    key: str
    title: str
    question: str
    answer: str
    verdict: str
    parts: tuple[Part, ...] = ()
    tables: Mapping[str, Table] = field(default_factory=dict)
    details: Mapping[str, str] = field(default_factory=dict)
    axes: tuple[str, ...] = ()
    failures: tuple[Failure, ...] = ()
    timed: bool = False

    @property
    def computed(self) -> bool:
        """Whether anything was found."""
        return self.verdict != NOT_COMPUTED


def check_depth(depth: str) -> None:
    """Raise ArgumentError unless the depth is one of DEPTHS."""
    if depth not in DEPTHS:
        raise ArgumentError("depth", depth, one_of(depth, DEPTHS))


def worst(verdicts: Iterable[str]) -> str:
    """Return the worst of some verdicts; NOT_COMPUTED for none."""
    return min(verdicts, key=WORST_FIRST.index, default=NOT_COMPUTED)


def verdict_of_trials(holds: Iterable[bool | None]) -> str:
    """Return the verdict on something that was tried many times, from the outcomes of its trials.

    All that can tell hold: reproduced. At least LEAST_SHARE of them: mixed. Fewer: refuted. None can tell: not
    testable here. "Reproduced where" takes a region: see `search_region`.
    """
    decided = [outcome for outcome in holds if outcome is not None]
    if not decided:
        return NOT_TESTABLE
    share = sum(decided) / len(decided)
    if share == 1.0:
        return REPRODUCED
    return MIXED if share >= LEAST_SHARE else REFUTED


def verdict_of_law(holds: Iterable[bool | None]) -> str:
    """Return the verdict on a law from its trials: one that fails refutes it."""
    found = verdict_of_trials(holds)
    return REFUTED if found == MIXED else found


def verdict_of(parts: Iterable[Part], failures: Sequence[Failure] = ()) -> str:
    """Return the verdict of a finding: that of its worst part. What failed never counts as holding."""
    found = worst(part.verdict for part in parts)
    return NOT_COMPUTED if failures and found == REPRODUCED else found


def with_failures(finding: Finding, failures: Sequence[Failure]) -> Finding:
    """Return the finding with cases that failed: a part, a table of reasons, and a word in its answer."""
    if not failures:
        return finding
    every, count = (*finding.failures, *failures), len(failures)
    said = "One case failed and is" if count == 1 else f"{count} cases failed and are"
    part = Part(f"{said} in no other number: {', '.join(failure.case for failure in failures)}.", NOT_COMPUTED)
    table = titled(("case", "error", "reason"), [(one.case, one.error, one.reason) for one in every])
    return replace(
        finding, parts=(*finding.parts, part), tables={**finding.tables, FAILED_CASES: table}, failures=every,
        answer=f"{finding.answer} {count} {'case' if count == 1 else 'cases'} failed.".strip(),
        verdict=NOT_COMPUTED if finding.verdict == REPRODUCED else finding.verdict,
    )  # fmt: skip


def finding_of(
    key: str, title: str, question: str, answer: str, parts: Iterable[Part],
    tables: Mapping[str, Table] | None = None, failures: Sequence[Failure] = (),
) -> Finding:  # fmt: skip
    """Return the finding that parts make: the verdict of the worst of them, timed where one is, with what failed."""
    parts = tuple(parts)
    timed = any(part.timed for part in parts)
    made = Finding(key, title, question, answer, verdict_of(parts), parts, tables or {}, timed=timed)
    return with_failures(made, failures)


def failure_of(case: str, error: Exception) -> Failure:
    """Return the record of an exception."""
    reason = (str(error).splitlines() or ["no reason given"])[0]
    return Failure(case, type(error).__name__, reason, "".join(traceback.format_exception(error)))


def attempt(case: str, compute: Callable[[], Result], failures: list[Failure] | None) -> Result | None:
    """Return compute(), or append a Failure and return None where it raises an Exception.

    Without a list of failures the exception passes through.

    An interrupt (KeyboardInterrupt, SystemExit) is no failure of the case and passes through.
    """
    try:
        return compute()
    except Exception as error:
        if failures is None:
            raise
        failures.append(failure_of(case, error))
        return None


def of_each(
    cases: Iterable[Case], results: Callable[[Case], Iterable[Result]], failures: list[Failure] | None,
    name: Callable[[Case], str] | None = None,
) -> Iterator[Result]:
    """Yield the results of each case; one that raises is a Failure of that name, and yields none."""
    for case in cases:

        def listed(case: Case = case) -> list[Result]:
            return list(results(case))

        yield from attempt(name(case) if name else _words(case), listed, failures) or ()


def _words(case: Any) -> str:
    """A case in words: the parts of a tuple, with their names where it has names."""
    if not isinstance(case, tuple):
        return str(case)
    names = getattr(case, "_fields", ())
    return ", ".join([f"{name} {part}" for name, part in zip(names, case, strict=True)] if names else map(_words, case))

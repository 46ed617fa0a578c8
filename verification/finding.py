"""Finding: the record that every study returns and that reports store and print.

A Finding answers a question by a sentence with a number, a verdict, the parts that were judged, and the tables with
the data. If a case raises an exception, `attempt` records a Failure, the table lacks that row, and the study goes on.
This module is independent of pages and files.
"""

from __future__ import annotations

import math
import re
import traceback
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any, TypeVar

import numpy as np

from iapb.errors import ArgumentError
from iapb.names import one_of

Case = TypeVar("Case")
Result = TypeVar("Result")
Row = Mapping[str, Any]

# WHERE: the claim holds in every trial inside `Part.region`. MIXED: it holds in some trials; no region is confirmed.
REPRODUCED, WHERE, MIXED, REFUTED, NOT_TESTABLE, NOT_COMPUTED = VERDICTS = (
    "reproduced", "reproduced where", "mixed", "refuted", "not testable here", "not computed in this run",
)  # fmt: skip
# A claim that fails in more trials than it holds in is refuted, not "true with exceptions".
LEAST_SHARE = 0.5
# Least number of trials that confirm a region or reproduce a part. If the claim were wrong in a quarter of the region,
# ten trials in a row would hold with probability 0.05 (0.74¹⁰); if it were wrong in half, with probability 1/1024. A
# single failure counts.
LEAST_CONFIRMING = LEAST_DECIDED = 10
SPLIT_SEED = 20050601  # decides which half of the trials is searched; the month the paper appeared
_MOST_ENDS = 8  # above the number of ends of two intervals
_DECADES = 1e3  # a condition with a larger ratio of its ends is measured in decades
_LISTED = 8  # if there are more values, only the smallest and largest are printed
# A finding is reproduced only if every part is decided.
WORST_FIRST = (REFUTED, MIXED, NOT_COMPUTED, NOT_TESTABLE, WHERE, REPRODUCED)
DEPTHS = ("quick", "full")
HOLDS = "holds"  # heading of the outcomes in printed tables
WORDS = {True: "yes", False: "no", None: "cannot tell"}  # words for the outcomes
FAILED_CASES = "not computed"  # name of the table of cases that failed
# Quantities that several pages quote: in a report each has one value and one verdict. To add one, add its name here;
# the Part or Finding whose sentence quotes it lists the name with the value as printed.
QUANTITIES = ("impacts certified", "adverse impacts certified", "time of a peg step", "exponent of bodies",
              "hard cases of the engine", "speed targets")  # fmt: skip
Quantities = tuple[tuple[str, str], ...]  # names and values
_UNIT = re.compile(r"^(?P<key>.*\S) \[(?P<unit>[^\[\]]+)\]$")


@dataclass(frozen=True)
class Column:
    """One quantity of every row.

    key : name of the column in code; heading : printed name, by default the key; unit : empty if there is none
    condition : True if the study chooses the value, False if it measures it
    part : True if the rows with the same value form one part, which is judged separately
    cases : True if the value counts the cases of a row, such as the impacts of a batch whose worst one is judged
    timed : True for a measured time or a value computed from one; it may differ in the next run
    prose : True for sentences; the numbers in them are compared through other tables
    """

    key: str
    unit: str = ""
    heading: str = ""
    condition: bool = False
    part: bool = False
    cases: bool = False
    timed: bool = False
    prose: bool = False

    @property
    def title(self) -> str:
        """The heading with the unit."""
        words = self.heading or self.key
        return f"{words} [{self.unit}]" if self.unit else words


@dataclass(frozen=True)
class Table:
    """Rows of numbers, texts or None ("does not apply"), and the description of each column.

    holds : whether the claim holds, one entry per row; None if the row cannot decide; empty if nothing is judged
    digits : significant digits in print; note : text printed below the table
    timed_rows : True if the selection of rows depends on measured times
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
        return self.only([all(row[key] == value for key, value in values.items()) for row in self.records()])

    def that(self, outcome: bool | None) -> Table:
        """Return the rows with this outcome."""
        return self.only([held is outcome for held in self.holds])

    def select(self, keys: Sequence[str]) -> Table:
        """Return the table with these columns, in this order."""
        at = [self.keys.index(key) for key in keys]
        kept = tuple(tuple(row[k] for k in at) for row in self.rows)
        return replace(self, columns=tuple(self.columns[k] for k in at), rows=kept)

    def judged(self, holds: Callable[[dict[str, Any]], bool | None]) -> Table:
        """Return the table with the outcome `holds(row)` of every row."""
        return replace(self, holds=tuple(holds(row) for row in self.records()))

    def without(self, *keys: str) -> Table:
        """Return the table without these columns."""
        return self.select([key for key in self.keys if key not in keys])

    @property
    def passed(self) -> bool | None:
        """Whether the claim holds in every row with an outcome; None if no row has one."""
        decided = [outcome for outcome in self.holds if outcome is not None]
        return all(decided) if decided else None

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

    @property
    def timed(self) -> tuple[str, ...]:
        """Titles of the timed columns; the outcomes are included, since they may depend on any measured value."""
        found = tuple(column.title for column in self.columns if column.timed)
        return (*found, HOLDS) if found and self.holds else found

    @property
    def prose(self) -> tuple[str, ...]:
        """Titles of the columns of sentences."""
        return tuple(column.title for column in self.columns if column.prose)

    def only(self, kept: Iterable[bool]) -> Table:
        """Return the rows whose entry in `kept` is true, with their outcomes."""
        kept = list(kept)
        rows = tuple(row for row, keep in zip(self.rows, kept, strict=True) if keep)
        return replace(self, rows=rows, holds=tuple(h for h, keep in zip(self.holds, kept, strict=False) if keep))


def table_of(columns: Sequence[Column], records: Iterable[Row], **options: Any) -> Table:
    """Return a table of these columns from dictionaries; missing keys become None."""
    rows = tuple(tuple(record.get(column.key) for column in columns) for record in records)
    return Table(tuple(columns), rows, **options)


def titled(
    titles: Sequence[str], rows: Iterable[Sequence[Any]] = (), digits: int = 4, note: str = "",
    timed: Sequence[str] = (), timed_rows: bool = False, prose: Sequence[str] = (),
) -> Table:
    """Return a table from titles such as "step [ms]": the brackets hold the unit; the rest is key and heading.

    `timed` and `prose` list the titles of the timed columns and of the columns of sentences.
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
class Region:
    """Region in which a part holds: bounds on one or two conditions. The claim holds in every trial inside.

    bounds : condition, its unit, lowest and highest value; None if the region extends to the end of the tested range
    searched : number of trials inside, from the half in which the region was found; others : from the other half
    fresh : number of trials drawn for the confirmation
    share : share of the tested range that the region covers, by length or by decades
    """

    bounds: tuple[tuple[str, str, float | None, float | None], ...]
    searched: int = 0
    others: int = 0
    fresh: int = 0
    share: float = 0.0

    def contains(self, row: Row) -> bool:
        """Whether a trial lies inside the region or on its bounds."""
        return all((low is None or row[key] >= low) and (high is None or row[key] <= high)
                   for key, _, low, high in self.bounds)  # fmt: skip

    def ends(self, key: str, tested: Sequence[float]) -> tuple[float, float]:
        """Return the bounds of a condition; the end of the tested range replaces a missing bound."""
        low, high = next(((low, high) for name, _, low, high in self.bounds if name == key), (None, None))
        return min(tested) if low is None else low, max(tested) if high is None else high

    def __str__(self) -> str:
        """The bounds, such as "tilt <= 0.015 rad"."""
        return " and ".join(_bound(*bound) for bound in self.bounds)


@dataclass(frozen=True)
class Part:
    """A part of the answer, judged separately.

    name : distinguishes the parts of one question; sentence : the result, with its number
    held, decided : trials in which the claim held, and trials that had an outcome; unknown : trials without one
    cases : number of cases in the decided trials, if it is below LEAST_DECIDED
    region : region in which the part is reproduced, if the verdict is WHERE; fails : conditions of the failed trials
    timed : True if measured times enter
    optional : True if the part needs software that the project does not include; the other parts decide without it
    miss : one short clause for the first page that says where our method falls short; otherwise ""
    quantities : the QUANTITIES that the sentence quotes, each with its value as printed there
    """

    sentence: str
    verdict: str
    name: str = ""
    held: int = 0
    decided: int = 0
    unknown: int = 0
    region: Region | None = None
    fails: str = ""
    timed: bool = False
    optional: bool = False
    cases: int = 0
    miss: str = ""
    quantities: Quantities = ()

    def __post_init__(self) -> None:
        check_quantities(self.quantities, self.sentence)

    @property
    def outcome(self) -> str:
        """The verdict in words, with the region if there is one."""
        return f"{self.verdict} {self.region}" if self.region else self.verdict


@dataclass(frozen=True)
class Failure:
    """A case that could not be computed.

    case : name of the case, as in its table row
    error : type of the exception; reason : first line of its message
    traceback : the Python traceback
    """

    case: str
    error: str
    reason: str
    traceback: str = ""


@dataclass(frozen=True)
class Finding:
    """The result of a study.

    key : name of the question, such as "C07" or "mechanics"; title : heading of the question
    question : the question and the method; answer : the result, in one sentence with its number
    verdict : one of VERDICTS; parts : the parts that give the verdict
    tables : the data, by name; a figure refers to a table as "<key>/<name>"
    details : further information by label (place, tolerance, source, law ...)
    axes : keys of the columns for a map of the outcome: horizontal axis, vertical axis, and one map per value
    failures : the cases that raised an exception; the tables lack their rows
    timed : True if the verdict or the answer depends on measured times
    quantities : the QUANTITIES that the answer quotes, each with its value as printed there
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
    quantities: Quantities = ()

    def __post_init__(self) -> None:
        check_quantities(self.quantities, self.answer)

    @property
    def computed(self) -> bool:
        """Whether the study gave a result."""
        return self.verdict != NOT_COMPUTED

    @property
    def miss(self) -> str:
        """The clauses of all parts that say where our method falls short; "" if there is none."""
        return "; ".join(part.miss for part in self.parts if part.miss)


def check_quantities(quantities: Quantities, sentence: str) -> None:
    """Raise ArgumentError unless each quantity is one of QUANTITIES and the sentence contains its value."""
    for name, value in quantities:
        if name not in QUANTITIES:
            raise ArgumentError("quantity", name, one_of(name, QUANTITIES))
        if not said_as(value).search(sentence):
            raise ArgumentError(f"value of the quantity {name!r}", value, f"a number that is part of: {sentence}")


def said_as(value: str) -> re.Pattern[str]:
    """Return a pattern that matches the value in a sentence, but not as a piece of a longer number."""
    return re.compile(rf"(?<![\w.,]){re.escape(value)}(?!\w|[.,]\d)")


def check_depth(depth: str) -> None:
    """Raise ArgumentError unless the depth is one of DEPTHS."""
    if depth not in DEPTHS:
        raise ArgumentError("depth", depth, one_of(depth, DEPTHS))


def worst(verdicts: Iterable[str]) -> str:
    """Return the worst verdict; NOT_COMPUTED if there is none."""
    return min(verdicts, key=WORST_FIRST.index, default=NOT_COMPUTED)


def verdict_of_trials(holds: Iterable[bool | None]) -> str:
    """Return the verdict on a claim from the outcomes of many trials.

    Only trials with an outcome count. The claim is reproduced if it holds in all of them, mixed if it holds in at least
    the share LEAST_SHARE, refuted if it holds in fewer, and not testable here if no trial has an outcome. The verdict
    "reproduced where" needs a confirmed region: see `judge_part`.
    """
    decided = [outcome for outcome in holds if outcome is not None]
    if not decided:
        return NOT_TESTABLE
    share = sum(decided) / len(decided)
    if share == 1.0:
        return REPRODUCED
    return MIXED if share >= LEAST_SHARE else REFUTED


def verdict_of_law(holds: Iterable[bool | None]) -> str:
    """Return the verdict on a law from its trials: a single failure refutes the law."""
    found = verdict_of_trials(holds)
    return REFUTED if found == MIXED else found


def judge_part(name: str, trials: Table, fresh: Callable[[Region], Table] | None = None) -> Part:
    """Return the verdict on the trials of one part.

    A mixed part becomes "reproduced where" if a region is confirmed. The region is found on one half of the trials; the
    claim must hold in all trials of the other half that lie inside the region, and in all that `fresh` draws inside. At
    least LEAST_CONFIRMING trials must confirm the region: fresh trials if they can be drawn, else those of the other
    half. If all trials hold but fewer than LEAST_DECIDED cases have an outcome, the part is not testable here. A part
    with failures is mixed or refuted, however few trials there are.
    """
    verdict, timed = verdict_of_trials(trials.holds), any(column.timed for column in trials.columns)
    held, decided = trials.holds.count(True), sum(outcome is not None for outcome in trials.holds)
    part = Part("", verdict, name, held, decided, len(trials.rows) - decided, None, _where_it_fails(trials), timed)
    said = _count(part)
    if verdict == MIXED:
        region, tried = _confirmed(trials, fresh)
        part = replace(part, region=region, verdict=WHERE if region else MIXED)
        said = f"{said}; {tried}"
    cases = _decided_cases(trials)
    if decided < LEAST_DECIDED <= cases:
        part = replace(part, cases=cases)
        said = f"{said}, which stand for {cases} cases"
    elif 0 < cases < LEAST_DECIDED and part.verdict != WHERE:
        part = replace(part, verdict=NOT_TESTABLE if part.verdict == REPRODUCED else part.verdict)
        said = f"{said}; fewer than {LEAST_DECIDED} decide"
    return replace(part, sentence=f"{said}.")


def _decided_cases(trials: Table) -> int:
    """Number of cases in the trials that have an outcome."""
    decided = trials.only(held is not None for held in trials.holds)
    counts = [column.key for column in trials.columns if column.cases]
    return max(len(decided.rows), *(sum(count or 0 for count in decided.column(key)) for key in counts), 0)


def verdict_of(parts: Iterable[Part], failures: Sequence[Failure] = ()) -> str:
    """Return the verdict of a finding: that of its worst part. A failed case never counts as holding.

    An optional part without any decided trial counts only if there is no other part.
    """
    given = list(parts)
    absent = [part.optional and part.verdict == NOT_TESTABLE and not part.decided for part in given]
    counted = [part for part, left_out in zip(given, absent, strict=True) if not left_out] or given
    return worst([part.verdict for part in counted] + [NOT_COMPUTED] * bool(failures))


def with_failures(finding: Finding, failures: Sequence[Failure]) -> Finding:
    """Return the finding with failed cases: this adds a part, a table of the reasons, and a clause in the answer."""
    if not failures:
        return finding
    every, count = (*finding.failures, *failures), len(failures)
    said = "One case failed and is" if count == 1 else f"{count} cases failed and are"
    part = Part(f"{said} in no other number: {', '.join(failure.case for failure in failures)}.", NOT_COMPUTED)
    table = titled(("case", "error", "reason"), [(one.case, one.error, one.reason) for one in every])
    return replace(
        finding, parts=(*finding.parts, part), tables={**finding.tables, FAILED_CASES: table}, failures=every,
        answer=f"{finding.answer} {count} {'case' if count == 1 else 'cases'} failed.".strip(),
        verdict=worst((finding.verdict, NOT_COMPUTED)),
    )  # fmt: skip


def finding_of(
    key: str, title: str, question: str, answer: str, parts: Iterable[Part],
    tables: Mapping[str, Table] | None = None, failures: Sequence[Failure] = (), quantities: Quantities = (),
) -> Finding:  # fmt: skip
    """Return the finding made of `parts` and `failures`: it has the worst verdict, and is timed if any part is."""
    parts = tuple(parts)
    timed = any(part.timed for part in parts)
    made = Finding(key, title, question, answer, verdict_of(parts), parts, tables or {}, timed=timed,
                   quantities=quantities)
    return with_failures(made, failures)


def ranges(table: Table) -> str:
    """Return the conditions of a table in words: each with its values, or with its range if there are many."""
    return "; ".join(f"{column.key} {_span(table.column(column.key))} {column.unit}".rstrip()
                     for column in table.columns if column.condition and table.rows)  # fmt: skip


def search_region(trials: Table) -> Region | None:
    """Return the region, bounded in one or two conditions, with most trials and no failure; None if there is none.

    The search tries every interval between values of a condition, alone and with every interval of every other
    condition. Among regions with equally many trials it takes the one with the fewest bounds, then the first in the
    order of the columns. It adds a second condition only if the region then keeps at least 1.5 times as many trials,
    because the simpler region generalizes better.
    """
    scales = [_intervals(column, trials) for column in trials.columns if column.condition]
    scales = [scale for scale in scales if len(scale) > 1]
    alone = max((_best(trials, scale, [_Interval()]) for scale in scales), key=_kept_simply, default=(0, ()))
    pairs = (_best(trials, first, second) for first, second in combinations(scales, 2))
    together = max(pairs, key=_kept_simply, default=(0, ()))
    kept, chosen = together if 2 * together[0] >= 3 * alone[0] else alone
    if not kept or not chosen:
        return None
    share = math.prod(interval.share for interval in chosen)
    return Region(tuple((x.key, x.unit, x.low, x.high) for x in chosen), kept, share=share)


def _best(trials: Table, first: list[_Interval], second: list[_Interval]) -> tuple[int, tuple[_Interval, ...]]:
    """Number of trials that the best pair of intervals keeps without a failure, and those of the two with a bound."""
    held, failed = (np.array([outcome is wanted for outcome in trials.holds]) for wanted in (True, False))
    inside, other = (np.array([interval.inside(trials) for interval in scale]) for scale in (first, second))
    kept, wrong = ((inside & rows).astype(np.int64) @ other.T.astype(np.int64) for rows in (held, failed))
    ends = np.add.outer([interval.ends for interval in first], [interval.ends for interval in second])
    score = np.where(wrong == 0, _MOST_ENDS * kept - ends, -_MOST_ENDS)
    i, j = np.unravel_index(int(score.argmax()), score.shape)
    found = int(kept[i, j]) if wrong[i, j] == 0 else 0
    return found, tuple(interval for interval in (first[i], second[j]) if interval.ends)


def _kept_simply(found: tuple[int, tuple[_Interval, ...]]) -> tuple[int, int]:
    return found[0], -sum(interval.ends for interval in found[1])


@dataclass(frozen=True)
class _Interval:
    """Values of one condition between `low` and `high`; None means no bound on that side."""

    key: str = ""
    unit: str = ""
    low: float | None = None
    high: float | None = None
    share: float = 1.0

    @property
    def ends(self) -> int:
        return (self.low is not None) + (self.high is not None)

    def inside(self, trials: Table) -> np.ndarray:
        if not self.key:
            return np.ones(len(trials.rows), np.bool_)
        values = np.array(trials.column(self.key), float)
        return (values >= (-np.inf if self.low is None else self.low)) & (
            values <= (np.inf if self.high is None else self.high)
        )


def _intervals(column: Column, trials: Table) -> list[_Interval]:
    """All intervals between two values of a condition, including the unbounded one; empty if a value is no number."""
    values = trials.column(column.key)
    if not all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        return []
    seen = sorted(set(values))
    if len(seen) < 2:
        return []
    scale = math.log10 if seen[0] > 0 and seen[-1] / seen[0] >= _DECADES else float
    length = scale(seen[-1]) - scale(seen[0])
    return [
        _Interval(column.key, column.unit, low if i else None, high if j < len(seen) - 1 else None,
                  (scale(high) - scale(low)) / length)
        for i, low in enumerate(seen) for j, high in enumerate(seen) if i < j
    ]  # fmt: skip


def _confirmed(trials: Table, fresh: Callable[[Region], Table] | None) -> tuple[Region | None, str]:
    """The region that the other half and fresh trials confirm, and the result of the search in words.

    If the other half contradicts the region, both halves are searched; then only fresh trials can confirm a region.
    """
    first = np.zeros(len(trials.rows), np.bool_)
    first[np.random.default_rng(SPLIT_SEED).permutation(len(trials.rows))[::2]] = True
    region = search_region(trials.only(first))
    inside = trials.only(not searched and region is not None and region.contains(row)
                         for searched, row in zip(first, trials.records(), strict=True))  # fmt: skip
    if region is None or False in inside.holds:
        contradicted = f"{region} fails in {_failing(inside)} other trials" if region else ""
        region, inside = (search_region(trials), trials.only(False for _ in trials.rows)) if fresh else (None, inside)
        if region is None:
            return None, f"no region confirmed: {contradicted}" if contradicted else "no region found"
    drawn = fresh(region) if fresh else inside.only(False for _ in inside.rows)
    if False in drawn.holds:
        return None, f"no region confirmed: {region} fails in {_failing(drawn)} fresh trials"
    region = replace(region, others=inside.holds.count(True), fresh=drawn.holds.count(True))
    counts = (f"{region.searched} trials that found this region, {region.others} others and {region.fresh} fresh ones "
              "hold")  # fmt: skip
    if (region.fresh if fresh else region.others) < LEAST_CONFIRMING:
        return None, f"no region confirmed: for {region} only {counts}"
    return region, f"where {region} ({region.share:.0%} of the tested range) all {counts}"


def _failing(trials: Table) -> str:
    return f"{trials.holds.count(False)} of {sum(held is not None for held in trials.holds)}"


def _count(part: Part) -> str:
    """The number of trials in which a part holds and the number without an outcome, in words."""
    told = f"holds in {part.held} of {part.decided} trials" if part.decided else "no trial can tell"
    total = part.decided + part.unknown
    return f"{told}; {part.unknown} of {total} cannot tell" if part.unknown and part.decided else told


def _where_it_fails(trials: Table) -> str:
    """The number of failed trials and their conditions, in words; "" if none failed."""
    failed = trials.that(False)
    if not failed.rows:
        return ""
    decided = sum(outcome is not None for outcome in trials.holds)
    if len(failed.rows) == decided:
        return f"in all {decided} trials"
    return f"in {len(failed.rows)} of {decided} trials, with {ranges(failed).replace('; ', ', ')}"


def _span(values: Sequence[Any]) -> str:
    found = {value for value in values if value is not None}
    if any(isinstance(value, str) for value in found):
        return ", ".join(sorted(map(str, found)))
    ordered = sorted(found)
    if len(ordered) > _LISTED:
        return f"{ordered[0]:g} to {ordered[-1]:g}"
    return ", ".join(f"{value:g}" for value in ordered)


def _bound(key: str, unit: str, low: float | None, high: float | None) -> str:
    key = key.replace("_", " ")
    if low is None:
        return f"{key} <= {high:g} {unit}".rstrip()
    return f"{key} >= {low:g} {unit}".rstrip() if high is None else f"{low:g} <= {key} <= {high:g} {unit}".rstrip()


def failure_of(case: str, error: Exception) -> Failure:
    """Return the record of an exception."""
    reason = (str(error).splitlines() or ["no reason given"])[0]
    return Failure(case, type(error).__name__, reason, "".join(traceback.format_exception(error)))


def attempt(case: str, compute: Callable[[], Result], failures: list[Failure] | None) -> Result | None:
    """Return compute(); if it raises an Exception, append a Failure to `failures` and return None.

    If `failures` is None, the exception propagates.

    KeyboardInterrupt and SystemExit always propagate, because they are no failure of the case.
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
    """Yield the results of each case; a case that raises an exception yields none and is recorded as a Failure."""
    for case in cases:

        def listed(case: Case = case) -> list[Result]:
            return list(results(case))

        yield from attempt(name(case) if name else _words(case), listed, failures) or ()


def counted(cases: Collection[Case], progress: Callable[[int, int], None]) -> Iterator[Case]:
    """Yield the cases; call `progress` with (cases done, cases) before each case and at the end."""
    for done, case in enumerate(cases):
        progress(done, len(cases))
        yield case
    progress(len(cases), len(cases))


def _words(case: Any) -> str:
    """A case in words: the entries of a tuple, with the field names of a named tuple."""
    if not isinstance(case, tuple):
        return str(case)
    names = getattr(case, "_fields", ())
    return ", ".join([f"{name} {part}" for name, part in zip(names, case, strict=True)] if names else map(_words, case))

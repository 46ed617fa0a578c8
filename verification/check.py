"""Check: a question, the cases on which it is tested, and the rule that decides each row. Topic: a
list of Checks.

Every study is one or more Checks. Its functions know only their case; the runner in this module
knows failures, progress, depth and tables. No verdict is written by hand: it follows from the
outcomes of the rows.

- `Check.finding(study)`: a claim; each part is judged, a region is searched where a part is mixed.
- `Topic(run, depth, progress)`: a topic of the report; each check gives a table and its parts.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from types import MappingProxyType
from typing import Any, TypeVar, cast

from iapb.errors import ArgumentError
from iapb.names import one_of
from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene
from reference.worlds import run_world
from verification.finding import (
    BEYOND,
    DESIGN,
    MISPRINT,
    NOT_COMPUTED,
    REFUTED,
    REPRODUCED,
    Failure,
    Finding,
    Part,
    attempt,
    counts_of,
    finding_of,
    judge_part,
    of_each,
    verdict_of_law,
)
from verification.numbers import Values, value_tables
from verification.proofs import check as check_proof
from verification.region import Region
from verification.table import HOLDS, Columns, Row, Table, by_part, table_from

Case = TypeVar("Case")
Result = TypeVar("Result")

DEPTHS = ("quick", "full")
SEED = 20050601  # of random impacts and conditions: the month in which the paper appeared


@dataclass
class Study:
    """What the functions of a check get: runs, the depth, the seed, and results that several checks
    share.

    Attributes
    ----------
    run : (scene, world, rendering) -> Run, made now or read from a store
    depth : "quick" or "full"; "full" has more cases
    seed : of random impacts and of fresh conditions
    simulate : as `run`, but never stored: for fresh cases, and for runs that take less time than
        their file; by default `run`
    part : the part that fresh cases decide; "" for all
    asked : called whenever a check uses a run, even if an earlier check made that run
    failures : receives the cases that raise an exception; if it is None, the exceptions propagate
    """

    run: Callable[..., Run] = run_world
    depth: str = "quick"
    seed: int = SEED
    simulate: Callable[..., Run] | None = None
    part: str = ""
    asked: Callable[[Scene, str, str], None] | None = None
    failures: list[Failure] | None = None
    results: dict[Hashable, Any] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        if self.depth not in DEPTHS:
            raise ArgumentError("depth", self.depth, one_of(self.depth, DEPTHS))
        self.simulate = self.simulate or self.run

    def once(self, key: Hashable, compute: Callable[[], Result]) -> Result:
        """Return the result of `compute`, which is called only once for each key."""
        if key not in self.results:
            self.results[key] = compute()
        return cast(Result, self.results[key])

    def table(self, check: Check) -> Table:
        """Return the table of a check, which is made only once; another check may show what follows
        from it."""
        return self.once(("table", check.key), lambda: check.table(self))

    def scene(self, name: str) -> Scene:
        """Return a scene of the project by name."""
        return self.once(("scene", name), lambda: load_scene(find_scene(name)))

    def each(
        self, cases: Iterable[Case], results: Callable[[Case], Iterable[Result]]
    ) -> Iterator[Result]:
        """Yield the results of each case; a case that raises is added to `failures` if that list is
        given."""
        return of_each(cases, results, self.failures)


@dataclass(frozen=True, kw_only=True)
class Check:
    """A question with the cases that answer it.

    Attributes
    ----------
    key : name of the check and of its table; question : what is claimed or asked, in one sentence
    cases : study -> the cases to test
    row : (study, case) -> the row of a case, or several rows. The keys of a row carry the unit,
        such as "error [m]"; they are the columns of the table, in the order of their first
        appearance
    holds : one row -> True, False, or None if the row cannot decide; a pure function of the row,
        whose keys here lack the unit. Without it a row may have the key "holds"; without either,
        nothing is judged
    targets : table -> a `Part.on` for each number of a topic that has a target; each decides alone
    columns : which columns are conditions, which split the rows into parts, which are times ...
    roles : for a part, or a value of a column of parts: MISPRINT or BEYOND if it is not the
        statement of the question; or the statement of `verification.proofs` that proves it, if the
        code forbids a failure
    draw : (study, region) -> fresh cases inside a region, which confirm it; None if there are no
        fresh cases
    """

    key: str
    question: str
    cases: Callable[[Study], Iterable[Any]]
    row: Callable[[Study, Any], Row | Iterable[Row]]
    holds: Callable[[Row], bool | None] | None = None
    targets: Callable[[Table], Iterable[Part]] | None = None
    columns: Columns = Columns()
    roles: Mapping[str, str] = field(default_factory=dict, hash=False)
    draw: Callable[[Study, Region], Iterable[Any]] | None = None

    def table(self, study: Study, cases: Iterable[Any] | None = None) -> Table:
        """Return the judged rows of the given cases; by default of all cases."""
        return self.table_of(self._rows(study, self.cases(study) if cases is None else cases))

    def _rows(self, study: Study, cases: Iterable[Any]) -> Iterator[Row]:
        def rows(case: Any) -> Iterable[Row]:
            found = self.row(study, case)
            return (found,) if isinstance(found, Mapping) else found

        return study.each(cases, rows)

    def table_of(self, rows: Iterable[Row]) -> Table:
        """Return the judged table of these rows; a row without a value has None in its place."""
        given = list(rows)
        table = table_from(given, kinds=self.columns)
        if self.holds is not None:
            return table.judged(self.holds)
        known = any(HOLDS in row for row in given)
        return replace(table, holds=tuple(row.get(HOLDS) for row in given)) if known else table

    def finding(self, study: Study) -> Finding:
        """Measure and judge all rows and return the finding on a claim; fresh cases confirm its
        regions."""
        return self.conclude(self.table(study), study)

    def conclude(self, table: Table, study: Study | None = None) -> Finding:
        """Return the finding on a claim from its judged table; without a study it draws no fresh
        cases."""
        parts = []
        for name, rows in by_part(table).items():
            role = _of_part(self.roles, name)
            judged = judge_part(name, rows, None if role else self._fresh(study, name))
            if role in (MISPRINT, BEYOND):
                judged = replace(judged, role=role)
            elif role:  # the statement that proves it
                judged = proved(judged, role)
            parts.append(judged)
        return self._found(parts, table)

    def not_computed(self) -> Finding:
        """Return the finding on a claim without any row."""
        return self._found([Part("Not computed.", NOT_COMPUTED)], self.table_of(()))

    def _found(self, parts: Iterable[Part], table: Table) -> Finding:
        return finding_of(self.key, self.key, self.question, parts, {self.key: table})

    def _fresh(self, study: Study | None, name: str) -> Callable[[Region], Table] | None:
        """Return the function that draws and judges fresh rows of a part inside a region, up to
        the first that fails."""
        draw = self.draw
        if study is None or draw is None:
            return None

        beside = replace(study, run=study.simulate or study.run, asked=None, part=name)

        def drawn(region: Region) -> Table:
            rows = list[Row]()
            found = self.table_of(rows)
            for case in draw(study, region):
                rows += self._rows(beside, [case])
                table = self.table_of(rows)
                found = by_part(table).get(name, table.only(()))
                found = found.only(region.contains(row) for row in found.records())
                if False in found.holds:
                    break
            return found

        return drawn

    def judge(self, table: Table) -> tuple[Part, ...]:
        """Return the parts of a topic: its targets, or one part on all rows; none if nothing is
        judged."""
        if self.targets is not None:
            return tuple(self.targets(table))
        if not table.holds:
            return ()
        held, decided, unknown = counts_of(table)
        verdict = verdict_of_law(table.holds)
        return (Part("", verdict, self.question, held, decided, unknown, timed=bool(table.timed)),)


def no_row_fails(name: str) -> Callable[[Table], tuple[Part, ...]]:
    """Return the targets of a check that has one: `name`, the number of rows that fail, is 0."""

    def targets(table: Table) -> tuple[Part, ...]:
        return (Part.on(name, table.holds.count(False), 0),)

    return targets


def proved(part: Part, statement: str) -> Part:
    """Return a part by DESIGN: it holds if the statement is proved, unless a trial contradicts."""
    holds = part.held == part.decided and check_proof(statement).holds
    return replace(
        part, role=DESIGN, proof=statement, verdict=REPRODUCED if holds else REFUTED, region=None
    )


def _of_part(words: Mapping[str, str], name: str) -> str:
    """Return the word for a part, whose name is the values of its columns with commas between them;
    "" if none."""
    return next((word for value, word in words.items() if f", {value}, " in f", {name}, "), "")


@dataclass(frozen=True, kw_only=True)
class Topic:
    """A section of the report: a question and the checks that answer it.

    Attributes
    ----------
    key, title, question : as in `Finding`; checks : one table each, in the order of the report
    numbers, times : (tables by key of the check) -> the numbers that pages quote by key, and those
        that depend on measured times; see `verification.numbers`
    """

    key: str
    title: str
    question: str
    checks: tuple[Check, ...]
    numbers: Callable[[Mapping[str, Table]], Values] | None = None
    times: Callable[[Mapping[str, Table]], Values] | None = None

    def __call__(
        self,
        run: Callable[..., Run],
        depth: str,
        progress: Callable[[int, int], None],
        known: Mapping[str, Table] | None = None,
    ) -> Finding:
        """Run every check and return the finding. A check that raises leaves no table; the finding
        names it.

        known : tables that `measure` has made, by key of the check
        """
        failures: list[Failure] = []
        return self.conclude(
            self.measure(self.checks, run, depth, progress, failures, known or {}), failures
        )

    def measure(
        self,
        checks: Sequence[Check],
        run: Callable[..., Run],
        depth: str,
        progress: Callable[[int, int], None],
        failures: list[Failure],
        known: Mapping[str, Table] = MappingProxyType({}),
    ) -> dict[str, Table]:
        """Return the tables of some of the checks by key; the cases that raise are added to
        `failures`."""
        study = Study(run, depth, results={("table", key): table for key, table in known.items()})
        tables = {}
        for done, check in enumerate(checks):
            progress(done, len(checks))
            study.failures = []
            table = attempt("all of it", partial(study.table, check), study.failures)
            if table is not None:
                tables[check.key] = table
            failures += [replace(one, case=f"{check.key}, {one.case}") for one in study.failures]
        progress(len(checks), len(checks))
        return tables

    def conclude(
        self,
        tables: Mapping[str, Table],
        failures: Sequence[Failure] = (),
        given: Iterable[Part] = (),
    ) -> Finding:
        """Return the finding of tables by key of the check, with `given` parts after those of the
        checks."""
        lost = list[Failure]()
        parts = list[Part]()
        for check in self.checks:
            if check.key in tables:
                judge = partial(check.judge, tables[check.key])
                parts += attempt(f"{check.key}, its parts", judge, lost) or ()
        parts += given
        quoted = attempt("the numbers", partial(self._quoted, tables), lost) or {}
        known = {one.case for one in failures}
        return finding_of(
            self.key,
            self.title,
            self.question,
            parts,
            {**tables, **quoted},
            [*failures, *(one for one in lost if one.case not in known)],
        )

    def _quoted(self, tables: Mapping[str, Table]) -> dict[str, Table]:
        """Return the tables of the numbers that pages quote."""
        if self.numbers is None:
            return {}
        return value_tables(self.numbers(tables), self.times(tables) if self.times else None)

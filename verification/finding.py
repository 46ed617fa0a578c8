"""Finding: the record that every study returns and that reports store and print.

A Finding answers a question by a sentence with a number, a verdict, the parts that were judged, and
the tables with the data. If a case raises an exception, `attempt` records a Failure, the table
lacks that row, and the study goes on. This module is independent of pages and files.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from verification.region import Region, confirmed
from verification.table import Table, titled

Case = TypeVar("Case")
Result = TypeVar("Result")

# WHERE: the claim holds in every trial inside `Part.region`. MIXED: it holds in some trials; no
# region is confirmed.
REPRODUCED, WHERE, MIXED, REFUTED, NOT_TESTABLE, NOT_COMPUTED = VERDICTS = (
    "reproduced",
    "reproduced where",
    "mixed",
    "refuted",
    "not testable here",
    "not computed in this run",
)
# A claim without a confirmed range that fails in more trials than it holds in is refuted, not "true
# with exceptions".
LEAST_SHARE = 0.5
# A part of a claim is the paper's statement (""); or that statement where the code forbids a failure
# (its verdict is that of a machine-checked proof, and it enters no count of trials); or a formula as
# printed whose failure is an erratum; or ours, beyond the paper; or a check with too few trials. The
# last three never decide the claim.
DESIGN = "by design"
MISPRINT = "misprint"
BEYOND = "beyond"
FEW = "few trials"
DECIDING = ("", DESIGN)
# The verdicts in words, and what a claim comes to: those of its statement, and three that name what
# is wrong with it.
IN_WORDS = dict(
    zip(
        VERDICTS,
        (
            "holds",
            "holds where stated",
            "holds in some trials",
            "fails",
            "cannot tell",
            "not computed",
        ),
        strict=True,
    )
)
HOLDS = IN_WORDS[REPRODUCED]
FAILS = IN_WORDS[REFUTED]
MISPRINTED = f"{HOLDS}, {MISPRINT}"
FAILS_IN = f"{FAILS} in a named quantity"
KINDS = (
    HOLDS,
    MISPRINTED,
    IN_WORDS[WHERE],
    FAILS_IN,
    FAILS,
    IN_WORDS[NOT_TESTABLE],
    IN_WORDS[NOT_COMPUTED],
)
# Least number of trials that give a part of a claim a verdict; for the reason see LEAST_CONFIRMING.
LEAST_DECIDED = 10
# A finding is reproduced only if every part is decided.
WORST_FIRST = (REFUTED, MIXED, NOT_COMPUTED, NOT_TESTABLE, WHERE, REPRODUCED)
FAILED_CASES = "not computed"  # name of the table of cases that failed


@dataclass(frozen=True)
class Part:
    """A part of the answer, judged separately.

    Attributes
    ----------
    name : distinguishes the parts of one question; sentence : the result, with its number
    held, decided : trials in which the claim held, and trials that had an outcome; unknown : trials
        without one
    region : region in which the part is reproduced, if the verdict is WHERE
    timed : True if measured times enter
    role : "" or DESIGN for the statement of the question; MISPRINT, BEYOND or FEW for what is shown
        beside it and never decides
    proof : name of the statement that proves a part by DESIGN
    value, limit, least : a number and its target: at most, or `least`: at least, the limit
    """

    sentence: str
    verdict: str
    name: str = ""
    held: int = 0
    decided: int = 0
    unknown: int = 0
    region: Region | None = None
    timed: bool = False
    role: str = ""
    proof: str = ""
    value: float | None = None
    limit: float | None = None
    least: bool = False

    @classmethod
    def on(
        cls,
        name: str,
        value: float | None,
        limit: float,
        *,
        least: bool = False,
        timed: bool = False,
    ) -> Part:
        """Return the part on one number with a target, which decides alone: missed is REFUTED.

        A target without a value, for example because no case could tell, is NOT_TESTABLE.
        """
        verdict = NOT_TESTABLE
        if value is not None:
            met = value >= limit if least else value <= limit
            verdict = REPRODUCED if met else REFUTED
        return cls("", verdict, name, timed=timed, value=value, limit=limit, least=least)

    @property
    def failed(self) -> int:
        """The number of trials in which the claim fails."""
        return self.decided - self.held

    @property
    def outcome(self) -> str:
        """The verdict in words, with the role and the region if there is one."""
        said = f"{HOLDS} where {self.region}" if self.region else IN_WORDS[self.verdict]
        roles = {MISPRINT: "as printed", BEYOND: "ours", DESIGN: DESIGN, FEW: FEW}
        return f"{said}, {roles[self.role]}" if self.role else said


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

    Attributes
    ----------
    key : name of the question, such as "C07" or "mechanics"; title : heading of the question
    question : the question and the method; answer : the result, in one sentence with its number
    verdict : one of VERDICTS; parts : the parts that give the verdict
    tables : the data, by name; a figure refers to a table as "<key>/<name>"
    details : further information by label (place, tolerance, source, law ...)
    failures : the cases that raised an exception; the tables lack their rows
    timed : True if the verdict or the answer depends on measured times
    """

    key: str
    title: str
    question: str
    answer: str
    verdict: str
    parts: tuple[Part, ...] = ()
    tables: Mapping[str, Table] = field(default_factory=dict)
    details: Mapping[str, str] = field(default_factory=dict)
    failures: tuple[Failure, ...] = ()
    timed: bool = False

    def __str__(self) -> str:
        """Return the result, the question, and a line for each part."""
        lines = [f"{self.key}: {self.outcome}", f"  {self.question}"]
        for part in self.parts:
            trials = f", {part.held} of {part.decided} trials" if part.decided else ""
            lines.append(f"  {part.name or part.sentence or 'all'}: {part.outcome}{trials}")
        return "\n".join(lines)

    @property
    def outcome(self) -> str:
        """What a claim comes to, in words; it follows from the parts that are the statement of the
        question."""
        stated = [part for part in self.parts if part.role in DECIDING]
        refuted, mixed = (
            [part.name for part in stated if part.verdict == verdict]
            for verdict in (REFUTED, MIXED)
        )
        judged = sum(part.verdict != NOT_COMPUTED for part in stated)
        if judged and judged in (len(refuted), len(mixed)):
            return FAILS if refuted else f"{FAILS} in some trials"
        mixed = [name for name in mixed if name not in refuted]
        if refuted or mixed:
            said = _listed("in", refuted), _listed("in some trials in", mixed)
            return f"{FAILS} {', and '.join(filter(None, said))}"
        misprinted = any(part.role == MISPRINT and part.verdict == REFUTED for part in self.parts)
        return MISPRINTED if misprinted and self.verdict == REPRODUCED else IN_WORDS[self.verdict]

    @property
    def kind(self) -> str:
        """The outcome without the name of the quantity: one of KINDS."""
        return FAILS_IN if self.outcome.startswith(f"{FAILS} in ") else self.outcome

    @property
    def computed(self) -> bool:
        """Whether the study gave a result."""
        return self.verdict != NOT_COMPUTED


def _listed(before: str, names: Iterable[str]) -> str:
    """Return the names, each once, after a word: "in a, b and c"; "" without names."""
    *others, last = dict.fromkeys(names) or [""]
    return (
        f"{before} {', '.join(others)} and {last}" if others else f"{before} {last}" if last else ""
    )


def worst(verdicts: Iterable[str]) -> str:
    """Return the worst verdict; NOT_COMPUTED if there is none."""
    return min(verdicts, key=WORST_FIRST.index, default=NOT_COMPUTED)


def verdict_of_trials(holds: Iterable[bool | None]) -> str:
    """Return the verdict on a claim from the outcomes of many trials.

    Only trials with an outcome count. The claim is reproduced if it holds in all of them, mixed if
    it holds in at least the share LEAST_SHARE, refuted if it holds in fewer, and not testable here
    if no trial has an outcome. The verdict "reproduced where" needs a confirmed region: see
    `judge_part`.
    """
    decided = [outcome for outcome in holds if outcome is not None]
    return verdict_of_share(sum(decided) / len(decided)) if decided else NOT_TESTABLE


def verdict_of_share(share: float) -> str:
    """Return the verdict on a claim that holds in this share of the trials."""
    return REPRODUCED if share == 1.0 else MIXED if share >= LEAST_SHARE else REFUTED


def verdict_of_law(holds: Iterable[bool | None]) -> str:
    """Return the verdict on a law from its trials: a single failure refutes the law."""
    found = verdict_of_trials(holds)
    return REFUTED if found == MIXED else found


FAILING = "failing"  # key of the column with the number of cases of a row in which the claim fails


def counts_of(trials: Table) -> tuple[int, int, int]:
    """Return the trials in which the claim holds, those that can tell, and those that cannot.

    A row is one trial, or as many as its column of cases says, of which FAILING many fail.
    """
    keys = [column.key for column in trials.of_kind(trials.kinds.counts)]
    held = decided = unknown = 0
    for row, outcome in zip(trials.records(), trials.holds, strict=True):
        count = row[keys[0]] if keys and row[keys[0]] is not None else 1
        if outcome is None:
            unknown += count
            continue
        decided += count
        failing = row.get(FAILING)
        held += count if outcome else count - (count if failing is None else failing)
    return held, decided, unknown


def judge_part(name: str, trials: Table, fresh: Callable[[Region], Table] | None = None) -> Part:
    """Return the verdict on the trials of one part of a claim.

    Only trials that can tell count, and fewer than LEAST_DECIDED of them give no verdict: the part
    gets the role FEW. A part that fails becomes "reproduced where" if a region is confirmed. A
    region is sought if the part is mixed or holds in LEAST_DECIDED trials, since its share of the
    trials depends on which conditions were chosen. The region is found on one half of the trials;
    the claim must hold in all trials of the other half that lie inside the region, and in all that
    `fresh` draws inside. At least LEAST_CONFIRMING trials must confirm the region: fresh trials if
    they can be drawn, else those of the other half.
    """
    held, decided, unknown = counts_of(trials)
    part = Part("", NOT_TESTABLE, name, held, decided, unknown, timed=bool(trials.timed))
    if decided < LEAST_DECIDED:
        return replace(part, role=FEW if decided else "")
    part = replace(part, verdict=verdict_of_share(held / decided))
    if held == decided or (part.verdict == REFUTED and held < LEAST_DECIDED):
        return part
    region = confirmed(trials, fresh)
    return replace(part, region=region, verdict=WHERE) if region else part


def verdict_of(parts: Iterable[Part]) -> str:
    """Return the verdict of a finding: that of its worst part.

    A part with a role that does not decide counts only if it has too few trials and no other part
    decides.
    """
    every = tuple(parts)
    deciding = [part for part in every if part.role in DECIDING]
    few = [part for part in every if part.role == FEW]
    return worst(part.verdict for part in deciding or few)


def with_failures(finding: Finding, failures: Sequence[Failure]) -> Finding:
    """Return the finding with failed cases: this adds a part, a table of the reasons, and a clause
    in the answer."""
    if not failures:
        return finding
    every = (*finding.failures, *failures)
    count = len(failures)
    said = "One case failed and is" if count == 1 else f"{count} cases failed and are"
    part = Part(
        f"{said} in no other number: {', '.join(failure.case for failure in failures)}.",
        NOT_COMPUTED,
    )
    table = titled(
        ("case", "error", "reason"), [(one.case, one.error, one.reason) for one in every]
    )
    return replace(
        finding,
        parts=(*finding.parts, part),
        tables={**finding.tables, FAILED_CASES: table},
        failures=every,
        answer=f"{finding.answer} {count} {'case' if count == 1 else 'cases'} failed.".strip(),
        verdict=worst((finding.verdict, NOT_COMPUTED)),
    )


def finding_of(
    key: str,
    title: str,
    question: str,
    parts: Iterable[Part],
    tables: Mapping[str, Table] | None = None,
    failures: Sequence[Failure] = (),
    answer: str = "",
) -> Finding:
    """Return the finding made of `parts` and `failures`: it has the worst verdict, and is timed if
    any part is."""
    parts = tuple(parts)
    timed = any(part.timed for part in parts)
    made = Finding(
        key, title, question, answer, verdict_of(parts), parts, tables or {}, timed=timed
    )
    return with_failures(made, failures)


def failure_of(case: str, error: Exception) -> Failure:
    """Return the record of an exception."""
    reason = (str(error).splitlines() or ["no reason given"])[0]
    return Failure(case, type(error).__name__, reason, "".join(traceback.format_exception(error)))


def attempt(
    case: str, compute: Callable[[], Result], failures: list[Failure] | None
) -> Result | None:
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
    cases: Iterable[Case],
    results: Callable[[Case], Iterable[Result]],
    failures: list[Failure] | None,
    name: Callable[[Case], str] | None = None,
) -> Iterator[Result]:
    """Yield the results of each case; a case that raises an exception yields none and is recorded
    as a Failure."""
    for case in cases:
        said = name(case) if name else _words(case)
        yield from attempt(said, lambda case=case: list(results(case)), failures) or ()  # type: ignore[misc]


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
    return ", ".join(
        [f"{name} {part}" for name, part in zip(names, case, strict=True)]
        if names
        else map(_words, case)
    )

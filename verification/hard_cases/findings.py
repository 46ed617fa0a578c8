"""Judge every method and world on all named hard cases: one Finding per case, and one Finding on
the engine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from reference.one_thread import one_thread
from verification.check import Check, Study
from verification.finding import (
    NOT_TESTABLE,
    REFUTED,
    REPRODUCED,
    Failure,
    Finding,
    Part,
    counted,
    finding_of,
    verdict_of_trials,
)
from verification.hard_cases import judge
from verification.hard_cases.case import NOT_TRIED, STABLE, TrajectoryCase
from verification.hard_cases.catalogue import HARD_CASES
from verification.table import Table

ENGINE = ("factored", "IAPB")  # the engine's default impact method and its world
_NOTES = {
    "impact": "Stable: gain and error at most those allowed, relative restitution residual at most 1e-8. Energy gain: "
    "(KE⁺ − KE⁻)/KE⁻, exactly. Forward error: |v⁺ − truth| / |v⁻| in the kinetic metric. A "
    "backward stable "
    "method may gain 10 d ε √κ(M) of the energy and have an error of 10 n ε √κ_M (√κ_M + κ_A) by "
    "rounding: n "
    "is the larger of c rows and d coordinates, κ_M the condition number of M scaled to a unit "
    "diagonal, κ_A "
    "that of A = J L⁻ᵀ with M = L Lᵀ. Smallest error detected: the smallest relative error "
    "of a correct impulse or velocity that changes the verdict. Time: median of a call.",
    "motion": "Stable: gain and error are at most those allowed (what rounding or the time step may cause), the "
    "restitution residual is at most 1e-8. Energy gain: the largest amount of energy created, "
    "relative to "
    "the kinetic energy at the start plus the work of hand and gravity. Forward error: distance "
    "from the "
    "known motion, relative to a length or speed of that motion. Restitution residual: the "
    "largest of all "
    "impacts; in an impact of several contacts, the mean of the contacts, weighted by their "
    "impulses. "
    "Smallest error detected: the smallest relative error of displacements and changes of "
    "velocity that "
    "changes the verdict of a stable motion. Time: median of a step.",
}


def hard_cases(
    simulate: judge.Simulate, progress: Callable[[int, int], None], failures: list[Failure]
) -> tuple[Finding, ...]:
    """Return one finding per case with one part per method."""
    study = Study(simulate, failures=failures)
    with one_thread():
        return tuple(study.each(counted(HARD_CASES, progress), lambda name: [_judged(study, name)]))


def on_hard_cases(cases: Sequence[Finding], failures: Sequence[Failure] = ()) -> Finding:
    """Return the finding on the engine; its table has every method and world on every case."""
    by = {case.title: {part.name: part.sentence for part in case.parts} for case in cases}
    ours = {
        title: next((found[name] for name in ENGINE if name in found), "")
        for title, found in by.items()
    }
    failing = [
        f"{name}” ({outcome or NOT_TRIED})" for name, outcome in ours.items() if outcome != STABLE
    ]
    stable = f"{len(ours) - len(failing)} of {len(ours)}"
    sentence = (
        f"In {stable} hard cases the engine is stable: it gives the known answer and gains no "
        f"more energy "
        "than rounding or the time step explain."
        + (f" It fails in “{'; “'.join(failing)}." if failing else "")
    )
    verdict = verdict_of_trials(outcome == STABLE for outcome in ours.values())
    question = "Is the engine stable on problems on which other methods fail?"
    rows = [
        {"case": case.title, "kind": case.details["kind"], **row, "note": ""}
        for case in cases
        for row in case.tables[case.key].by_title()
    ]
    table = EVERY_METHOD.table_of(rows)
    miss = (
        f"{len(failing)} of {len(ours)} hard cases fail{'s' * (len(failing) == 1)}: “{failing[0]}"
        if failing
        else ""
    )
    parts = (Part(sentence, verdict, miss=miss),)
    tables = {EVERY_METHOD.key: table.without("note") if rows else table}
    return finding_of("hard-cases", "Hard cases", question, sentence, parts, tables, failures)


def _judged(study: Study, name: str) -> Finding:
    case = study.once(name, HARD_CASES[name])
    kind = "motion" if isinstance(case, TrajectoryCase) else "impact"
    pairs = [(name, method) for method in judge.methods_for(case)]
    table = replace(EVERY_METHOD, note=_NOTES[kind]).table(study, pairs)
    return finding_on(
        name,
        case.name,
        table if any(table.column("note")) else table.without("note"),
        {
            "kind": kind,
            "source": case.source,
            "why it is hard": case.why_hard,
            "truth": case.law,
            "expected": case.expected,
        },
    )


def finding_on(key: str, title: str, table: Table, details: dict[str, str]) -> Finding:
    """Return the finding on a case from a table with one row per method or world."""
    verdicts = {STABLE: REPRODUCED, NOT_TRIED: NOT_TESTABLE}
    parts = [
        Part(row["outcome"], verdicts.get(row["outcome"], REFUTED), row["method"])
        for row in table.records()
    ]
    stable = [part.verdict == REPRODUCED for part in parts if part.sentence != NOT_TRIED]
    answer = f"{sum(stable)} of {len(stable)} stable"
    found = finding_of(key, title, "Which methods are stable?", answer, parts, {key: table})
    return replace(found, verdict=verdict_of_trials(stable), details=details)


EVERY_METHOD = Check(
    key="every method",
    question="Which methods are stable?",
    cases=lambda study: (),
    digits=2,
    row=lambda study, pair: judge.judge_hard_case(study.results[pair[0]], pair[1], study.run),
    timed=["time"],
)

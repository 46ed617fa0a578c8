"""Stage: named hard cases with certain answers, every method and world on each."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from reports.figures.hard_cases import CASE, INPUT, KIND
from reports.pages.records import HardCase
from reports.runner import Runner
from verification.finding import Failure, Table, attempt, titled
from verification.hard_cases import HARD_CASES, CaseAbsent, TrajectoryCase, judge_hard_cases

__all__ = ["INPUT", "compute", "summary"]

COLUMNS = (
    "method", "outcome", "energy gain", "gain allowed", "restitution residual", "forward error", "error allowed",
    "smallest fault seen", "rank", "exact rank", "time [µs]", "note",
)
TIME = "time [µs]"
_NOTES = {
    "impact": "Stable: gain at most 10 d ε √κ(M), restitution to 1e-8, error within what is allowed. Gain exact, "
              "(KE⁺ − KE⁻)/KE⁻; error |v⁺ − truth| / |v⁻| in the kinetic metric, allowed 10 n ε √κ (√κ + κ(A)), "
              "n = max(c, d), κ of M scaled to a unit diagonal. Smallest fault: the least relative error of impulse or "
              "velocity, planted in the answer, that is not stable any more. Median time of a call.",
    "motion": "Stable: no energy made, restitution to 1e-8, error within what the step excuses. Gain: the most energy "
              "ever made, as a share of what was there or was fed in; error: distance from the law as a share of the "
              "answer; restitution of its collisions, weighted by the impulses. Smallest fault: all displacements and "
              "changes of velocity too large, or too small, by that share. Median time of a step.",
}  # fmt: skip


def compute(
    runner: Runner, progress: Callable[[int, int], None], failures: list[Failure]
) -> tuple[HardCase, ...]:
    """Judge all methods and worlds on all cases of the catalogue; a case without its files is a record that says so."""
    records = []
    for done, name in enumerate(HARD_CASES):
        progress(done, len(HARD_CASES))
        records.append(attempt(name, partial(_record, name, runner, failures), failures))
    progress(len(HARD_CASES), len(HARD_CASES))
    return tuple(record for record in records if record is not None)


def summary(cases: Sequence[HardCase]) -> Table:
    """All cases in one table: a row per case and method or world."""
    shown = [column.key for column in titled(COLUMNS[:-1]).columns]  # all but the notes
    rows = [(case.name, case.kind, *row) for case in cases for row in case.numbers.select(shown).rows]
    return titled((CASE, KIND, *COLUMNS[:-1]), rows, 2, timed=(TIME,))


def _record(name: str, runner: Runner, failures: list[Failure]) -> HardCase:
    try:
        case = HARD_CASES[name]()
    except CaseAbsent as absent:
        title, nothing = name.replace("_", " "), titled(COLUMNS, ())
        return HardCase(name, title, "problems of others", "", "", "", "", nothing, skipped=str(absent))
    kind = "motion" if isinstance(case, TrajectoryCase) else "impact"
    rows = tuple(_row(found) for found in judge_hard_cases(cases=[name], simulate=runner, failures=failures))
    noted = any(row[-1] for row in rows)
    numbers = titled(COLUMNS if noted else COLUMNS[:-1], rows if noted else _without_last(rows), 2, _NOTES[kind],
                      timed=(TIME,))
    return HardCase(name, case.name, case.source, kind, case.why_hard, case.law, case.expected, numbers)


def _without_last(rows: tuple[tuple[Any, ...], ...]) -> tuple[tuple[Any, ...], ...]:
    return tuple(row[:-1] for row in rows)


def _row(found: Any) -> tuple[Any, ...]:
    """A verdict as a row; what does not apply or was not delivered is a dash."""
    return (
        found.method, found.verdict, _known(found.energy_gain), _known(found.energy_bound),
        _known(found.restitution_residual), _known(found.forward_error), _known(found.forward_bound),
        _known(found.smallest_fault),
        None if found.note else found.rank, found.exact_rank, _known(found.seconds * 1e6), found.note,
    )  # fmt: skip


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None

"""Stage: named hard cases with exact truth, every method on each."""

from __future__ import annotations

from collections.abc import Callable

from reports.pages.records import HardCase


def compute(progress: Callable[[int, int], None]) -> tuple[HardCase, ...]:
    """Judge all methods on all cases of the catalogue."""
    from verification.hard_cases import HARD_CASES, judge_hard_cases

    records = []
    for done, (name, make) in enumerate(HARD_CASES.items()):
        progress(done, len(HARD_CASES))
        case = make()
        results = tuple(
            (verdict.method, verdict.forward_error, verdict.energy_gain, _outcome(verdict.verdict, verdict.note))
            for verdict in judge_hard_cases(cases=[name])
        )
        expects = f"{case.why_hard.rstrip('.')}. Expected: {case.expected}"
        records.append(HardCase(case.name, case.source, expects, results))
    progress(len(HARD_CASES), len(HARD_CASES))
    return tuple(records)


def _outcome(verdict: str, note: str) -> str:
    return f"{verdict}: {note}" if note else verdict

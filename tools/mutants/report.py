"""The score in plain sentences and as JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from tools.mutants.explained import Explanation, explanation_of
from tools.mutants.judge import TOO_LONG, UNREACHED, Judgement

WANTED = 0.90
_LIKELY = 1.96  # standard deviations of a normal variable that hold it with 95 %


def survivors(judged: Sequence[Judgement]) -> list[Judgement]:
    """Those that no test noticed, in the order of the files."""
    return sorted((one for one in judged if not one.killed), key=lambda one: (one.file, one.number))


def unexplained(judged: Sequence[Judgement], table: list[Explanation]) -> list[Judgement]:
    """Survivors that the table does not explain."""
    return [one for one in survivors(judged) if explanation_of(one, table) is None]


def score(judged: Sequence[Judgement]) -> float:
    """Share of the mutants that were noticed; those that change nothing count as not noticed."""
    return sum(one.killed for one in judged) / len(judged)


def score_of_changes(judged: Sequence[Judgement], table: list[Explanation]) -> float:
    """The customary score: the share among those that change something, without the survivors shown equivalent."""
    equivalent = sum(_kind(one, table) == "equivalent" for one in survivors(judged))
    return sum(one.killed for one in judged) / max(1, len(judged) - equivalent)


def enough(judged: Sequence[Judgement], table: list[Explanation]) -> bool:
    """As many noticed as wanted, and every survivor explained?"""
    return score_of_changes(judged, table) >= WANTED and not unexplained(judged, table)


def likely_range(share: float, count: int) -> tuple[float, float]:
    """Wilson's 95 % interval for the share among all mutants, of which `count` were drawn."""
    z = _LIKELY**2 / count
    middle = (share + z / 2.0) / (1.0 + z)
    half = _LIKELY * ((share * (1.0 - share) + z / 4.0) / count) ** 0.5 / (1.0 + z)
    return middle - half, middle + half


def sentences(judged: Sequence[Judgement], table: list[Explanation], places: int) -> list[str]:
    """Score per module, the survivors with their lines, and the score of all."""
    lines = [_of_module(file, [one for one in judged if one.file == file]) for file in sorted({j.file for j in judged})]
    for one in survivors(judged):
        lines += _of_survivor(one, explanation_of(one, table))
    share, count = score(judged), len(judged)
    low, high = likely_range(share, count)
    too_long, open_ones = sum(one.verdict == TOO_LONG for one in judged), len(unexplained(judged, table))
    equivalent = sum(_kind(one, table) == "equivalent" for one in survivors(judged))
    lines += [
        "",
        f"{share:.1%} of {count} mutants were noticed ({too_long} of them because a test did not end).",
        f"For a sample that no test was written for, that puts the share among all {places} that could be drawn "
        f"between {low:.0%} and {high:.0%} (95 % confidence); another seed draws another sample.",
        f"Without the {equivalent} survivors that change nothing it is {score_of_changes(judged, table):.1%}; "
        f"{open_ones} of {len(survivors(judged))} survivors have no explanation.",
        f"{'Enough' if enough(judged, table) else 'Not enough'}: {WANTED:.0%} of those that change something are "
        "wanted, and a reason for each survivor.",
    ]
    return lines


def _of_module(file: str, judged: Sequence[Judgement]) -> str:
    noticed = sum(one.killed for one in judged)
    return f"{file}: {noticed} of {len(judged)} noticed"


def _of_survivor(one: Judgement, explanation: Explanation | None) -> list[str]:
    why = f"{explanation.kind}: {explanation.reason}" if explanation else "NOT EXPLAINED"
    reached = "no interpreted test calls it" if one.verdict == UNREACHED else f"{one.tests} tests pass"
    title = f"{one.file}:{one.number} in {one.function or 'the module'}, {reached}; {why}"
    return ["", title, f"  - {one.line}", f"  + {one.becomes}"]


def _kind(one: Judgement, table: list[Explanation]) -> str:
    explanation = explanation_of(one, table)
    return explanation.kind if explanation else ""


def write(path: Path, judged: Sequence[Judgement], table: list[Explanation], seed: int, commit: str) -> None:
    """Everything as JSON."""
    entries = []
    for one in sorted(judged, key=lambda one: (one.file, one.number, one.operator)):
        explanation = explanation_of(one, table) if not one.killed else None
        entries.append({**asdict(one), "explanation": asdict(explanation) if explanation else None})
    low, high = likely_range(score(judged), len(judged))
    content = {"commit": commit, "seed": seed, "score": score(judged), "likely_range": [low, high], "mutants": entries}
    path.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n")

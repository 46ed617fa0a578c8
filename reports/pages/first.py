"""The text of the first page above its pictures: the answer, and the most important facts.

Each sentence is made from findings; a sentence whose findings were not computed is left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import degrees
from statistics import median
from typing import NamedTuple

from reports.pages.quantities import PEG_STEP, peg_step
from reports.pages.records import Evidence
from verification.claims.conditions import Condition
from verification.claims.peg import ALL_THREE, LARGE, NAMED, closest_at, small_tilts
from verification.finding import KINDS, MIXED, NOT_COMPUTED, REFUTED, REPRODUCED, WHERE, Finding

ERRATA = (
    "The energy loss in (18) and (24) lacks a factor ½. The matrix in (37) is not the pseudo-inverse. Impulses by (13) "
    "and (14) do not conserve momentum. The printed formula can gain energy by rounding."
)
LIMIT = "Springs and time stepping can still add energy: see what we miss."
# What the kinds of outcomes mean to somebody who has not read the ledger; "{s}" is the ending of the verb.
COUNTED = dict(zip(KINDS, (
    "hold{s}", "hold{s}, with a misprint in the printed formula", "hold{s} in a stated range of conditions",
    "hold{s} in part and fail{s} in a named quantity", "fail{s}", "cannot be decided here", "not computed",
), strict=True))
MISSES_SHOWN = 5
# Topics whose failures are listed first: energy gains and wrong motions, then differences, then slow methods.
GRAVEST = ("exact-energy", "hard-cases", "engines", "scene-ledger", "complementarity", "stability", "mechanics")


class Fact(NamedTuple):
    """A line beside the answer; `id` links to its details; `items` are lines of a list, each with its own id."""

    label: str
    text: str
    id: str
    items: Sequence[tuple[str, str]] = ()


class Answer(NamedTuple):
    """What holds and what fails of the paper's main claim, in sentences; "" if nothing is known."""

    holds: str
    fails: str


def count_claims(claims: Sequence[Finding]) -> dict[str, tuple[int, str]]:
    """Return the number of claims of each kind of outcome that occurs, and what the kind means, by kind."""
    kinds = [claim.kind for claim in claims]
    return {kind: (kinds.count(kind), words.format(s="s" if kinds.count(kind) == 1 else ""))
            for kind, words in COUNTED.items() if kind in kinds}  # fmt: skip


def answer(evidence: Evidence) -> Answer:
    """Return whether impulses make a wall feel more rigid, and whether any impact gained energy."""
    claims = {claim.key: claim for claim in evidence.claims}
    found = [*_forces(claims.get("C11")), *_path(claims.get("C10"))]
    if any(topic.key == "exact-energy" and topic.verdict == REPRODUCED for topic in evidence.topics):
        found.append((True, "None of the impacts that we tested gained energy."))
    holds, fails = (" ".join(text for held, text in found if held is wanted) for wanted in (True, False))
    return Answer(holds, fails)


def _forces(claim: Finding | None) -> Iterator[tuple[bool, str]]:
    table = claim.tables.get("C11") if claim else None
    if table is None or "part" not in table.keys:
        return
    rows = [row for row in table.where(part=LARGE).records() if row["coordinate"] != "theta" and row["PB"]]
    if rows:
        ratio = median(row["IAPB"] / row["PB"] for row in rows)
        yield ratio > 1.0, (f"At a new contact, the force on the hand is {ratio:.2g} times as large with impulses as "
                            f"with springs alone (median of {len(rows)} cases).")  # fmt: skip


def _path(claim: Finding | None) -> Iterator[tuple[bool, str]]:
    """Yield how often the path is the closest: judged by position and rotation together, and counted for each."""
    parts = {part.name: part for part in claim.parts if not part.role} if claim else {}
    if (whole := parts.pop(ALL_THREE, None)) is None:
        return
    where = f", and always where {whole.region}" if whole.region else ""
    each = ", ".join(f"{part.held} of {part.decided} in {part.named or name}" for name, part in parts.items())
    said = (
        "With impulses (IAPB), the path of the hand is closer to that at a rigid wall than with springs alone (PB) and "
        "with rigid contacts and a unilateral coupling of device and tool (CBuc) in "
        f"{whole.held} of the {whole.decided} starts that can tell, if position and rotation count together{where} "
        f"({each})."
    )
    if claim and (table := claim.tables.get(claim.key)):
        found = closest_at(table, small_tilts(table))
        held, decided = found.pop(ALL_THREE)
        each = ", ".join(f"{ahead} of {told} in {NAMED[name]}" for name, (ahead, told) in found.items())
        said += f" At tilts up to {degrees(Condition().tilt):.1f}° it is the closest in {held} of {decided} ({each})."
    yield whole.verdict in (REPRODUCED, WHERE), said


def facts(evidence: Evidence) -> tuple[Fact, ...]:
    """Return the lines: energy, time, errors in the paper, findings of the project that fail, and provenance."""
    topics = {topic.key: topic for topic in evidence.topics if topic.computed}
    found = []
    if (energy := topics.get("exact-energy")) is not None:
        found.append(Fact("Is it safe?", f"{energy.answer} {LIMIT}", energy.key))
    if (rate := topics.get("haptic-rate")) is not None:
        step = peg_step(evidence)
        said = f"A step of {PEG_STEP} takes {step}. " if step else ""
        found.append(Fact("Is it fast?", said + rate.answer, rate.key))
    if evidence.claims:
        found.append(Fact("Errors in the paper", ERRATA, "claims"))
    if any(topic.answer for topic in evidence.topics):
        found.append(_misses(evidence.topics))
    made = [evidence.provenance[name] for name in ("date", "cpu", "blas") if name in evidence.provenance]
    if "commit" in evidence.provenance:
        made.insert(0, f"commit {evidence.provenance['commit'][:12]}")
    if made:
        found.append(Fact("Made from", ", ".join(made), "provenance"))
    return tuple(found)


def _misses(topics: tuple[Finding, ...]) -> Fact:
    """Return the most serious failing topics, one line each: its first failure and the number of further ones."""
    answered, lines = [topic for topic in topics if topic.answer], []
    for topic in sorted(answered, key=lambda topic: (*GRAVEST, topic.key).index(topic.key)):
        if topic.verdict in (MIXED, REFUTED):
            clauses = [part.miss for part in topic.parts if part.miss] or [f"{topic.title}: {topic.verdict}"]
            more = f", and {len(clauses) - 1} more" if len(clauses) > 1 else ""
            lines.append((clauses[0][:1].upper() + clauses[0][1:] + more, topic.key))
    rest = [(f"and {len(lines) - MISSES_SHOWN} more", "asked")] if len(lines) > MISSES_SHOWN else []
    lacking = [topic.title for topic in answered if topic.verdict == NOT_COMPUTED]
    said = "" if lines or lacking else "Every finding of ours holds."
    return Fact("What we miss", f"Not computed: {', '.join(lacking)}." if lacking else said, "asked",
                lines[:MISSES_SHOWN] + rest)  # fmt: skip

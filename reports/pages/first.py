"""The first screen beside its picture: what was tested, holds, fails, is safe and fast, and what to
do next.

Each sentence is made from findings; a sentence whose findings were not computed is left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import degrees
from statistics import median
from typing import NamedTuple

from reports.pages.records import Evidence
from verification.claims.conditions import Condition
from verification.claims.peg import LARGE, closest_in, small_tilts
from verification.cost.steps import hardest
from verification.finding import KINDS, NOT_COMPUTED, REPRODUCED, WHERE, Finding

ERRATA = (
    "The energy loss is ½ (1 − e²) vᵀJᵀW†Jv, where W† is the pseudo-inverse of W = J M⁻¹Jᵀ; (18) "
    "and (24) lack the "
    "½. The matrix in (37) is not W†, so the proof of (33) fails. Yet (33) is true: redundant "
    "rows do not change the "
    "velocity after the impact. (13) and (14) give each of two touching bodies its own impulse, "
    "so that momentum is "
    "not conserved. An impulse by (20) can pull. Computed as printed, (20) can add energy by "
    "rounding. One more error "
    "is in docs/theory.md."
)
LIMIT = "Springs and time stepping can still add energy: see the known failures."
# What the kinds of outcomes mean to somebody who has not read the ledger; "{s}" is the ending of
# the verb.
COUNTED = dict(
    zip(
        KINDS,
        (
            "hold{s}",
            "hold{s} once a misprint in the formula is corrected",
            "hold{s} in a stated range of conditions",
            "hold{s} for some quantities and fail{s} for others",
            "fail{s}",
            "cannot be decided here",
            "not computed",
        ),
        strict=True,
    )
)
# Topics whose failures are listed first: energy gains and wrong motions, then differences, then
# slow methods.
GRAVEST = (
    "exact-energy",
    "hard-cases",
    "scene-ledger",
    "engines",
    "complementarity",
    "stability",
    "mechanics",
)
NEXT = ("Read “The idea”: one formula, five minutes", "idea")  # the one next step, at the top
LATER = (
    ("which method for your time budget", "accuracy"),
    ("tests for your own solver", "properties"),
    ("how to compute it again", "provenance"),
)


class Fact(NamedTuple):
    """A line of the first screen; `mark` is the kind of outcome, `id` links to the details, `items`
    are listed, each with its own id."""

    label: str
    text: str
    id: str = ""
    mark: str = ""
    items: Sequence[tuple[str, str]] = ()


def count_claims(claims: Sequence[Finding]) -> dict[str, tuple[int, str]]:
    """Return the number of claims of each kind of outcome that occurs, and what the kind means, by
    kind."""
    kinds = [claim.kind for claim in claims]
    return {
        kind: (kinds.count(kind), words.format(s="s" if kinds.count(kind) == 1 else ""))
        for kind, words in COUNTED.items()
        if kind in kinds
    }


def facts(evidence: Evidence) -> tuple[Fact, ...]:
    """Return the lines of the first screen that have findings."""
    claims = {claim.key: claim for claim in evidence.claims}
    topics = {topic.key: topic for topic in evidence.topics if topic.computed}
    found = [*_forces(claims.get("C11"), claims.get("C14")), *_path(claims.get("C10"))]
    counts = [f"{count} {words}" for count, words in count_claims(evidence.claims).values()]
    parts = [part for claim in evidence.claims for part in claim.parts]
    decided, unknown = (
        sum(getattr(part, of) for part in parts if not part.role) for of in ("decided", "unknown")
    )
    told = (
        [
            Fact(
                "Tested",
                f"{len(claims)} claims of the paper: {'; '.join(counts)}. {decided:,} trials "
                f"(tested "
                f"conditions) decide; {unknown:,} more cannot: they show no clear difference.",
                "claims",
            )
        ]
        if claims
        else []
    )
    for label, kind, wanted in (("Holds", KINDS[0], True), ("Fails", KINDS[4], False)):
        if text := " ".join(said for held, said in found if held is wanted):
            told.append(Fact(label, text, "C11" if wanted else "C10", kind))
    if (energy := topics.get("exact-energy")) is not None:
        told.append(
            Fact(
                "Energy of impacts",
                f"{energy.answer} {LIMIT}",
                energy.key,
                KINDS[0] if energy.verdict == REPRODUCED else KINDS[4],
            )
        )
    if (rate := topics.get("haptic-rate")) is not None:
        met = (
            rate.answer.partition(". ")[0].removesuffix(".") + "."
        )  # the rest is in the table of topics
        told.append(Fact("Is it fast?", " ".join((*_speed(evidence, rate), met)), rate.key))
    if any(topic.answer for topic in evidence.topics):
        told.append(_misses(evidence.topics))
    if claims:
        told.append(Fact("Errors in the paper", ERRATA, "claims"))
    return tuple(told)


def made_from(evidence: Evidence) -> str:
    """Return commit, date and machine of the report, "" if they are unknown."""
    known = evidence.provenance
    commit = f"commit {known['commit'][:12]}" if "commit" in known else ""
    return ", ".join(filter(None, (commit, known.get("date"), known.get("cpu"))))


def _forces(claim: Finding | None, limited: Finding | None) -> Iterator[tuple[bool, str]]:
    table, limits = (each.tables.get(each.key) if each else None for each in (claim, limited))
    if table is None or "part" not in table.keys:
        return
    found = {"on a device without force limit": table.where(part=LARGE)}
    if limits is not None and "force_limit" in limits.keys:
        found["on the paper's device, limited to 15 N"] = limits.where(force_limit=1.0)
    ratios = {
        device: [
            row["IAPB"] / row["PB"]
            for row in rows.records()
            if row["coordinate"] != "rotation" and row["PB"]
        ]
        for device, rows in found.items()
    }
    said = [
        f"{median(each):.2g} times as large {device} (median of {len(each)} values)"
        for device, each in ratios.items()
        if each
    ]
    if said:
        yield (
            all(median(each) > 1.0 for each in ratios.values() if each),
            (
                "The paper says that impulses push harder than springs alone. Compared with them, "
                "the largest force on the "
                f"hand, in x (along the floor) and y (along the wall), is {', and '.join(said)}."
            ),
        )


def _path(claim: Finding | None) -> Iterator[tuple[bool, str]]:
    """Yield how often the path is the closest in each quantity, and how often at small tilts."""
    parts = [part for part in claim.parts if not part.role and part.decided] if claim else []
    if claim is None or not parts:
        return
    each = ", ".join(
        f"{part.held} of {part.decided} starts for {part.named or part.name}" for part in parts
    )
    yield (
        all(part.verdict in (REPRODUCED, WHERE) for part in parts),
        (
            "The paper says that impulses bring the hand's path nearest to the path at a rigid "
            "wall. Where the paths "
            f"clearly differ, this holds in {each}."
        ),
    )
    if (table := claim.tables.get(claim.key)) and (small := small_tilts(table)).rows:
        found, of = (
            {name: closest_in(small)[name] for name in ("x", "y")},
            len(small.where(part="x").rows),
        )
        each = " and ".join(
            f"{ahead} of {told} starts for {name}" for name, (ahead, told) in found.items()
        )
        yield (
            all(ahead == told > 0 for ahead, told in found.values()),
            (
                f"At tilts up to {degrees(Condition().tilt):.2f}° ({Condition().tilt:g} rad; {of} "
                f"starts), impulses bring "
                f"the hand's path nearest to the path at a rigid wall in {each}; starts with "
                f"similar paths do not count."
            ),
        )


def _peg_step(evidence: Evidence) -> str:
    """Return the time of a step of the peg in the corner, "" if it was not measured."""
    table = evidence.inputs.get("effect_steps")
    times = (
        table.where(scene="peg_corner").column("step") if table is not None and table.rows else []
    )
    return f"{times[0]:.2g} µs" if times else ""


def _speed(evidence: Evidence, rate: Finding) -> Iterator[str]:
    """Yield the time of a step against the budget of a loop and against MuJoCo, and where Lemke's
    method is faster."""
    if step := _peg_step(evidence):
        yield f"A time step of the peg in the corner takes {step}; a loop at 1 kHz allows 1000 µs."
    if (races := rate.tables.get("steps against MuJoCo")) and races.rows:
        ratios = sorted(float(row["ratio"]) for row in hardest(races))
        yield (
            f"In {len(ratios)} scenes at rest or nearly so, our step takes {ratios[0]:.0%} to "
            f"{ratios[-1]:.0%} of "
            "the time of MuJoCo's."
        )
    if (raced := rate.tables.get("compiled, IAPB and Lemke")) and raced.decided:
        yield (
            f"Lemke's complementarity method is faster than our engine for "
            f"{raced.holds.count(False)} of the "
            f"{len(raced.decided)} sizes of impact whose times clearly differ."
        )


def _misses(topics: tuple[Finding, ...]) -> Fact:
    """Return our failures, one line for each topic: its first failure and the number of further
    ones."""
    lines = []
    for topic in sorted(topics, key=lambda topic: (*GRAVEST, topic.key).index(topic.key)):
        if clauses := [part.miss for part in topic.parts if part.miss]:
            more = (
                f" ({len(clauses) - 1} more on the page {topic.title})" if len(clauses) > 1 else ""
            )
            lines.append((clauses[0][:1].upper() + clauses[0][1:] + more, topic.key))
    lacking = [topic.title for topic in topics if topic.answer and topic.verdict == NOT_COMPUTED]
    said = "" if lines or lacking else "Every finding of ours holds."
    told = f"Not computed: {', '.join(lacking)}." if lacking else said
    return Fact("Known failures", told, "asked", items=lines)

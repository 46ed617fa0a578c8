"""What the first page says before its pictures: the answer, and the facts that a reader asks for first.

Each sentence is made from findings; what was not computed is left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import degrees
from statistics import median

from reports.pages.records import Evidence
from verification.claims.c11_forces import LARGE
from verification.finding import MIXED, NOT_COMPUTED, REFUTED, REPRODUCED, Finding

ERRATA = (
    "The energy lost in a collision, (18) and (24), lacks a factor ½ (C01, C02). The inverse in the proof, (37), is "
    "not the pseudo-inverse. Impulses by (13) and (14) do not keep momentum. The printed formula can gain energy by "
    "rounding."
)


LIMIT = "This holds for impacts; springs and steps in time are not exact: see what we miss."


@dataclass(frozen=True)
class Fact:
    """A line beside the answer; `id` is where the report says more."""

    label: str
    text: str
    id: str


def answer(evidence: Evidence) -> str:
    """Say in two or three sentences whether an impulse makes a wall feel rigid; "" where nothing is known."""
    claims = {claim.key: claim for claim in evidence.claims}
    said = [*_forces(claims.get("C11")), *_path(claims.get("C10"))]
    if any(topic.key == "exact-energy" and topic.verdict == REPRODUCED for topic in evidence.topics):
        said.append("No impact of the engine ever gained energy.")
    return " ".join(said)


def _forces(claim: Finding | None) -> Iterator[str]:
    table = claim.tables.get("C11") if claim else None
    if table is None or "part" not in table.keys:
        return
    rows = [row for row in table.where(part=LARGE).records() if row["coordinate"] != "theta" and row["PB"]]
    if rows:
        ratio = median(row["IAPB"] / row["PB"] for row in rows)
        yield (f"At a new contact, impulses push the hand {ratio:.2g} times as hard as springs alone do "
               f"(median of {len(rows)} cases).")  # fmt: skip


def _path(claim: Finding | None) -> Iterator[str]:
    if claim is None:
        return
    tilts = [bound for part in claim.parts if part.region and not part.name.startswith("theta")
             for name, _, _, bound in part.region.bounds if name == "tilt" and bound is not None]  # fmt: skip
    if tilts:
        yield (f"The path of the hand then comes closest to that at a rigid wall, if the peg starts nearly flat: up to "
               f"{degrees(min(tilts)):.1f}° of tilt. Beyond, springs alone often come as close or closer.")  # fmt: skip
    elif claim.parts:
        yield "No range of starts was found in which the path of the hand is the closest to that at a rigid wall."
    if any(part.verdict == REFUTED and part.name.startswith("theta") for part in claim.parts):
        yield "In rotation, impulses usually do not come closest."


def facts(evidence: Evidence) -> tuple[Fact, ...]:
    """Return the lines: energy, time, the paper's errors, what we miss ourselves, and what made the report."""
    topics = {topic.key: topic for topic in evidence.topics}
    found = [Fact(label, topics[key].answer, key) for label, key in (("Is it safe?", "exact-energy"),
                                                                     ("Is it fast?", "haptic-rate"))
             if key in topics and topics[key].computed]  # fmt: skip
    if found and found[0].id == "exact-energy":
        found[0] = replace(found[0], text=f"{found[0].text} {LIMIT}")
    if evidence.claims:
        found.append(Fact("Errors in the paper", ERRATA, "claims"))
    answered = [topic for topic in evidence.topics if topic.answer]
    missed = [f"{topic.title} ({topic.miss})" if topic.miss else topic.title
              for topic in answered if topic.verdict in (MIXED, REFUTED)]  # fmt: skip
    lacking = [topic.title for topic in answered if topic.verdict == NOT_COMPUTED]
    if answered:
        text = f"{'. '.join(missed)}." if missed else "Every finding of ours holds."
        absent = f" Not computed: {', '.join(lacking)}." if lacking else ""
        found.append(Fact("What we miss", text + absent, "verdict"))
    made = [evidence.provenance[name] for name in ("date", "cpu", "blas") if name in evidence.provenance]
    if "commit" in evidence.provenance:
        made.insert(0, f"commit {evidence.provenance['commit'][:12]}")
    if made:
        found.append(Fact("Made from", ", ".join(made), "provenance"))
    return tuple(found)

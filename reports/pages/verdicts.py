"""The sentences of the first page: the ledger, gathered by subject."""

from __future__ import annotations

import re
from collections.abc import Sequence

from reports.pages.records import LIMITED, NOT_COMPUTED, NOT_TESTABLE, REFUTED, REPRODUCED, Claim, Verdict

SUBJECTS = (
    ("Energy", ("C01", "C02", "C04", "C08")),
    ("Redundant contacts", ("C03", "C05", "C06")),
    ("Geometry and walls", ("C07", "C17")),
    ("Trajectory", ("C10", "C13")),
    ("Forces", ("C11", "C14")),
    ("Weak devices", ("C09", "C12", "C16")),
    ("Coming to rest", ("C15",)),
    ("False collisions", ("C18",)),
    ("Stable contact", ("C20", "C21")),
    ("Cost", ("C19", "C22")),
)
_WORST_FIRST = (REFUTED, LIMITED, REPRODUCED, NOT_TESTABLE, NOT_COMPUTED)
_SENTENCE_END = re.compile(r"(?<=\.)\s(?=[A-Z])")


def verdicts(claims: Sequence[Claim]) -> tuple[Verdict, ...]:
    """Return one verdict per subject: the worst of its claims, in that claim's own words."""
    found = {claim.id: claim for claim in claims}
    given = ((subject, [found[name] for name in names if name in found]) for subject, names in SUBJECTS)
    return tuple(_verdict(subject, members) for subject, members in given if members)


def _verdict(subject: str, members: Sequence[Claim]) -> Verdict:
    worst = min(members, key=lambda claim: _WORST_FIRST.index(claim.outcome))
    held = sum(claim.outcome == REPRODUCED for claim in members)
    count = f"{held} of {len(members)} claims reproduced. " if 0 < held < len(members) else ""
    return Verdict(subject, worst.outcome, f"{count}{worst.id}: {first_sentence(worst.headline)}", worst.id)


def first_sentence(text: str) -> str:
    """Return the first sentence of a text: up to a point before a capital."""
    return _SENTENCE_END.split(text, maxsplit=1)[0]

"""The sentences of the first page: the ledger, gathered by subject."""

from __future__ import annotations

import re
from collections.abc import Sequence

from reports.pages.records import Claim, Verdict
from verification.finding import REPRODUCED, WORST_FIRST

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
# "part: in 24 of 36 trials, with ..." of a claim's `fails`, which parts its parts by "; ".
_FAILURE = re.compile(r"^(?:(?P<part>.*): )?in (?P<count>all \d+|\d+ of \d+) trials")
_SHOWN = 2  # parts that fail, in a line of the first page
_SENTENCE_END = re.compile(r"(?<=\.)\s(?=[A-Z])")


def verdicts(claims: Sequence[Claim]) -> tuple[Verdict, ...]:
    """Return one verdict per subject: the worst of its claims, in that claim's own words."""
    found = {claim.id: claim for claim in claims}
    given = ((subject, [found[name] for name in names if name in found]) for subject, names in SUBJECTS)
    return tuple(_verdict(subject, members) for subject, members in given if members)


def _verdict(subject: str, members: Sequence[Claim]) -> Verdict:
    worst = min(members, key=lambda claim: WORST_FIRST.index(claim.outcome))
    held = sum(claim.outcome == REPRODUCED for claim in members)
    count = f"{held} of {len(members)} claims reproduced. " if 0 < held < len(members) else ""
    sentence = f"{count}{worst.id}: {_told(worst)}"
    return Verdict(subject, worst.outcome, sentence, worst.id, worst.timed)


def _told(claim: Claim) -> str:
    """The first sentence of what was found, without the count of trials where those that failed are named."""
    fails = failures(claim.fails)
    found = claim.headline.partition(" (holds in ")[0] if fails else claim.headline
    return first_sentence(found) + fails


def failures(fails: str) -> str:
    """Return in how many trials a claim fails, for each of its parts the first of which are named; empty for none."""
    found = [match for match in map(_FAILURE.match, fails.split("; ")) if match]
    if len(found) == 1 and not found[0]["part"]:
        return f" Fails in {found[0]['count']} trials."
    parts = [f"{match['part']} in {match['count']} trials" for match in found]
    more = f"; and {len(parts) - _SHOWN} more" if len(parts) > _SHOWN else ""
    return f" Fails: {'; '.join(parts[:_SHOWN])}{more}." if parts else ""


def first_sentence(text: str) -> str:
    """Return the first sentence of a text: up to a point before a capital."""
    return _SENTENCE_END.split(text, maxsplit=1)[0]

"""C19: one pseudo-inverse meets the haptic rate with many simultaneous collisions (open question of VII, VIII)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from verification.claims.claim import Claim
from verification.cost.growth import ALLOWED, haptic_rate, most_contacts
from verification.finding import Row, Table

if TYPE_CHECKING:
    from verification.claims.study import Study

MANY = 60  # collisions at once: ten times the six of the paper's peg in the hole


def measure(study: Study) -> Table:
    """Both methods over coordinates and contacts."""
    return haptic_rate()


def holds(row: Row) -> bool | None:
    """At most one call in a thousand takes longer than 1 ms; None beyond MANY contacts, of which nothing is claimed."""
    return None if row["contacts"] > MANY else bool(row["late calls"] <= ALLOWED)


def finding(table: Table) -> str:
    """One sentence."""
    texts = [f"{method}: " + ", ".join(f"{count} at d = {d}" for d, count in most.items())
             for method, most in most_contacts(table).items()]  # fmt: skip
    return f"Most contacts with 99.9 % of the impacts under 1 ms, on this machine: {'; '.join(texts)}."


CLAIM = Claim(
    id="C19",
    statement="One pseudo-inverse per step meets the haptic rate with many simultaneous collisions.",
    place="Sections VII and VIII, as an open question",
    quantity="How many of 1000 impacts take longer than 1 ms, one after the other, for c contacts whose rows span two "
    "thirds of d coordinates: the printed formula (21) in numpy, and its factored form compiled. Once a size is late, "
    "larger ones are not tried. Times are the thread's own, on this machine.",
    tolerance="One call in a thousand may be late; a size that is late is tried three times. "
    f"Up to {MANY} contacts are taken as many.",
    measure=measure,
    holds=holds,
    finding=finding,
    map_axes=("contacts", "coordinates"),
    map_panels="method",
)

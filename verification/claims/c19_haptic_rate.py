"""C19: one pseudo-inverse meets the haptic rate with many simultaneous collisions (open question of VII, VIII)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from verification.claims.claim import Claim
from verification.cost.growth import ALLOWED, CONTACTS, COORDINATES, RATE_COLUMNS, haptic_rate, most_contacts
from verification.finding import Region, Row, Table

if TYPE_CHECKING:
    from verification.claims.study import Study

FRESH = 15  # number of sizes drawn to confirm a region


def draw(study: Study, region: Region) -> Iterator[Row]:
    """Yield the trials of fresh sizes inside a region."""
    rng = np.random.default_rng(study.seed)
    ends = (region.ends("coordinates", COORDINATES), region.ends("contacts", CONTACTS))
    for _ in range(FRESH):
        d, c = (round(low * (high / low) ** rng.random()) for low, high in ends)
        yield from haptic_rate((d,), (c,)).records()


def holds(row: Row) -> bool | None:
    """Return whether at most one call in a thousand takes longer than 1 ms."""
    return bool(row["late calls"] <= ALLOWED)


def finding(table: Table) -> str:
    """Return the result in words, with numbers."""
    texts = [f"{method}: " + ", ".join(f"{count} at d = {d}" for d, count in most.items())
             for method, most in most_contacts(table).items()]  # fmt: skip
    return ("Largest number of contacts at which 99.9 % of the impacts take less than 1 ms, on this machine: "
            f"{'; '.join(texts)}.")  # fmt: skip


CLAIM = Claim(
    id="C19",
    statement="One pseudo-inverse per step meets the haptic rate with many simultaneous collisions.",
    place="Sections VII and VIII, as an open question",
    quantity="Number of impacts, out of 1000 in a row, that take longer than 1 ms. The c contact rows have rank two "
    "thirds of d coordinates. Methods: the printed formula (21) in numpy, and its factored form, compiled. Once a size "
    "is too slow, larger sizes are not tried. Times are CPU times of the thread on this machine.",
    tolerance="At most one call in a thousand is late. A size that fails is tried three times.",
    columns=RATE_COLUMNS,
    cases=lambda study: haptic_rate().records(),
    trials=lambda study, trial: [trial],
    holds=holds,
    finding=finding,
    draw=draw,
    axes=("contacts", "coordinates", "method"),
)

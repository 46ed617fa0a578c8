"""Claims on computing time: C19 (haptic rate with many contacts) and C22 (complementarity costs
more)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from verification.check import Check, Study
from verification.cost import growth, impact_times
from verification.finding import BEYOND
from verification.region import Region
from verification.table import Columns

# C19: the haptic rate with many contacts

FRESH_SIZES = 12  # number of sizes drawn to confirm a region


class Sizes(NamedTuple):
    """Coordinates and the contacts that a method tries with them."""

    coordinates: int
    method: str
    contacts: tuple[int, ...] = growth.CONTACTS


def _fresh_sizes(study: Study, region: Region) -> Iterator[Sizes]:
    """Yield fresh sizes inside a region."""
    rng = np.random.default_rng(study.seed)
    ends = (
        region.ends("coordinates", growth.COORDINATES),
        region.ends("contacts", growth.CONTACTS),
    )
    for _ in range(FRESH_SIZES):
        d, c = (round(low * (high / low) ** rng.random()) for low, high in ends)
        yield from (Sizes(d, method, (c,)) for method in growth.TITLES)


C19 = Check(
    key="C19",
    question="One pseudo-inverse per step meets the haptic rate with many simultaneous collisions.",
    roles={growth.TITLES[growth.FACTORED]: BEYOND, growth.MILLISECOND: BEYOND},
    cases=lambda study: [Sizes(d, method) for d in growth.COORDINATES for method in growth.TITLES],
    draw=_fresh_sizes,
    row=lambda study, case: growth.haptic_rate(
        case.coordinates, case.method, case.contacts, failures=study.failures
    ),
    holds=lambda row: bool(row["late calls"] <= growth.ALLOWED),
    columns=Columns(
        parts=("method", "deadline"),
        conditions=("coordinates", "contacts"),
        timed=("late calls", "time"),
        timed_rows=True,
    ),
)


# C22: complementarity costs more

C22 = Check(
    key="C22",
    question="Time stepping with complementarity costs more than IAPB.",
    roles=dict.fromkeys(impact_times.FAMILIES, BEYOND),
    cases=lambda _: impact_times.CASES,
    row=impact_times.compare,
    holds=impact_times.costs_more,
    columns=Columns(
        parts=("impacts", "method", "called"),
        conditions=("contacts",),
        timed=(*impact_times.MEASURED, *impact_times.OF_STEPS),
        timed_rows=True,
    ),
)

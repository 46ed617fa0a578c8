"""Claims on computing time: C19 (haptic rate with many contacts) and C22 (complementarity costs
more)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from verification.check import Check, Study
from verification.clock import Times, sampler, take_turns
from verification.cost import growth
from verification.cost.calls import kernel_call, lemke_call, solver_call
from verification.cost.problems import patch, pile
from verification.finding import BEYOND
from verification.region import Region
from verification.table import Row

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
    parts=["method", "deadline"],
    conditions=["coordinates", "contacts"],
    timed=["late calls", "time"],
    timed_rows=True,
)


# C22: complementarity costs more

PROBLEMS = {"redundant contacts of a patch": patch, "independent contacts of a pile": pile}
SIZES = (*range(1, 13), 14, 16, 20, 24, 28, 32, 40, 48, 56, 64, 80, 96, 128, 192, 300)
# Where the arrays of an impact lie in memory changes its ratio by up to 40 %, so each size has
# several draws, each in arrays of its own. Their median then moves by up to 12 % between processes
# on a busy machine (once by 19 %).
DRAWS, ROUNDS, CLEAR = 4, {"quick": 2, "full": 4}, 1.1
TIMES = ("decades", "ratio", "lower quartile", "upper quartile")
SAME_VELOCITY = 1e-5  # largest difference of an answer from daqp's, relative to |v⁻|


class Impact(NamedTuple):
    """A problem to be timed: its kind and its number of contacts."""

    problem: str
    contacts: int


def _ratio(study: Study, case: Impact) -> dict[str, Any]:
    """Time both kernels in turns on several impacts of a size, and divide their times round by
    round."""
    row: dict[str, Any] = {"problem": case.problem, "contacts": case.contacts} | dict.fromkeys(
        TIMES
    )
    ratios: tuple[float, ...] = ()
    for draw in range(DRAWS):
        rng = np.random.default_rng([study.seed, case.contacts, draw])
        impact = PROBLEMS[case.problem](case.contacts, rng)
        calls = {"complementarity": lemke_call(impact), "IAPB": kernel_call(impact)}
        samplers = {name: sampler(call) for name, call in calls.items()}
        answer = solver_call(impact, "daqp")()
        apart = max(np.linalg.norm(call.v_plus - answer) for call in calls.values())
        if apart > SAME_VELOCITY * np.linalg.norm(
            impact.velocity
        ):  # the methods solve different problems
            return row
        times = take_turns(samplers, ROUNDS[study.depth], warm=False)
        ratios += times["complementarity"].over(times["IAPB"]).samples
    ratio = Times(ratios)
    values = float(np.log10(ratio.median)), ratio.median, ratio.lower, ratio.upper
    return row | dict(zip(TIMES, values, strict=True))


def costs_more(row: Row) -> bool | None:
    """Return True if complementarity clearly costs more, False if it clearly costs less, None in
    between."""
    if row["ratio"] is None:
        return None
    return (
        True
        if row["lower quartile"] >= CLEAR
        else False
        if row["upper quartile"] <= 1.0 / CLEAR
        else None
    )


C22 = Check(
    key="C22",
    question="Time stepping with complementarity costs more than IAPB.",
    roles=dict.fromkeys(PROBLEMS, BEYOND),
    cases=lambda study: [Impact(problem, contacts) for contacts in SIZES for problem in PROBLEMS],
    row=_ratio,
    holds=costs_more,
    parts=["problem"],
    conditions=["contacts"],
    timed=TIMES,
    timed_rows=True,
)

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
from verification.table import Row, Table

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


def _rate_says(table: Table) -> str:
    texts = [
        f"{method} in {deadline}: {', '.join(f'{count} at d = {d}' for d, count in most.items())}"
        for deadline in growth.DEADLINES
        for method, most in growth.most_contacts(table, deadline).items()
    ]
    return (
        "The paper leaves this question open. On this machine, the largest number of contacts at "
        "which 99.9 % of "
        f"the impacts are in time, with d coordinates: {'; '.join(texts)}. The times are CPU "
        f"times of the "
        "thread; they do not show that a real-time loop keeps the deadline."
    )


C19 = Check(
    key="C19",
    question="One pseudo-inverse per step meets the haptic rate with many simultaneous collisions.",
    place="Sections VII and VIII, as an open question",
    quantity="Number of impacts, out of 1000 in a row, that take longer than the paper's step of 1/512 s. The rank of "
    "the rows is two thirds of the number d of coordinates. The printed formula (21) is evaluated "
    "in numpy. Beyond the "
    "paper: a deadline of 1 ms, and the engine's factored form, which is compiled and forms no "
    "pseudo-inverse. Once a "
    "size is too slow, larger sizes are not tried.",
    tolerance="At most one of the 1000 impacts is late. A size that fails is tried up to three times.",
    roles={growth.TITLES[growth.FACTORED]: BEYOND, growth.MILLISECOND: BEYOND},
    cases=lambda study: [Sizes(d, method) for d in growth.COORDINATES for method in growth.TITLES],
    draw=_fresh_sizes,
    row=lambda study, case: growth.haptic_rate(
        case.coordinates, case.method, case.contacts, failures=study.failures
    ),
    says=_rate_says,
    holds=lambda row: bool(row["late calls"] <= growth.ALLOWED),
    parts=["method", "deadline"],
    conditions=["coordinates", "contacts"],
    timed=["late calls", "time"],
    timed_rows=True,
    axes=("contacts", "coordinates", "method"),
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


def _ratio_says(table: Table) -> str:
    texts = []
    for part in dict.fromkeys(table.column("problem")):
        rows = table.where(problem=part)
        shown = {
            row["contacts"]: f"{float(format(row['ratio'], '.2g')):g}"
            for row in rows.records()
            if row["ratio"] is not None and row["contacts"] in (1, 6, 16, 64, 192)
        }
        clear = (rows.that(outcome).column("contacts") for outcome in (True, False))
        above, below = (
            f"with {found[0]} to {found[-1]} contacts"
            if len(found) > 9
            else f"with {', '.join(map(str, found)) or 'no number of'} contacts"
            for found in clear
        )
        texts.append(
            f"For {part} the ratio is {', '.join(shown.values())} with "
            f"{', '.join(map(str, shown))} contacts: "
            f"clearly above 1 {above}, clearly below 1 {below}; {rows.holds.count(None)} of "
            f"{len(rows.rows)} sizes cannot tell."
        )
    return (
        "The paper speaks of whole time steps with constraint stabilization. We do not time whole "
        "steps with "
        "complementarity. Beyond the paper, we divide the time of one frictionless impact by "
        "Lemke's method by the "
        f"time of that impact by IAPB, both compiled. {' '.join(texts)} The paper's scene has at "
        f"most six "
        "collisions at once."
    )


C22 = Check(
    key="C22",
    question="Time stepping with complementarity costs more than IAPB.",
    place="Section II",
    untested=("whole time steps with constraint stabilization",),
    roles=dict.fromkeys(PROBLEMS, BEYOND),
    quantity="Beyond the paper: CPU time of a frictionless impact by complementarity, divided by that of IAPB. Both "
    "are compiled and timed in turns in one run, in random order, on several impacts of each "
    "size. The impacts have "
    "1 to 300 contacts on a patch (all but three redundant) or in a pile (none redundant); both "
    "methods give the same "
    "v⁺.",
    tolerance="A trial holds (clearly above 1) if the lower quartile of the ratios is at least 1.1, and fails (clearly "
    "below 1) if the upper quartile is at most 1/1.1; else it cannot tell. Between processes on a "
    "busy machine the "
    "median of a size moved by up to 12 %, once by 19 %: a verdict near the limit can change.",
    cases=lambda study: [Impact(problem, contacts) for contacts in SIZES for problem in PROBLEMS],
    row=_ratio,
    holds=costs_more,
    says=_ratio_says,
    parts=["problem"],
    conditions=["contacts"],
    timed=TIMES,
    timed_rows=True,
    axes=("contacts", "decades", "problem"),
    note="Ratio: Lemke's time over IAPB's. A "
    "row holds if the lower quartile is at least 1.1, and fails if the upper quartile is at most 1/1.1.",
)

"""Claims on computing time: C19 (haptic rate with many contacts) and C22 (complementarity costs more)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from verification.check import Check, Study
from verification.clock import sampler, take_turns
from verification.cost.calls import Call, kernel_call, lemke_call, solver_call
from verification.cost.growth import ALLOWED, CONTACTS, COORDINATES, TITLES, haptic_rate, most_contacts
from verification.cost.problems import patch, pile
from verification.region import Region
from verification.table import Row, Table

# C19: 1 kHz with many contacts

FRESH_SIZES = 15  # number of sizes drawn to confirm a region


class Sizes(NamedTuple):
    """Coordinates and the contacts that a method tries with them."""

    coordinates: int
    method: str
    contacts: tuple[int, ...] = CONTACTS


def _fresh_sizes(study: Study, region: Region) -> Iterator[Sizes]:
    """Yield fresh sizes inside a region."""
    rng = np.random.default_rng(study.seed)
    ends = (region.ends("coordinates", COORDINATES), region.ends("contacts", CONTACTS))
    for _ in range(FRESH_SIZES):
        d, c = (round(low * (high / low) ** rng.random()) for low, high in ends)
        yield from (Sizes(d, method, (c,)) for method in TITLES)


def _rate_says(table: Table) -> str:
    texts = [f"{method}: " + ", ".join(f"{count} at d = {d}" for d, count in most.items())
             for method, most in most_contacts(table).items()]  # fmt: skip
    return ("Largest number of contacts at which 99.9 % of the impacts take less than 1 ms on this machine, with d "
            f"coordinates: {'; '.join(texts)}.")  # fmt: skip


C19 = Check(
    key="C19", question="One pseudo-inverse per step meets the haptic rate with many simultaneous collisions.",
    place="Sections VII and VIII, as an open question",
    quantity="Number of impacts, out of 1000 in a row, that take longer than 1 ms. The rank of the rows is two thirds "
    "of the number d of coordinates. Methods: the printed formula (21) in numpy, and its factored form, compiled. Once "
    "a size is too slow, larger sizes are not tried. Times are CPU times of the thread on this machine.",
    tolerance="At most one call in a thousand is late. A size that fails is tried three times.",
    cases=lambda study: [Sizes(d, method) for d in COORDINATES for method in TITLES], draw=_fresh_sizes,
    row=lambda study, case: haptic_rate(case.coordinates, case.method, case.contacts, failures=study.failures),
    says=_rate_says,
    holds=lambda row: bool(row["late calls"] <= ALLOWED), parts=["method"],
    conditions=["method", "coordinates", "contacts"], timed=["late calls", "time"], timed_rows=True,
    axes=("contacts", "coordinates", "method"),
)  # fmt: skip


# C22: complementarity costs more

PROBLEMS = {"redundant contacts of a patch": patch, "independent contacts of a pile": pile}
SIZES = (1, 2, 3, 4, 6, 8, 12, 14, 16, 20, 24, 28, 32, 40, 48, 56, 64, 80, 96, 128, 192, 300)
ROUNDS = {"quick": 7, "full": 15}
FRESH = 18  # number of sizes drawn to confirm a region; sizes in SIZES are then left out
# Ratios nearer to 1 decide nothing. Between processes on a busy machine medians near 1 moved by up to 40 % (pile of 8:
# 0.71 to 1.03), so the outcome of a single size can turn round; neighbouring sizes tell more.
CLEAR = 1.1
TIMES = ("decades", "ratio", "lower quartile", "upper quartile")
SAME_VELOCITY = 1e-5  # largest difference of an answer from daqp's, relative to |v⁻|


class Impact(NamedTuple):
    """One problem to be timed: its kind and its number of contacts."""

    problem: str
    contacts: int


def _new_sizes(study: Study, region: Region) -> list[Impact]:
    """Fresh numbers of contacts inside a region."""
    sizes = np.unique(np.geomspace(*region.ends("contacts", SIZES), FRESH).round().astype(int)).tolist()
    return [Impact(problem, contacts) for contacts in sizes if contacts not in SIZES for problem in PROBLEMS]


def _ratio(study: Study, case: Impact) -> dict[str, Any]:
    """Time both kernels in turns, and divide their times round by round."""
    impact = PROBLEMS[case.problem](case.contacts, np.random.default_rng([study.seed, case.contacts]))
    calls: dict[str, Call] = {"complementarity": lemke_call(impact), "IAPB": kernel_call(impact)}
    row: dict[str, Any] = {"problem": case.problem, "contacts": case.contacts} | dict.fromkeys(TIMES)
    found = {name: call().copy() for name, call in calls.items()}  # also loads their machine code
    answer = solver_call(impact, "daqp")()
    apart = max(np.linalg.norm(v_plus - answer) for v_plus in found.values())
    if apart > SAME_VELOCITY * np.linalg.norm(impact.velocity):  # the methods solve different problems
        return row
    times = take_turns({name: sampler(call) for name, call in calls.items()}, ROUNDS[study.depth])
    ratio = times["complementarity"].over(times["IAPB"])
    values = float(np.log10(ratio.median)), ratio.median, ratio.lower, ratio.upper
    return row | dict(zip(TIMES, values, strict=True))


def costs_more(row: Row) -> bool | None:
    """Return True if complementarity clearly costs more, False if it clearly costs less, None in between."""
    if row["ratio"] is None:
        return None
    return True if row["lower quartile"] >= CLEAR else False if row["upper quartile"] <= 1.0 / CLEAR else None


def _ratio_says(table: Table) -> str:
    texts = []
    for part in dict.fromkeys(table.column("problem")):
        rows = table.where(problem=part)
        ratios = [ratio for ratio in rows.column("ratio") if ratio is not None]
        texts.append(f"For {part} it is {min(ratios):.2g} to {max(ratios):.2g} (median {np.median(ratios):.2g}); of "
                     f"the {len(rows.decided)} sizes that differ clearly, {sum(rows.decided)} are above 1, and "
                     f"{len(rows.rows) - len(rows.decided)} of {len(rows.rows)} sizes cannot tell.")  # fmt: skip
    return f"The ratio is the time of one impact by Lemke's method over that by IAPB, both compiled. {' '.join(texts)}"


C22 = Check(
    key="C22", question="Complementarity time-stepping costs more per step than impulses and penalties.",
    place="Section II",
    quantity="CPU time of an impact by complementarity, divided by that of IAPB. Both are compiled and timed in turns "
    "in one run, in random order. The impacts have 1 to 300 contacts on a patch (all but three redundant) or in a pile "
    "(none redundant), and both methods have the same v⁺. Calls from Python are not part of the claim.",
    tolerance="A trial holds if the lower quartile of the ratios is at least 1.1, and fails if the upper quartile is "
    "at most 1/1.1; in between it cannot tell. On a busy machine the median ratio of a size moved by up to 40 % "
    "between runs, so the outcome of a single size can change.",
    cases=lambda study: [Impact(problem, contacts) for contacts in SIZES for problem in PROBLEMS],
    row=_ratio, holds=costs_more, says=_ratio_says, draw=_new_sizes, parts=["problem"], conditions=["contacts"],
    timed=TIMES, timed_rows=True, axes=("contacts", "decades", "problem"),
)  # fmt: skip

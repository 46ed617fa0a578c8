"""C22: complementarity time-stepping costs more per step (section II)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from verification.claims.claim import Claim
from verification.clock import sampler, take_turns
from verification.cost.calls import Call, KernelCall, LemkeCall, solver_call
from verification.cost.step_cost import patch, pile
from verification.finding import Column, Region, Row, Table

if TYPE_CHECKING:
    from verification.claims.study import Study

PARTS = {"redundant contacts of a patch": patch, "independent contacts of a pile": pile}
COLUMNS = (
    Column("problem", part=True),
    Column("contacts", condition=True),
    Column("decades", timed=True),
    Column("ratio", timed=True),
    Column("lower quartile", timed=True),
    Column("upper quartile", timed=True),
)
CONTACTS = (1, 2, 3, 4, 6, 8, 12, 14, 16, 20, 24, 28, 32, 40, 48, 56, 64, 80, 96, 128, 192, 300)
ROUNDS = {"quick": 7, "full": 15}
FRESH = 18  # number of sizes drawn to confirm a region; sizes in CONTACTS are then left out
# Ratios nearer to 1 decide nothing. Between processes on a busy machine medians near 1 moved by up to 40 % (pile of 8:
# 0.71 to 1.03), so the outcome of a single size can turn round; neighbouring sizes tell more.
CLEAR = 1.1
SAME_VELOCITY = 1e-5  # largest difference of an answer from daqp's, relative to |v⁻|


class Impact(NamedTuple):
    """One problem to be timed: its kind and its number of contacts."""

    problem: str
    contacts: int


def cases(study: Study) -> list[Impact]:
    """Every size of both problems."""
    return [Impact(problem, contacts) for contacts in CONTACTS for problem in PARTS]


def draw(study: Study, region: Region) -> list[Impact]:
    """Fresh numbers of contacts inside a region."""
    sizes = np.unique(np.geomspace(*region.ends("contacts", CONTACTS), FRESH).round().astype(int)).tolist()
    return [Impact(problem, contacts) for contacts in sizes if contacts not in CONTACTS for problem in PARTS]


def trials(study: Study, case: Impact) -> Iterator[dict[str, Any]]:
    """Yield the trial of one size: time both kernels in turns, and divide their times round by round."""
    impact = PARTS[case.problem](case.contacts, np.random.default_rng([study.seed, case.contacts]))
    calls: dict[str, Call] = {"complementarity": LemkeCall(impact), "IAPB": KernelCall(impact)}
    row: dict[str, Any] = {"problem": case.problem, "contacts": case.contacts}
    found = {name: call().copy() for name, call in calls.items()}  # also loads their machine code
    answer = solver_call(impact, "daqp")()
    apart = max(np.linalg.norm(v_plus - answer) for v_plus in found.values())
    if apart <= SAME_VELOCITY * np.linalg.norm(impact.velocity):  # otherwise the methods solve different problems
        times = take_turns({name: sampler(call) for name, call in calls.items()}, ROUNDS[study.depth])
        ratio = times["complementarity"].over(times["IAPB"])
        row |= {"decades": float(np.log10(ratio.median)), "ratio": ratio.median, "lower quartile": ratio.lower,
                "upper quartile": ratio.upper}  # fmt: skip
    yield row


def holds(row: Row) -> bool | None:
    """Return True if complementarity clearly costs more, False if it clearly costs less, None in between."""
    if row["ratio"] is None:
        return None
    return True if row["lower quartile"] >= CLEAR else False if row["upper quartile"] <= 1.0 / CLEAR else None


def finding(table: Table) -> str:
    """Return the result in words, with numbers."""
    texts = []
    for part in dict.fromkeys(table.column("problem")):
        trials = table.where(problem=part)
        ratios = [ratio for ratio in trials.column("ratio") if ratio is not None]
        decided = [held for held in trials.holds if held is not None]
        texts.append(f"{part}: {min(ratios):.2g} to {max(ratios):.2g}, median {np.median(ratios):.2g}, "
                     f"above 1 in {sum(decided)} of the {len(decided)} sizes that differ clearly, "
                     f"{len(trials.rows) - len(decided)} of {len(trials.rows)} sizes cannot tell")  # fmt: skip
    return f"Time of one impact by Lemke's method, divided by that of IAPB, both compiled: {'; '.join(texts)}."


CLAIM = Claim(
    id="C22",
    statement="Complementarity time-stepping costs more per step than impulses and penalties.",
    place="Section II",
    quantity="CPU time of an impact by complementarity, divided by that of IAPB. Both are compiled and timed in turns "
    "in one run, in random order. The impacts have 1 to 300 contacts on a patch (all but three redundant) or in a pile "
    "(none redundant), and both methods have the same v⁺. Calls from Python are not part of the claim.",
    tolerance="A trial holds if the lower quartile of the ratios is at least 1.1, and fails if the upper quartile is "
    "at most 1/1.1; in between it cannot tell. On a busy machine the median ratio of a size moved by up to 40 % "
    "between runs, so a single size can turn round.",
    columns=COLUMNS,
    cases=cases,
    trials=trials,
    holds=holds,
    finding=finding,
    draw=draw,
    axes=("contacts", "decades", "problem"),
)

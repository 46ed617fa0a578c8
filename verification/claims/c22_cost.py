"""C22: complementarity time-stepping costs more per step (section II)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from verification.claims.claim import Claim
from verification.cost.step_cost import impact_cost, rivals
from verification.finding import Column, Region, Row, Table

if TYPE_CHECKING:
    from verification.claims.study import Study
    from verification.cost.step_cost import Rivals

COLUMNS = (
    Column("problem", part=True),
    Column("contacts", condition=True),
    Column("decades", timed=True),
    Column("ratio", timed=True),
    Column("least ratio", timed=True),
    Column("largest ratio", timed=True),
)
PARTS = {"patch": "redundant contacts of a patch", "pile": "independent contacts of a pile"}
CONTACTS = (1, 2, 4, 8, 16, 32, 64, 128, 300)
REPEATS = {"quick": 5, "full": 9}
LONGEST = 1.0  # seconds for one impact, beyond which a solver is not asked for more contacts
FRESH = 14  # sizes that confirm a region


def cases(study: Study) -> Iterable[Rivals]:
    """Impacts by complementarity and by IAPB in turns, both compiled."""
    return _timed(study, CONTACTS)


def draw(study: Study, region: Region) -> Iterable[Rivals]:
    """Fresh numbers of contacts inside a region."""
    sizes = np.geomspace(*region.ends("contacts", CONTACTS), FRESH).round().astype(int)
    return _timed(study, tuple(size for size in np.unique(sizes).tolist() if size not in CONTACTS))


def _timed(study: Study, contacts: tuple[int, ...]) -> list[Rivals]:
    """The compiled solver that solved each problem, as daqp's answer shows, with IAPB's kernel."""
    rows = impact_cost(contacts, ("daqp",), REPEATS[study.depth], study.seed, LONGEST)
    return [pair for pair in rivals(rows) if pair.called == "compiled" and pair.solver.verdict == "solved"]


def trials(study: Study, pair: Rivals) -> Iterator[dict[str, Any]]:
    """One size."""
    yield {"problem": PARTS[pair.solver.family], "contacts": pair.solver.contacts, **_ratios(pair.solver, pair.ours)}


def _ratios(theirs: Any, ours: Any) -> dict[str, float]:
    """Complementarity's time over IAPB's: of the medians (and its log₁₀), and the ends that the samples allow."""
    ratio = theirs.median / ours.median
    return {"decades": float(np.log10(ratio)), "ratio": ratio, "least ratio": theirs.least / ours.largest,
            "largest ratio": theirs.largest / ours.least}  # fmt: skip


def holds(row: Row) -> bool | None:
    """Every sample of complementarity costs more than every sample of IAPB; None where the samples overlap."""
    if row["least ratio"] <= 1.0 <= row["largest ratio"]:
        return None
    return bool(row["ratio"] > 1.0)


def finding(table: Table) -> str:
    """One sentence."""
    texts = []
    for part in dict.fromkeys(table.column("problem")):
        trials = table.where(problem=part)
        ratios, decided = trials.column("ratio"), [held for held in trials.holds if held is not None]
        texts.append(f"{part}: {min(ratios):.2g} to {max(ratios):.2g}, median {np.median(ratios):.2g}, "
                     f"more in {sum(decided)} of {len(decided)} that differ clearly")  # fmt: skip
    return f"Time of one impact by Lemke's method over time by IAPB, both compiled: {'; '.join(texts)}."


CLAIM = Claim(
    id="C22",
    statement="Complementarity time-stepping costs more per step than impulses and penalties.",
    place="Section II",
    quantity="Ratio of times, complementarity over IAPB, in one run and in turns: of impacts of 1 to 300 contacts on a "
    "patch (all but three redundant) and in a dense pile (none). Both are compiled; what is called from Python is no "
    "part of the claim.",
    tolerance="A trial holds where all samples of one lie above all of the other's; where they overlap it cannot tell.",
    columns=COLUMNS,
    cases=cases,
    trials=trials,
    holds=holds,
    finding=finding,
    draw=draw,
    axes=("contacts", "decades", "problem"),
)

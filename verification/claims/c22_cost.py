"""C22: complementarity time-stepping costs more per step (section II)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from verification.claims.claim import Claim
from verification.finding import Column, Row, Table, table_of

if TYPE_CHECKING:
    from verification.claims.study import Study

COMPILED, CALLED, STEP = "impact, compiled", "impact, from Python", "step of a world"
COLUMNS = (
    Column("part", part=True),
    Column("problem", condition=True),
    Column("solver", condition=True),
    Column("contacts", condition=True),
    Column("decades", timed=True),
    Column("ratio", timed=True),
    Column("least ratio", timed=True),
    Column("largest ratio", timed=True),
)
CONTACTS = {"quick": (1, 4, 16, 64, 300), "full": (1, 2, 4, 8, 16, 32, 64, 128, 300)}
SOLVERS = {"quick": ("daqp", "quadprog", "lemke"), "full": ("daqp", "quadprog", "lemke", "gauss_seidel", "proxqp")}
REPEATS = {"quick": 5, "full": 9}
SCENES = ("peg_corner", "peg_hole")
STEPS = {"quick": 256, "full": 512}  # the pegs touch after some 150 steps
LONGEST = 1.0  # seconds for one impact, beyond which a solver is not asked for more contacts


def measure(study: Study) -> Table:
    """Impacts and steps, each by complementarity and by IAPB in turns, as ratios of their times."""
    return table_of(COLUMNS, study.each((_impacts, _steps), lambda part: part(study)))


def _impacts(study: Study) -> Iterator[dict[str, Any]]:
    from verification.cost.step_cost import impact_cost, rivals

    depth = study.depth
    rows = impact_cost(CONTACTS[depth], SOLVERS[depth], REPEATS[depth], study.seed, LONGEST)
    for pair in rivals(rows):
        if pair.solver.verdict == "solved":
            yield {"part": COMPILED if pair.called == "compiled" else CALLED, "problem": pair.solver.family,
                   "solver": pair.solver.solver, "contacts": pair.solver.contacts,
                   **_ratios(pair.solver, pair.ours)}  # fmt: skip


def _steps(study: Study) -> Iterator[dict[str, Any]]:
    from verification.cost.step_cost import IDEAL, STEPPED, step_rivals, world_cost

    rows = world_cost(SCENES, REPEATS[study.depth], STEPS[study.depth], (STEPPED, IDEAL))
    for theirs, ours in step_rivals(rows):
        yield {"part": STEP, "problem": theirs.scene, "solver": theirs.way,
               "contacts": _most_contacts(study, theirs.scene), **_ratios(theirs, ours)}  # fmt: skip


def _most_contacts(study: Study, scene: str) -> int:
    """The largest number of contacts in one of the steps that are timed."""
    from reference.worlds import run_world

    run = run_world(study.scene(scene), "IAPB", steps=STEPS[study.depth])
    return int(np.diff(run.contacts.offsets).max(initial=0))


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
    for part in dict.fromkeys(table.column("part")):
        trials = table.where(part=part)
        ratios, decided = trials.column("ratio"), [held for held in trials.holds if held is not None]
        texts.append(f"{part}: {min(ratios):.2g} to {max(ratios):.2g}, median {np.median(ratios):.2g}, "
                     f"more in {sum(decided)} of {len(decided)} that differ clearly")  # fmt: skip
    return f"Time by complementarity over time by IAPB, {'; '.join(texts)}."


CLAIM = Claim(
    id="C22",
    statement="Complementarity time-stepping costs more per step than impulses and penalties.",
    place="Section II",
    quantity="Ratio of times, complementarity over IAPB, in one run and in turns: of impacts of 1 to 300 contacts on a "
    "patch (all but three redundant) and in a dense pile (none), and of whole steps of the peg scenes.",
    tolerance="A trial holds where all samples of one lie above all of the other's; where they overlap it cannot tell. "
    "Kernels are compared with kernels, calls from Python with calls from Python.",
    measure=measure,
    holds=holds,
    finding=finding,
    map_axes=("contacts", "decades"),
    map_panels="part",
)

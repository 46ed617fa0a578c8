"""C09: with e = −1 the simulation is the penalty-based one (section VI)."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from iapb import resolve_impact
from verification.claims.algebraic import within_bound, worst
from verification.claims.claim import Claim
from verification.claims.conditions import columns
from verification.finding import Column, Table, table_of
from verification.impacts import Family, draw_of_rank

if TYPE_CHECKING:
    from iapb.run import Run
    from iapb.scene import Scene
    from verification.claims.conditions import Condition
    from verification.claims.study import Study

RESOLVER = "velocity after an impact with e = -1"
TRAJECTORY = "trajectory with e = -1"
ALMOST = "trajectory with e one rounding above -1"
COLUMNS = (
    Column("part", part=True),
    *columns("tilt", "clearance", "travel", "friction", "approach_velocity"),
    Column("contacts", condition=True),
    Column("impacts"),
    Column("error"),
    Column("bound"),
)
FAMILIES = (Family(1, 1, 1, 1e0), Family(3, 6, 3, 1e2), Family(6, 20, 4, 1e4), Family(12, 60, 8, 1e8))
IMPACTS = {"quick": 20, "full": 300}

JUST_ABOVE = float(np.nextafter(-1.0, 0.0))
# An impulse of 1e-16 of the prescribed one moves the 2 kg peg by 1e-17 m; contacts may magnify that [m, rad].
SAME_TRAJECTORY = 1e-11


def measure(study: Study) -> Table:
    """Impacts with e = −1, and runs of the peg with e = −1, and just above it."""
    count = IMPACTS[study.depth]
    drawn = study.each(FAMILIES, lambda family: [_impacts(family, count, study.seed)])
    return table_of(COLUMNS, [*drawn, *study.each(study.starts(), partial(_trajectories, study))])


def _impacts(family: Family, count: int, seed: int) -> dict[str, Any]:
    instances = draw_of_rank(family, count, seed)
    moved = worst(float(np.abs(resolve_impact(*i.arrays, -1.0).velocity - i.velocity).max()) for i in instances)
    return {"part": RESOLVER, "contacts": family.contacts, "impacts": count, "error": moved, "bound": 0.0}


def _trajectories(study: Study, condition: Condition) -> Iterator[dict[str, Any]]:
    scene = study.place(condition)
    penalty = study.trace(condition, "PB")
    for part, e, bound in ((TRAJECTORY, -1.0, 0.0), (ALMOST, JUST_ABOVE, SAME_TRAJECTORY)):
        run = _run_with(scene, e)
        error = max(float(np.abs(run.device_q - penalty.device).max()), float(np.abs(run.q - penalty.tool).max()))
        yield condition.record() | {"part": part, "impacts": len(run.impacts.step), "error": error, "bound": bound}


def _run_with(scene: Scene, restitution: float) -> Run:
    """Run IAPB with a negative e. Scene files are not allowed one, so this run is not for a store."""
    from verification.claims.study import run_directly

    contact = scene.contact.model_copy(update={"restitution": restitution})
    return run_directly(scene.model_copy(update={"contact": contact}), "IAPB", "full")


def finding(table: Table) -> str:
    """One sentence."""
    impacts, exactly, almost = (table.where(part=part) for part in (RESOLVER, TRAJECTORY, ALMOST))
    return (
        f"An impact with e = -1 changes no velocity in {sum(impacts.column('impacts'))} impacts (largest change "
        f"{max(impacts.column('error')):.0e}); {len(exactly.rows)} trajectories with e = -1 differ from PB by at most "
        f"{max(exactly.column('error')):.0e}; one rounding above -1, with {sum(almost.column('impacts'))} collisions "
        f"resolved on the way, by up to {max(almost.column('error')):.0e} m or rad: colliding steps have no penalty "
        f"force."
    )


CLAIM = Claim(
    id="C09",
    statement="With e = -1 the simulation is the penalty-based simulation.",
    place="Section VI",
    quantity="Largest change of velocity by an impact with e = -1; largest distance between the trajectories of "
    "device and tool and those of PB.",
    tolerance="None at e = -1. One rounding above it 1e-11 m or rad: 1e-16 of every impulse, magnified by contacts.",
    measure=measure,
    holds=within_bound,
    finding=finding,
)

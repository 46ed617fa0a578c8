"""C09: with e = −1 the simulation equals the penalty-based simulation (section VI)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from iapb import resolve_impact
from verification.claims.algebraic import within_bound, worst
from verification.claims.claim import Claim
from verification.claims.conditions import Condition, columns
from verification.claims.study import run_directly
from verification.finding import Column, Table
from verification.impacts import Family, draw_of_rank
from verification.scenes.trace import COORDINATES

if TYPE_CHECKING:
    from iapb.run import Run
    from iapb.scene import Scene
    from verification.claims.study import Study

RESOLVER = "velocity after an impact with e = -1"
TRAJECTORY = "trajectory with e = -1"
ALMOST = "trajectory at the next double above e = -1"
COLUMNS = (
    Column("part", part=True),
    Column("coordinate", part=True),
    *columns("tilt", "clearance", "travel", "friction", "approach_velocity"),
    Column("contacts", condition=True),
    Column("impacts", cases=True),
    Column("error"),
    Column("bound"),
)
FAMILIES = (Family(1, 1, 1, 1e0), Family(3, 6, 3, 1e2), Family(6, 20, 4, 1e4), Family(12, 60, 8, 1e8))
IMPACTS = {"quick": 20, "full": 300}

JUST_ABOVE = float(np.nextafter(-1.0, 0.0))
# An impulse of 1e-16 of its usual size moves the 2 kg peg by 1e-17 m; contacts may amplify this distance [m, rad].
SAME_TRAJECTORY = 1e-11


def cases(study: Study) -> list[Family | Condition]:
    """Families of impacts with e = −1, and starts of the peg, which run with e = −1 and just above."""
    return [*FAMILIES, *study.starts()]


def trials(study: Study, case: Family | Condition) -> Iterator[dict[str, Any]]:
    """Yield the trial of one batch; or, per coordinate, the distances of two trajectories from that of PB."""
    if isinstance(case, Family):
        impacts = list(draw_of_rank(case, IMPACTS[study.depth], study.seed))
        moved = worst(float(np.abs(resolve_impact(*i.arrays, -1.0).velocity - i.velocity).max()) for i in impacts)
        yield {"part": RESOLVER, "coordinate": "all", "contacts": case.contacts, "impacts": len(impacts),
               "error": moved, "bound": 0.0}  # fmt: skip
        return
    penalty = study.trace(case, "PB")
    for part, e, bound in ((TRAJECTORY, -1.0, 0.0), (ALMOST, JUST_ABOVE, SAME_TRAJECTORY)):
        run = _run_with(study.place(case), e)
        apart = np.maximum(np.abs(run.device_q - penalty.device).max(0), np.abs(run.q - penalty.tool).max(0))
        common = case.record() | {"part": part, "impacts": len(run.impacts.step), "bound": bound}
        for coordinate, error in zip(COORDINATES, apart, strict=True):
            yield common | {"coordinate": coordinate, "error": float(error)}


def _run_with(scene: Scene, restitution: float) -> Run:
    """Run IAPB with a negative e. Scene files may not have a negative e, so this run is not stored."""
    contact = scene.contact.model_copy(update={"restitution": restitution})
    return run_directly(scene.model_copy(update={"contact": contact}), "IAPB", "full")


def finding(table: Table) -> str:
    """Return the result in words, with numbers."""
    impacts, exactly, almost = (table.where(part=part) for part in (RESOLVER, TRAJECTORY, ALMOST))
    once = almost.where(coordinate="x")
    return (
        f"{sum(impacts.column('impacts'))} impacts with e = -1 change no velocity (largest change "
        f"{max(impacts.column('error')):.0e}). {len(once.rows)} trajectories with e = -1 differ from PB by at most "
        f"{max(exactly.column('error')):.0e}. With the next double above e = -1 the {len(once.rows)} trajectories "
        f"resolve {sum(once.column('impacts'))} collisions and differ from PB by up to "
        f"{max(almost.column('error')):.0e} m or rad, because colliding steps have no penalty force."
    )


CLAIM = Claim(
    id="C09",
    statement="With e = -1 the simulation is the penalty-based simulation.",
    place="Section VI",
    quantity="Largest change of velocity by an impact with e = -1; largest distance between the trajectories of "
    "device and tool and those of PB, by coordinate.",
    tolerance="Zero at e = -1. At the next double above it 1e-11 m or rad: impulses change by 1e-16 of their size, and "
    "contacts amplify this.",
    columns=COLUMNS,
    cases=cases,
    trials=trials,
    holds=within_bound,
    finding=finding,
)

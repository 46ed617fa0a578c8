"""C17: the energy lost on impact does not depend on contact stiffness and damping (section II)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from verification.claims.claim import Claim
from verification.claims.conditions import Condition, columns, wall_conditions
from verification.finding import Column, Row, Table, table_of

if TYPE_CHECKING:
    from verification.claims.study import Study
    from verification.scenes.trace import Trace

COLUMNS = (
    *columns("tilt", "stiffness", "damping"),
    Column("lost on first impact", "J"),
    Column("of the reference", "J"),
    Column("lost on all impacts", "J"),
    Column("PB, lost within 20 ms", "J"),
)

# The state before the first impact has not felt the walls: not one bit may differ beyond the energy's own rounding.
SAME = 1e-12
SHORTLY = 0.020  # [s] after first contact: what a penalty takes in the time it needs to stop the peg


def measure(study: Study) -> Table:
    """Two tilts, five stiffnesses, five dampings."""
    return table_of(COLUMNS, study.each(wall_conditions(), lambda condition: [_trial(study, condition)]))


def _trial(study: Study, condition: Condition) -> dict[str, Any]:
    default = Condition()
    reference = replace(condition, stiffness=default.stiffness, damping=default.damping)
    ours, theirs = study.trace(condition, "IAPB"), study.trace(reference, "IAPB")
    return condition.record() | {
        "lost on first impact": _first_loss(ours),
        "of the reference": _first_loss(theirs),
        "lost on all impacts": float(ours.energy_lost.sum()),
        "PB, lost within 20 ms": _lost_shortly(study.trace(condition, "PB")),
    }


def _first_loss(trace: Trace) -> float:
    return float(trace.energy_lost[0]) if len(trace.energy_lost) else 0.0


def _lost_shortly(trace: Trace) -> float:
    """Kinetic energy of the tool at first contact minus that of SHORTLY later [J]."""
    start = min(trace.first_contact, len(trace.time) - 1)
    end = min(start + round(SHORTLY / trace.dt), len(trace.time) - 1)
    return float(trace.kinetic_energy[start] - trace.kinetic_energy[end])


def holds(row: Row) -> bool | None:
    """The loss is that of the reference walls; None where there was no impact."""
    lost, reference = row["lost on first impact"], row["of the reference"]
    return bool(abs(lost - reference) <= SAME * reference) if reference > 0.0 else None


def finding(table: Table) -> str:
    """One sentence."""
    texts = []
    for tilt in dict.fromkeys(table.column("tilt")):
        trials = table.where(tilt=tilt)
        losses, reference = np.array(trials.column("lost on first impact")), trials.column("of the reference")[0]
        total = [1e3 * pick(trials.column("lost on all impacts")) for pick in (min, max)]
        penalty = [1e3 * pick(trials.column("PB, lost within 20 ms")) for pick in (min, max)]
        texts.append(
            f"tilt {tilt:g} rad: {1e3 * reference:.4g} mJ, the same within {np.ptp(losses) / reference:.0e}; over all "
            f"impacts of the run {total[0]:.3g} to {total[1]:.3g} mJ; PB loses {penalty[0]:.2g} to {penalty[1]:.3g} mJ"
        )
    return f"Lost on the first impact with {'; with '.join(texts)} in 20 ms."


CLAIM = Claim(
    id="C17",
    statement="The energy lost on impact does not depend on contact stiffness and damping.",
    place="Section II",
    quantity="Kinetic energy lost in the first impact, against that with the paper's walls. Later impacts start from "
    "states that the walls have shaped: their total is beside it, as is what PB takes.",
    tolerance="1e-12 of the loss: the state before the first impact is the same to the last bit.",
    measure=measure,
    holds=holds,
    finding=finding,
    map_axes=("stiffness", "damping"),
    map_panels="tilt",
)

"""C17: the energy lost on impact does not depend on contact stiffness and damping (section II)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from verification.claims.claim import Claim
from verification.claims.conditions import Condition, columns, wall_conditions
from verification.finding import Column, Row, Table

if TYPE_CHECKING:
    from verification.claims.study import Study
    from verification.scenes.trace import Trace

FIRST, ALL = "the first impact", "all impacts of the run"
COLUMNS = (
    Column("part", part=True),
    *columns("tilt", "stiffness", "damping"),
    Column("lost", "J"),
    Column("of the reference", "J"),
    Column("PB, lost within 20 ms", "J"),
)

# No wall has acted before the first impact, so its state is the same for all walls; only the energy's rounding differs.
SAME = 1e-12
SHORTLY = 0.020  # [s] after first contact: about the time that a penalty force needs to stop the peg


def trials(study: Study, condition: Condition) -> Iterator[dict[str, Any]]:
    """Yield the trials of one wall, compared with the paper's wall."""
    default = Condition()
    reference = replace(condition, stiffness=default.stiffness, damping=default.damping)
    ours, theirs = study.trace(condition, "IAPB"), study.trace(reference, "IAPB")
    common = condition.record() | {"PB, lost within 20 ms": _lost_shortly(study.trace(condition, "PB"))}
    yield common | {"part": FIRST, "lost": _first_loss(ours), "of the reference": _first_loss(theirs)}
    if condition != reference:
        yield common | {"part": ALL, "lost": float(ours.energy_lost.sum()),
                        "of the reference": float(theirs.energy_lost.sum())}  # fmt: skip


def _first_loss(trace: Trace) -> float:
    return float(trace.energy_lost[0]) if len(trace.energy_lost) else 0.0


def _lost_shortly(trace: Trace) -> float:
    """Kinetic energy of the tool at first contact minus that SHORTLY later [J]."""
    start = min(trace.first_contact, len(trace.time) - 1)
    end = min(start + round(SHORTLY / trace.dt), len(trace.time) - 1)
    return float(trace.kinetic_energy[start] - trace.kinetic_energy[end])


def holds(row: Row) -> bool | None:
    """Return whether the loss equals that at the reference walls; None if the reference has no impact."""
    lost, reference = row["lost"], row["of the reference"]
    return bool(abs(lost - reference) <= SAME * reference) if reference > 0.0 else None


def finding(table: Table) -> str:
    """Return the result in words, with numbers."""
    texts = []
    for tilt in dict.fromkeys(table.column("tilt")):
        first, every = (table.where(tilt=tilt, part=part) for part in (FIRST, ALL))
        losses, reference = np.array(first.column("lost")), first.column("of the reference")[0]
        total = [1e3 * pick(every.column("lost")) for pick in (min, max)]
        penalty = [1e3 * pick(first.column("PB, lost within 20 ms")) for pick in (min, max)]
        texts.append(
            f"At a tilt of {tilt:g} rad the first impact takes {1e3 * reference:.4g} mJ, for all walls alike within "
            f"{np.ptp(losses) / reference:.0e}; all impacts of a run take {total[0]:.3g} to {total[1]:.3g} mJ, "
            f"depending on the wall. PB takes {penalty[0]:.2g} to {penalty[1]:.3g} mJ within 20 ms."
        )
    return f"{' '.join(texts)} Later impacts depend on the walls because they start from states that the walls changed."


CLAIM = Claim(
    id="C17",
    statement="The energy lost on impact does not depend on contact stiffness and damping.",
    place="Section II",
    quantity="Kinetic energy lost in the first impact, and in all impacts of the run, compared with that at the "
    "paper's walls. The table also has the energy that PB takes.",
    tolerance="1e-12 of the loss. The state before the first impact is the same to the last bit for all walls, so a "
    "loss that does not depend on the walls is the same as well.",
    columns=COLUMNS,
    cases=lambda study: wall_conditions(),
    trials=trials,
    holds=holds,
    finding=finding,
    runs=(("IAPB", "full"), ("PB", "full")),
    axes=("stiffness", "damping", "part"),
)

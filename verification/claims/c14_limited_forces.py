"""C14: impulses within the device's limits still exceed the penalty forces on contact (Fig. 11)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from verification.claims.closeness import peg_claim
from verification.claims.conditions import START_COLUMNS, Condition, columns
from verification.finding import Column, Row, Table
from verification.scenes.measures import peak_force
from verification.scenes.trace import COORDINATES

if TYPE_CHECKING:
    from verification.claims.study import Study

COLUMNS = (
    *START_COLUMNS,
    *columns("force_limit"),
    Column("coordinate", part=True),
    Column("IAPB"),
    Column("PB"),
)

# A hundredth of the smallest force that a fingertip feels (0.05 N); for theta, that force at the peg's half length.
NOT_FELT = {"x": 5e-4, "y": 5e-4, "theta": 5e-6}


def trials(study: Study, condition: Condition) -> Iterator[dict[str, Any]]:
    """Yield the trials of one start and device limit, per coordinate; IAPB spreads its impulses over steps."""
    limited, penalty = peak_force(study.trace(condition, "IAPB", "spread")), peak_force(study.trace(condition, "PB"))
    for i, coordinate in enumerate(COORDINATES):
        yield condition.record() | {"coordinate": coordinate, "IAPB": float(limited[i]), "PB": float(penalty[i])}


def holds(row: Row) -> bool | None:
    """Return whether the peak of IAPB is above that of PB; None if neither peak can be felt."""
    if max(row["IAPB"], row["PB"]) < NOT_FELT[row["coordinate"]]:
        return None
    return bool(row["IAPB"] > row["PB"])


def finding(table: Table) -> str:
    """Return the result in words, with numbers."""
    texts = []
    for coordinate in COORDINATES:
        trials = table.where(coordinate=coordinate)
        felt = [row for row, held in zip(trials.records(), trials.holds, strict=True) if held is not None]
        ratios = [row["IAPB"] / row["PB"] for row in felt if row["PB"] > 0.0]
        texts.append(f"{coordinate} median {np.median(ratios):.2g}, least {min(ratios):.2g}")
    return f"Peak force of IAPB with device limits, divided by PB's peak force: {'; '.join(texts)}."


CLAIM = peg_claim(
    id="C14",
    statement="Impulses kept within the device's limits still exceed the penalty forces felt on contact.",
    place="Section VI, Fig. 11",
    quantity="Peak force of the device's actuators over the run, per coordinate, IAPB spread against PB.",
    tolerance="IAPB's peak is strictly larger. A coordinate does not count if neither peak reaches a hundredth of the "
    "smallest force that can be felt.",
    columns=COLUMNS,
    trials=trials,
    holds=holds,
    finding=finding,
    runs=(("IAPB", "spread"), ("PB", "full")),
    limited=True,
    axes=("tilt", "force_limit", "coordinate"),
)

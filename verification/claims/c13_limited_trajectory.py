"""C13: with force limits, IAPB (impulses spread) stays closest to ideal and penetrates less than PB (Fig. 10)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from verification.claims.closeness import COLUMNS as DISTANCE_COLUMNS
from verification.claims.closeness import closest, distances, median_ratio, peg_claim
from verification.claims.conditions import Condition, columns
from verification.finding import Row, Table
from verification.scenes.measures import deepest_penetration
from verification.scenes.trace import COORDINATES

if TYPE_CHECKING:
    from verification.claims.study import Study

PENETRATION = "penetration"
COLUMNS = (*columns("force_limit"), *DISTANCE_COLUMNS)


def trials(study: Study, condition: Condition) -> Iterator[dict[str, Any]]:
    """Yield the trials of one start and device limit, per coordinate; IAPB spreads its impulses over steps."""
    yield from distances(study, condition, "spread")
    depths = {
        "IAPB": deepest_penetration(study.trace(condition, "IAPB", "spread")),
        "PB": deepest_penetration(study.trace(condition, "PB")),
    }
    yield condition.record() | {"coordinate": PENETRATION} | depths


def holds(row: Row) -> bool | None:
    """Return whether IAPB is closest to ideal in this coordinate, or penetrates less than PB."""
    if row["coordinate"] == PENETRATION:
        return bool(row["IAPB"] < row["PB"])
    return closest(row)


def finding(table: Table) -> str:
    """Return the result in words, with numbers."""
    depths = table.where(coordinate=PENETRATION)
    ratios = ", ".join(f"{median_ratio(table, name, 'PB'):.2f} in {name}" for name in COORDINATES)
    medians = [1e3 * float(np.median(depths.column(world))) for world in ("IAPB", "PB")]
    return (
        f"With limits the distance of IAPB to ideal, divided by that of PB, has these medians: {ratios}. The median "
        f"penetration is {medians[0]:.2f} mm with IAPB and {medians[1]:.2f} mm with PB."
    )


CLAIM = peg_claim(
    id="C13",
    statement="With device limits, IAPB stays closest to ideal and penetrates less than PB.",
    place="Section VI, Fig. 10",
    quantity="As C10, with the impulses spread over steps at 1 and 0.3 times the paper's limits; deepest overlap of "
    "tool and walls.",
    tolerance="IAPB's value is strictly the smallest. A trial cannot tell if all three are within 1e-7 of ideal.",
    columns=COLUMNS,
    trials=trials,
    holds=holds,
    finding=finding,
    runs=(("ideal", "full"), ("IAPB", "spread"), ("PB", "full"), ("CBuc", "full")),
    limited=True,
    axes=("tilt", "clearance", "coordinate"),
)

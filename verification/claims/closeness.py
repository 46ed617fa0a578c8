"""Claims on the peg in the corner, and the distances of the device trajectories from "ideal" (C10, C13)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from verification.claims.claim import Claim
from verification.claims.conditions import START_COLUMNS, Condition
from verification.finding import Column, Row, Table
from verification.scenes.measures import comparison_window, largest_distance, root_mean_square
from verification.scenes.trace import COORDINATES

if TYPE_CHECKING:
    from verification.claims.study import Study

COLUMNS = (
    *START_COLUMNS,
    Column("coordinate", part=True),
    Column("IAPB"),
    Column("PB"),
    Column("CBuc"),
    Column("IAPB, largest"),
    Column("PB, largest"),
    Column("CBuc, largest"),
)

# Number of fresh starts that confirm a region. If a tenth of its starts fail, a region is confirmed once in 24 times.
FRESH = 30
# Neither a hand nor a figure shows distances below this [m, rad] (a tenth of a micrometre). A trial decides nothing in
# a coordinate in which every world is that close to ideal, such as the angle of a peg that lies flat.
INDISTINGUISHABLE = 1e-7


def peg_claim(*, limited: bool = False, **words: Any) -> Claim:
    """Return a claim on every start of the peg, with device limits or without; `words` are the other fields of Claim.

    To confirm a region, FRESH starts are drawn at random inside it.
    """

    def cases(study: Study) -> tuple[Condition, ...]:
        return study.limited() if limited else study.starts()

    return Claim(**{"cases": cases, "draw": lambda study, region: study.fresh(cases(study), region, FRESH)} | words)


def distances(study: Study, condition: Condition, rendering: str) -> Iterator[dict[str, Any]]:
    """Yield one trial per coordinate: RMS and largest distance of each world from ideal."""
    ideal = study.trace(condition, "ideal")
    worlds = {
        "IAPB": study.trace(condition, "IAPB", rendering),
        "PB": study.trace(condition, "PB"),
        "CBuc": study.trace(condition, "CBuc"),
    }
    window = comparison_window([ideal, *worlds.values()])
    mean = {name: root_mean_square(trace, ideal, window) for name, trace in worlds.items()}
    peak = {f"{name}, largest": largest_distance(trace, ideal, window) for name, trace in worlds.items()}
    for i, coordinate in enumerate(COORDINATES):
        numbers = {name: float(values[i]) for name, values in (mean | peak).items()}
        yield condition.record() | {"coordinate": coordinate} | numbers


def closest(row: Row) -> bool | None:
    """Return whether IAPB is nearer to ideal (RMS) than PB and CBuc; None if all are indistinguishable from ideal."""
    if max(row["IAPB"], row["PB"], row["CBuc"]) < INDISTINGUISHABLE:
        return None
    return bool(row["IAPB"] < min(row["PB"], row["CBuc"]))


def median_ratio(table: Table, coordinate: str, other: str) -> float:
    """Median of distance(IAPB) / distance(other) over the decided trials of a coordinate."""
    rows = [row for row, held in zip(table.records(), table.holds, strict=True)
            if held is not None and row["coordinate"] == coordinate]  # fmt: skip
    return float(np.median([row["IAPB"] / row[other] for row in rows])) if rows else np.nan

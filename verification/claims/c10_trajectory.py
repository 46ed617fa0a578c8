"""C10: the device's trajectory under IAPB is closer to ideal than under PB and CBuc (Fig. 7)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from verification.claims.closeness import COLUMNS, FRESH, closest, distances, median_ratio, peg_claim
from verification.claims.conditions import Condition
from verification.finding import Column, Region, Table
from verification.scenes.trace import COORDINATES

if TYPE_CHECKING:
    from verification.claims.study import Study

PAPERS, LARGER = "every contact that approaches collides", "from a larger speed on"


def trials(study: Study, condition: Condition) -> Iterator[dict[str, Any]]:
    """One start in the four worlds, by coordinate; the paper's own threshold is apart from those of ours."""
    threshold = PAPERS if condition.approach_velocity == Condition().approach_velocity else LARGER
    for row in distances(study, condition, rendering="full"):
        yield row | {"threshold": threshold}


def draw(study: Study, region: Region) -> list[Condition]:
    """Fresh starts, each with the paper's threshold and with one of ours."""
    found = study.fresh(study.starts(), region, FRESH)
    return [*(replace(start, approach_velocity=Condition().approach_velocity) for start in found), *found]


def finding(table: Table) -> str:
    """One sentence."""
    ratios = ", ".join(f"{median_ratio(table, name, 'PB'):.2f} in {name}" for name in COORDINATES)
    return (
        f"The distance of IAPB to ideal is, in the median, this multiple of PB's: {ratios}. In how many trials "
        "it is the smallest depends on the grid, most of all on its tilts."
    )


CLAIM = peg_claim(
    id="C10",
    statement="The device trajectory of IAPB is closest to ideal, ahead of PB and CBuc.",
    place="Section VI, Fig. 7",
    quantity="RMS distance of the device trajectory from the ideal world's, per coordinate, from the first contact "
    "until all four have settled, or to the end of the run; the largest distance beside it.",
    tolerance="Strictly the smallest of the three. Where all three are within 1e-7 of ideal the trial cannot tell.",
    columns=(*COLUMNS, Column("threshold", part=True)),
    trials=trials,
    holds=closest,
    finding=finding,
    runs=(("ideal", "full"), ("IAPB", "full"), ("PB", "full"), ("CBuc", "full")),
    draw=draw,
    axes=("tilt", "clearance", "coordinate"),
)

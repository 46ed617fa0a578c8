"""C10: the device's trajectory under IAPB is closer to ideal than under PB and CBuc (Fig. 7)."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from verification.claims.claim import Claim
from verification.claims.closeness import (
    COLUMNS,
    by_approach_velocity,
    by_coordinate,
    closest,
    distances,
    median_ratio,
)
from verification.finding import Table, table_of

if TYPE_CHECKING:
    from verification.claims.study import Study


def measure(study: Study) -> Table:
    """Every start, in the four worlds."""
    return table_of(COLUMNS, study.each(study.starts(), partial(distances, study, rendering="full")))


def finding(table: Table) -> str:
    """One sentence."""
    ratios = ", ".join(
        f"{median_ratio(table, name, 'PB'):.2f} in {name}" for name in ("x", "y", "theta")
    )
    return (
        f"IAPB is the closest in {by_coordinate(table)}. Its distance to ideal is, in the median, this multiple of "
        f"PB's: {ratios}. By the speed from which on a contact takes part in a collision: "
        f"{by_approach_velocity(table)}."
    )


CLAIM = Claim(
    id="C10",
    statement="The device trajectory of IAPB is closest to ideal, ahead of PB and CBuc.",
    place="Section VI, Fig. 7",
    quantity="RMS distance of the device trajectory from the ideal world's, per coordinate, from the first contact "
    "until all four have settled, or to the end of the run; the largest distance beside it.",
    tolerance="Strictly the smallest of the three. Where all three are within 1e-7 of ideal the trial cannot tell.",
    measure=measure,
    holds=closest,
    finding=finding,
    map_axes=("tilt", "clearance"),
    map_panels="coordinate",
)

"""C10: the device's trajectory under IAPB is closer to ideal than under PB and CBuc (Fig. 7)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from verification.claims.closeness import COLUMNS, FRESH, closest, distances, median_ratio, peg_claim
from verification.claims.conditions import Condition, even_grid, full_grid
from verification.finding import Column, Region, Table
from verification.scenes.trace import COORDINATES

if TYPE_CHECKING:
    from verification.claims.study import Study

# The groups of trials. With the paper's threshold every approaching contact collides: the starts of all claims, the
# full grid, and a subset of that grid. The group LARGER has our larger thresholds.
PAPERS, LARGER = "approach velocity 1e-6 m/s", "approach velocity above 1e-6 m/s"
FULL, EVEN = f"{PAPERS}, full grid", f"{PAPERS}, evenly spaced tilts"


def cases(study: Study) -> tuple[Condition, ...]:
    """The starts of all claims, the full grid at the paper's threshold, and its subset with evenly spaced tilts."""
    return tuple(dict.fromkeys((*study.starts(), *full_grid(), *even_grid())))


def trials(study: Study, condition: Condition) -> Iterator[dict[str, Any]]:
    """Yield one trial per coordinate and group of a start; a fresh start belongs to all groups of its threshold."""
    groups = [LARGER]
    if condition.approach_velocity == Condition().approach_velocity:
        members = {PAPERS: study.starts(), FULL: full_grid(), EVEN: even_grid()}
        groups = [name for name, starts in members.items() if condition in starts] or list(members)
    for row in distances(study, condition, rendering="full"):
        yield from (row | {"threshold": group} for group in groups)


def draw(study: Study, region: Region) -> list[Condition]:
    """Draw fresh starts; each appears twice, with the paper's approach velocity and with the drawn one."""
    found = study.fresh(cases(study), region, FRESH)
    return [*(replace(start, approach_velocity=Condition().approach_velocity) for start in found), *found]


def finding(table: Table) -> str:
    """Return the result in words, with numbers."""
    ratios = ", ".join(f"{median_ratio(table, name, 'PB'):.2f} in {name}" for name in COORDINATES)
    return (
        f"The distance of IAPB to ideal, divided by that of PB, has these medians: {ratios}. The share of starts in "
        "which IAPB is closest depends on the tilts. On the full grid (14 tilts, most of them small, times 6 "
        f"clearances) it is {_counts(table, FULL)}; on the subset with 8 evenly spaced tilts {_counts(table, EVEN)}."
    )


def _counts(table: Table, group: str) -> str:
    """Return, per coordinate, the number of starts in which IAPB is closest and the number of decided starts."""
    texts = []
    for coordinate in COORDINATES:
        trials = table.where(threshold=group, coordinate=coordinate)
        decided = [held for held in trials.holds if held is not None]
        texts.append(f"{sum(decided)}/{len(decided)} ({coordinate})")
    return ", ".join(texts)


CLAIM = peg_claim(
    id="C10",
    statement="The device trajectory of IAPB is closest to ideal, ahead of PB and CBuc.",
    place="Section VI, Fig. 7",
    quantity="RMS distance of the device trajectory from that of the ideal world, per coordinate, from the first "
    "contact until all four worlds have settled or the run ends. The table also has the largest distance. A contact "
    "collides if it approaches faster than the approach velocity; 1e-6 m/s takes every approaching contact, as the "
    "paper does.",
    tolerance="IAPB's distance is strictly the smallest of the three. A trial cannot tell if all three are within 1e-7 "
    "of ideal.",
    columns=(*COLUMNS, Column("threshold", part=True)),
    cases=cases,
    trials=trials,
    holds=closest,
    finding=finding,
    runs=(("ideal", "full"), ("IAPB", "full"), ("PB", "full"), ("CBuc", "full")),
    draw=draw,
    axes=("tilt", "clearance", "coordinate", "threshold"),
)

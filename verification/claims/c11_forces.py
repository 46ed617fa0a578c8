"""C11: forces are large on new contact, balance the hand while in contact, and are closest to ideal (Fig. 8)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from verification.claims.closeness import peg_claim
from verification.claims.conditions import START_COLUMNS, Condition
from verification.finding import Column, Row, Table
from verification.scenes.measures import comparison_window, momentum_distance, peak_force, resting_force
from verification.scenes.trace import COORDINATES

if TYPE_CHECKING:
    from verification.claims.study import Study

LARGE, BALANCE, CLOSEST = "peak on new contact", "mean force after settling", "impulse of the force, distance to ideal"
COLUMNS = (
    Column("part", part=True),
    *START_COLUMNS,
    Column("coordinate", part=True),
    Column("IAPB"),
    Column("PB"),
    Column("CBuc"),
    Column("hand"),
)
WORLDS = ("IAPB", "PB", "CBuc")

# At 1 mm/s, the largest speed that counts as settled, the dampers carry 50 N s/m x 1 mm/s = 0.05 N of the hand's 0.4 N.
BALANCED = 0.05  # [N]
# Peaks and momenta below this [N, N m, N s, N m s] are rounding: no force acts along this coordinate.
NOTHING = 1e-9


def trials(study: Study, condition: Condition) -> Iterator[dict[str, Any]]:
    """Yield the trials of one start per coordinate: peak forces, resting forces, distances of the force integrals."""
    ideal = study.trace(condition, "ideal")
    traces = {world: study.trace(condition, world) for world in WORLDS}
    window = comparison_window([ideal, *traces.values()])
    peaks = {world: peak_force(trace) for world, trace in traces.items()}
    given = {world: momentum_distance(trace, ideal, window) for world, trace in traces.items()}
    resting = {world: resting_force(trace) for world, trace in traces.items()}
    for i, coordinate in enumerate(COORDINATES):
        common = condition.record() | {"coordinate": coordinate, "hand": float(ideal.hand_force[-1, i])}
        yield common | {"part": LARGE} | {world: float(peaks[world][i]) for world in WORLDS}
        yield common | {"part": CLOSEST} | {world: float(given[world][i]) for world in WORLDS}
        if coordinate != "theta":
            found = {world: None if force is None else float(force[i]) for world, force in resting.items()}
            yield common | {"part": BALANCE} | found


def holds(row: Row) -> bool | None:
    """Return whether IAPB has a higher peak than PB, balances the hand, or has the force integral closest to ideal."""
    if row["part"] == BALANCE:
        return None if row["IAPB"] is None else bool(abs(row["IAPB"] + row["hand"]) <= BALANCED)
    if max(row[world] for world in WORLDS) < NOTHING:
        return None
    if row["part"] == LARGE:
        return bool(row["IAPB"] > row["PB"])
    return bool(row["IAPB"] < min(row["PB"], row["CBuc"]))


def finding(table: Table) -> str:
    """Return the result in words, with numbers."""
    texts = []
    for coordinate, unit in (("x", "N"), ("y", "N"), ("theta", "N m")):
        trials = table.where(part=LARGE, coordinate=coordinate)
        texts.append(f"{coordinate} {max(trials.column('IAPB')):.3g} {unit} (PB {max(trials.column('PB')):.3g})")
    return f"Largest forces with IAPB: {', '.join(texts)}."


CLAIM = peg_claim(
    id="C11",
    statement="Forces are large on new contact, only balance the hand while in contact, and are closest to ideal.",
    place="Section VI, Fig. 8",
    quantity="Peak force of the device's actuators; their mean force after settling; RMS distance to ideal of the "
    "force's time integral. The integral is compared because a spike that comes one step later is a small difference.",
    tolerance="Peak: larger than PB's. Mean force: within 0.05 N of the hand force, which is the damper's force at the "
    "speed that counts as settled. Distance: strictly the smallest; a trial cannot tell if all are below 1e-9.",
    columns=COLUMNS,
    trials=trials,
    holds=holds,
    finding=finding,
    runs=(("ideal", "full"), ("IAPB", "full"), ("PB", "full"), ("CBuc", "full")),
    axes=("tilt", "clearance", "part"),
)

"""C12: on a device with force limits, saturated impulses lose most performance, spread ones least (Fig. 9)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from verification.claims.closeness import INDISTINGUISHABLE, peg_claim
from verification.claims.conditions import START_COLUMNS, Condition, columns
from verification.finding import Column, Row, Table
from verification.scenes.measures import comparison_window, root_mean_square, share_limited
from verification.scenes.trace import COORDINATES

if TYPE_CHECKING:
    from verification.claims.study import Study

MOST, LEAST = "saturating loses most", "spreading loses least"
RENDERINGS = ("saturate", "scale", "spread")
COLUMNS = (
    Column("part", part=True),
    *START_COLUMNS,
    *columns("force_limit"),
    *(Column(rendering) for rendering in RENDERINGS),
    Column("impacts limited"),
)


def trials(study: Study, condition: Condition) -> Iterator[dict[str, Any]]:
    """Yield the trials of one start and device limit, per coordinate, with the distances of three renderings."""
    full = study.trace(condition, "IAPB")
    traces = {rendering: study.trace(condition, "IAPB", rendering) for rendering in RENDERINGS}
    window = comparison_window([full, *traces.values()])
    lost = {rendering: root_mean_square(trace, full, window) for rendering, trace in traces.items()}
    limited = share_limited(traces["scale"])
    for i, coordinate in enumerate(COORDINATES):
        numbers = {rendering: float(distance[i]) for rendering, distance in lost.items()}
        for claimed in (MOST, LEAST):
            part = f"{coordinate}: {claimed}"
            yield condition.record() | numbers | {"part": part, "impacts limited": limited}


def holds(row: Row) -> bool | None:
    """Return whether saturating is strictly worst, or spreading strictly best; None if no impulse reaches the limit."""
    lost = [row[rendering] for rendering in RENDERINGS]
    if row["impacts limited"] == 0.0 or max(lost) < INDISTINGUISHABLE:
        return None
    if row["part"].endswith(MOST):
        return bool(row["saturate"] > max(row["scale"], row["spread"]))
    return bool(row["spread"] < min(row["saturate"], row["scale"]))


def finding(table: Table) -> str:
    """Return the result in words, with numbers."""
    texts = []
    for coordinate, unit, factor in (("x", "µm", 1e6), ("y", "µm", 1e6), ("theta", "mrad", 1e3)):
        trials = table.where(part=f"{coordinate}: {MOST}")
        medians = " / ".join(f"{factor * float(np.median(trials.column(name))):.3g}" for name in RENDERINGS)
        texts.append(f"{coordinate}: {medians} {unit}")
    return f"Median distance to the unlimited device (saturated / scaled / spread): {'; '.join(texts)}."


CLAIM = peg_claim(
    id="C12",
    statement="Saturating the impulses at the device loses most performance, spreading them over steps loses least.",
    place="Section VI, Fig. 9",
    quantity="RMS distance of the device trajectory from that of a device without limits, per coordinate.",
    tolerance="Saturating: strictly the largest distance of the three. Spreading: strictly the smallest. A trial "
    "cannot tell if no impulse reaches the limit or all three are within 1e-7 of the unlimited device.",
    columns=COLUMNS,
    trials=trials,
    holds=holds,
    finding=finding,
    runs=(("IAPB", "full"), *(("IAPB", rendering) for rendering in RENDERINGS)),
    limited=True,
    axes=("tilt", "clearance", "part"),
)

"""C16: scaling and spreading keep tool and device together on impact; saturating does not (section VI)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from verification.claims.closeness import peg_claim
from verification.claims.conditions import START_COLUMNS, Condition, columns
from verification.finding import Column, Row, Table
from verification.scenes.measures import largest_separation, share_limited

if TYPE_CHECKING:
    from verification.claims.study import Study

RENDERINGS = ("saturate", "scale", "spread")
COLUMNS = (
    Column("rendering", part=True),
    *START_COLUMNS,
    *columns("force_limit"),
    Column("distance", "m"),
    Column("angle", "rad"),
    Column("impacts limited"),
)

# Tool and device start alike and get the same forces, so they differ only by rounding over 1536 steps. A micrometre (or
# microradian) is a thousand times larger than this, and a hundredth of the separation by saturation.
TOGETHER, APART = 1e-9, 1e-6


def trials(study: Study, condition: Condition) -> Iterator[dict[str, Any]]:
    """Yield the trials of one start and device limit, one per rendering."""
    limited = share_limited(study.trace(condition, "IAPB", "scale"))
    for rendering in RENDERINGS:
        x, y, theta = map(float, largest_separation(study.trace(condition, "IAPB", rendering)))
        yield condition.record() | {"rendering": rendering, "distance": max(x, y), "angle": theta,
                                    "impacts limited": limited}  # fmt: skip


def holds(row: Row) -> bool | None:
    """Return whether tool and device stay together, or separate if saturated; None if no impulse reached the limit."""
    if row["impacts limited"] == 0.0:
        return None
    apart = max(row["distance"], row["angle"])
    return bool(apart > APART) if row["rendering"] == "saturate" else bool(apart <= TOGETHER)


def finding(table: Table) -> str:
    """Return the result in words, with numbers."""
    texts = []
    for rendering in RENDERINGS:
        trials = table.where(rendering=rendering)
        distance, angle = max(trials.column("distance")), max(trials.column("angle"))
        texts.append(f"{rendering} up to {distance:.1e} m and {angle:.1e} rad")
    return f"Largest separation of tool and device: {'; '.join(texts)}."


CLAIM = peg_claim(
    id="C16",
    statement="Scaling and spreading keep tool and device together on impact; saturating does not.",
    place="Section VI",
    quantity="Largest difference of tool and device over the run, in position and angle.",
    tolerance="Together: at most 1e-9 m and rad, the rounding over 1536 steps. Apart: more than 1e-6 m or rad.",
    columns=COLUMNS,
    trials=trials,
    holds=holds,
    finding=finding,
    runs=tuple(("IAPB", rendering) for rendering in RENDERINGS),
    limited=True,
    axes=("tilt", "force_limit", "rendering"),
)

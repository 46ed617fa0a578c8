"""C08: the resolution is passive for every e in [−1, 1], and so are scaled and spread impulses (section VI)."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Any

from iapb import resolve_impact
from verification.claims.algebraic import (
    COLUMNS,
    EPSILON,
    energy_bound,
    energy_gains,
    summary,
    within_bound,
    worst,
)
from verification.claims.claim import Claim
from verification.finding import Table, table_of
from verification.impacts import Family, draw_of_rank
from verification.scenes.trace import Trace

if TYPE_CHECKING:
    from verification.claims.study import Study

RANDOM = "random impacts"
RENDERED = {"scale": "impacts of the peg, scaled to the device", "spread": "impacts of the peg, spread over steps"}
FAMILIES = tuple(
    Family(d, contacts, rank, k)
    for d, contacts, rank in ((1, 1, 1), (3, 6, 3), (6, 20, 4), (12, 60, 8))
    for k in (1e2, 1e6)
)
RESTITUTIONS = (-1.0, -0.9, -0.5, 0.0, 0.5, 0.9, 1.0)
IMPACTS = {"quick": 8, "full": 150}


def measure(study: Study) -> Table:
    """Random impacts with e of either sign, and every impact of the peg at a limited device."""
    count = IMPACTS[study.depth]
    drawn = study.each(product(FAMILIES, RESTITUTIONS), lambda case: [_random(*case, count, study.seed)])
    return table_of(COLUMNS, [*drawn, *(_rendered(study, *each) for each in RENDERED.items())])


def _random(family: Family, e: float, count: int, seed: int) -> dict[str, Any]:
    instances = list(draw_of_rank(family, count, seed))
    after = [resolve_impact(*instance.arrays, e).velocity for instance in instances]
    return {"part": RANDOM, "coordinates": family.coordinates, "contacts": family.contacts,
            "condition number": family.condition_number, "restitution": e, "impacts": count,
            "error": worst(energy_gains(instances, after)),
            "bound": energy_bound(*family[::3])}  # fmt: skip


def _rendered(study: Study, rendering: str, part: str) -> dict[str, Any]:
    traces = list(study.each(study.starts(), lambda condition: [study.trace(condition, "IAPB", rendering)]))
    return {"part": part, "coordinates": 3, "restitution": 0.0,
            "impacts": sum(len(trace.impact_step) for trace in traces),
            "error": worst(map(_largest_gain, traces)), "bound": 100.0 * EPSILON}  # fmt: skip


def _largest_gain(trace: Trace) -> float:
    """Largest energy gain of an impact relative to the energy before it."""
    before = trace.kinetic_energy[trace.impact_step]
    return worst(-trace.energy_lost / before)


def finding(table: Table) -> str:
    """One sentence."""
    rendered = "; ".join(f"{part} {summary(table, part)}" for part in RENDERED.values())
    return f"Relative energy gain: {RANDOM} {summary(table, RANDOM)}; {rendered}."


CLAIM = Claim(
    id="C08",
    statement="The resolution is passive for every e in [-1, 1]; scaling and spreading the impulses stay inside.",
    place="Section VI",
    quantity="Worst relative gain of kinetic energy of the tool over one impact.",
    tolerance="10 d ε √κ(M) for random impacts; 100 ε for the peg, whose mass matrix is diagonal.",
    measure=measure,
    holds=within_bound,
    finding=finding,
)

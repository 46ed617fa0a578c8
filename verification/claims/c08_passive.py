"""C08: the resolution is passive for every e in [−1, 1]; scaled and spread impulses are passive too (section VI)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from iapb import resolve_impact
from verification.claims.algebraic import (
    COLUMNS,
    EPSILON,
    Batch,
    Measure,
    cases_of,
    energy_bound,
    energy_gains,
    summary,
    trial_of,
    within_bound,
    worst,
)
from verification.claims.claim import Claim
from verification.finding import Table
from verification.impacts import Family
from verification.scenes.trace import Trace

if TYPE_CHECKING:
    from verification.claims.study import Study

RANDOM = "random impacts"
RENDERED = {"impacts of the peg, scaled to the device": "scale", "impacts of the peg, spread over steps": "spread"}
FAMILIES = tuple(
    Family(d, contacts, rank, k)
    for d, contacts, rank in ((1, 1, 1), (3, 6, 3), (6, 20, 4), (12, 60, 8)) for k in (1e2, 1e6)
)  # fmt: skip
RESTITUTIONS = (-1.0, -0.9, -0.5, 0.0, 0.5, 0.9, 1.0)
IMPACTS = {"quick": 8, "full": 150}


def cases(study: Study) -> list[tuple[Any, ...]]:
    """Random impacts with e from −1 to 1, and all impacts of the peg on a device with force limits."""
    return [*cases_of(FAMILIES, RESTITUTIONS, [RANDOM]), *((part,) for part in RENDERED)]


def trials(study: Study, case: tuple[Any, ...]) -> Iterator[dict[str, Any]]:
    """Yield the trial of one batch of random impacts, or of the impacts of all runs of the peg."""
    if case[0] == RANDOM:
        part, family, e = case
        yield trial_of(study, (part, family, e), IMPACTS[study.depth], {RANDOM: Measure(_gain, energy_bound)})
        return
    study.make_ahead(study.starts(), [("IAPB", RENDERED[case[0]])])
    traces = list(study.each(study.starts(), lambda start: [study.trace(start, "IAPB", RENDERED[case[0]])]))
    yield {"part": case[0], "coordinates": 3, "restitution": 0.0,
           "impacts": sum(len(trace.impact_step) for trace in traces),
           "error": worst(map(_largest_gain, traces)), "bound": 100.0 * EPSILON}  # fmt: skip


def _gain(batch: Batch) -> float:
    after = [resolve_impact(*case.arrays, batch.restitution).velocity for case in batch.impacts]
    return worst(energy_gains(batch.impacts, after))


def _largest_gain(trace: Trace) -> float:
    """Largest energy gain of an impact of the run, relative to the energy before that impact."""
    before = trace.kinetic_energy[trace.impact_step]
    return worst(-trace.energy_lost / before)


def finding(table: Table) -> str:
    """Return the result in words, with numbers."""
    rendered = "; ".join(f"{part} {summary(table, part)}" for part in RENDERED)
    return f"Relative energy gain: {RANDOM} {summary(table, RANDOM)}; {rendered}."


CLAIM = Claim(
    id="C08",
    statement="The resolution is passive for every e in [-1, 1]; scaling and spreading the impulses stay inside.",
    place="Section VI",
    quantity="Largest relative gain of the tool's kinetic energy in one impact.",
    tolerance="10 d ε √κ(M) for random impacts; 100 ε for the peg, whose mass matrix is diagonal.",
    columns=COLUMNS,
    cases=cases,
    trials=trials,
    holds=within_bound,
    finding=finding,
)

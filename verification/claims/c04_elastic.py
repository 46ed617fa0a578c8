"""C04: a perfectly elastic impact conserves kinetic energy."""

from __future__ import annotations

import numpy as np

from iapb import resolve_impact
from reference.exact import exact_impact
from verification.claims.algebraic import (
    Batch,
    Exact,
    Measure,
    algebraic_claim,
    energy_gains,
    solve_bound,
    summary,
    worst,
)
from verification.finding import Table
from verification.impacts import Family

DOUBLES = "in doubles"
EXACT = "in rationals"
FAMILIES = tuple(
    Family(d, contacts, rank, k)
    for d, contacts, rank in ((1, 1, 1), (3, 1, 1), (3, 6, 3), (6, 12, 4), (12, 60, 8)) for k in (1e1, 1e4, 1e8)
)  # fmt: skip


def _change(batch: Batch) -> float:
    after = [resolve_impact(*case.arrays, batch.restitution).velocity for case in batch.impacts]
    return worst(np.abs(energy_gains(batch.impacts, after)))


def _exact_change(batch: Batch) -> float:
    impacts = [exact_impact(*case.arrays, 1) for case in batch.impacts]
    return worst(float(abs(impact.energy_after - impact.energy_before)) for impact in impacts)


def finding(table: Table) -> str:
    """Return the result in words, with numbers."""
    return (
        f"Relative change of energy in doubles: {summary(table, DOUBLES)}. Change of energy [J] in rational "
        f"arithmetic: {summary(table, EXACT)}."
    )


CLAIM = algebraic_claim(
    id="C04",
    statement="With e = 1 kinetic energy is conserved.",
    place="Sections V-A and V-B",
    quantity="Largest relative change of kinetic energy, gain or loss.",
    tolerance="100 d ε κ(M) in doubles, the rounding of the factorization of M; it causes losses, never gains. In "
    "rational arithmetic zero.",
    families=FAMILIES,
    restitutions=(1.0,),
    impacts={"quick": 12, "full": 200},
    parts={DOUBLES: Measure(_change, solve_bound)},
    exact=Exact(FAMILIES[::3], 1.0, {EXACT: _exact_change}),
    finding=finding,
)

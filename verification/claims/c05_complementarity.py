"""C05: for one contact the impulse is that of the complementarity formulation."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from iapb import resolve_impact
from verification.claims.algebraic import COLUMNS, solve_bound, summary, within_bound, worst
from verification.claims.claim import Claim
from verification.finding import Table, table_of
from verification.impacts import Family, ImpactCase, approaching, draw_of_rank

if TYPE_CHECKING:
    from verification.claims.study import Study

FAMILIES = tuple(Family(d, 1, 1, k) for d in (1, 3, 12) for k in (1e1, 1e3, 1e5))
RESTITUTIONS = (0.0, 0.3, 1.0)
SOLVERS = ("daqp", "lemke")
IMPACTS = {"quick": 8, "full": 100}


def measure(study: Study) -> Table:
    """The resolver's impulse against the multiplier of Newton's LCP, at one approaching contact."""
    count = IMPACTS[study.depth]
    cases = product(FAMILIES, RESTITUTIONS, SOLVERS)
    return table_of(COLUMNS, study.each(cases, lambda case: [_batch(*case, count, study.seed)]))


def _batch(family: Family, e: float, solver: str, count: int, seed: int) -> dict[str, Any]:
    instances = (approaching(instance) for instance in draw_of_rank(family, count, seed))
    return {
        "part": f"LCP by {solver}", "coordinates": family.coordinates, "contacts": 1,
        "condition number": family.condition_number, "restitution": e, "impacts": count,
        "error": worst(_difference(instance, e, solver) for instance in instances),
        "bound": solve_bound(family.coordinates, family.condition_number),
    }  # fmt: skip


def _difference(instance: ImpactCase, e: float, solver: str) -> float:
    """|p − p_LCP| relative to p_LCP."""
    from reference.complementarity.laws import newton_lcp
    from reference.complementarity.problem import ImpactProblem

    mass, rows, velocity = instance.arrays
    ours = resolve_impact(mass, rows, velocity, e).impulses
    theirs = newton_lcp(ImpactProblem.from_impact(mass, rows, velocity, e), solver).impulse
    return float(np.abs(ours - theirs)[0] / np.abs(theirs)[0])


def finding(table: Table) -> str:
    """One sentence."""
    parts = [f"{part[len('LCP by ') :]}: {summary(table, part)}" for part in sorted(set(table.column("part")))]
    return f"Relative difference of the impulses, by solver of the LCP, {'; '.join(parts)}."


CLAIM = Claim(
    id="C05",
    statement="At a single contact the impulse equals that of the complementarity formulation.",
    place="Section V-A, note to (19)",
    quantity="Relative difference between the impulse and the multiplier of 0 <= p ⟂ γ⁺ + eγ⁻ >= 0.",
    tolerance="100 d ε κ(M): both divide by nᵀM⁻¹n, each with its own solve.",
    measure=measure,
    holds=within_bound,
    finding=finding,
)

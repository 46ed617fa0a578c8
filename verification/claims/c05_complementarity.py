"""C05: for one contact the impulse equals that of the complementarity formulation."""

from __future__ import annotations

from functools import partial

import numpy as np

from iapb import resolve_impact
from reference.complementarity.laws import newton_lcp
from reference.complementarity.problem import ImpactProblem
from verification.claims.algebraic import Batch, Measure, algebraic_claim, solve_bound, summary, worst
from verification.finding import Table
from verification.impacts import Family, ImpactCase, approaching

SOLVERS = ("daqp", "lemke")


def _difference(batch: Batch, solver: str) -> float:
    """Largest |p − p_LCP| / p_LCP, where p_LCP is the multiplier of Newton's LCP at one approaching contact."""
    return worst(_of_one(approaching(case), batch.restitution, solver) for case in batch.impacts)


def _of_one(case: ImpactCase, e: float, solver: str) -> float:
    ours = resolve_impact(*case.arrays, e).impulses
    theirs = newton_lcp(ImpactProblem.from_impact(*case.arrays, e), solver).impulse
    return float(np.abs(ours - theirs)[0] / np.abs(theirs)[0])


def finding(table: Table) -> str:
    """Return the result in words, with numbers."""
    parts = [f"{solver}: {summary(table, f'LCP by {solver}')}" for solver in SOLVERS]
    return f"Relative difference of the impulses, for each LCP solver: {'; '.join(parts)}."


CLAIM = algebraic_claim(
    id="C05",
    statement="At a single contact the impulse equals that of the complementarity formulation.",
    place="Section V-A, note to (19)",
    quantity="Relative difference between the impulse and the multiplier of 0 <= p ⟂ γ⁺ + eγ⁻ >= 0.",
    tolerance="100 d ε κ(M): both methods divide by nᵀM⁻¹n, each with its own solve.",
    families=tuple(Family(d, 1, 1, k) for d in (1, 3, 12) for k in (1e1, 1e3, 1e5)),
    restitutions=(0.0, 0.3, 1.0),
    impacts={"quick": 8, "full": 100},
    parts={f"LCP by {solver}": Measure(partial(_difference, solver=solver), solve_bound) for solver in SOLVERS},
    finding=finding,
)

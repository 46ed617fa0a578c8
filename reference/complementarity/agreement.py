"""How far an impact outcome lies from complementarity: the numbers of one comparison, as plain records."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.errors import ArgumentError
from iapb.names import one_of
from reference.complementarity.adhesion import adhesion
from reference.complementarity.laws import LAWS, Outcome
from reference.complementarity.problem import ImpactProblem

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Agreement:
    """A candidate outcome beside the outcome of a law.

    distance : |v_candidate − v_law|_M / |v⁻|_M, in the kinetic metric
    energy_before, energy_candidate, energy_law : kinetic energies [J]
    adhesion : of the candidate: "none", "artefact of the minimum norm" or "adhesive"
    adhesive_share : sum of the negative impulses of the candidate over the sum of all magnitudes, as given
    approaching : contacts that the candidate leaves approaching
    momentum_residual : share of M (v⁺ − v⁻) that is not in range(Jᵀ): 0 for any impulse at the contacts
    """

    law: str
    distance: float
    energy_before: float
    energy_candidate: float
    energy_law: float
    adhesion: str
    adhesive_share: float
    approaching: int
    momentum_residual: float


def compare_with_law(
    problem: ImpactProblem, velocity_plus: ArrayLike, impulse: ArrayLike, law: str = "newton_lcp"
) -> Agreement:
    """Compare v⁺ (d,) and impulses (n,) of anybody's resolver with a law of `LAWS` on a frictionless problem.

    Contacts count as approaching below −1e-9 of the velocity scale: rounding of an exact zero stays above.
    """
    if law not in LAWS:
        raise ArgumentError("law", law, one_of(law, LAWS))
    mass, rows, before = problem.mass_matrix, problem.contact_jacobian, problem.velocity
    if mass is None or rows is None or before is None or problem.friction is not None:
        raise ArgumentError(
            "problem", problem.name, "a frictionless problem made by ImpactProblem.from_impact"
        )
    v, p = np.asarray(velocity_plus, np.float64), np.asarray(impulse, np.float64)
    outcome: Outcome = LAWS[law].apply(problem)
    kinetic = np.linalg.cholesky(mass).T
    speed = float(np.linalg.norm(kinetic @ before)) or 1.0
    scale = float(np.abs(problem.gamma_minus).max(initial=0.0)) or 1.0
    total = float(np.abs(p).sum())
    return Agreement(
        law=law,
        distance=float(np.linalg.norm(kinetic @ (v - outcome.velocity))) / speed,
        energy_before=0.5 * speed**2 if before.any() else 0.0,
        energy_candidate=0.5 * float(v @ mass @ v),
        energy_law=0.5 * float(outcome.velocity @ mass @ outcome.velocity),
        adhesion=adhesion(rows, p, mass),
        adhesive_share=float(-p[p < 0.0].sum()) / total if total > 0.0 else 0.0,
        approaching=int(np.count_nonzero(rows @ v < -1e-9 * scale)),
        momentum_residual=_outside_range(kinetic @ (v - before), problem.factor),
    )


def _outside_range(change: Floats, rows: Floats) -> float:
    """Share of a change of velocity (kinetic coordinates) outside the span of the rows A (n, d)."""
    size = float(np.linalg.norm(change))
    if size == 0.0 or not len(rows):
        return 0.0 if size == 0.0 else 1.0
    inside = rows.T @ np.linalg.lstsq(rows.T, change)[0]
    return float(np.linalg.norm(change - inside)) / size

"""Where IAPB's factored equality and the Newton LCP agree, by how much they differ, and why.

Three exact statements, each tried on every case here. Let Δ_eq = −(1+e) P u be IAPB's change of velocity in kinetic
coordinates (u = Lᵀv, A = J L⁻ᵀ, P the projector onto A's rows) and C = {Aᵀp : p >= 0}. For one e and *any* gamma_minus:

1. The LCP's change is the projection of Δ_eq on the cone C (its QP is min |Aᵀp + (1+e)u|, and (I − P)u is normal to C).
   So the laws agree if and only if some p >= 0 gives IAPB's motion, and their distance is the distance of Δ_eq from C.
2. Both changes are (1+e) times those of the plastic impact: e moves no case from agreement to disagreement.
3. IAPB never keeps more energy: loss_eq − loss_LCP = ½ (1−e)/(1+e) · distance². At e = 1 both keep all of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

import numpy as np

from iapb import resolve_impact
from reference.complementarity.adhesion import adhesion
from reference.complementarity.laws import LAWS as laws
from reference.complementarity.laws import Outcome
from reference.complementarity.problem import ImpactProblem
from verification.finding import Failure, attempt
from verification.impacts import ImpactCase

# Two motions are the same below this distance (kinetic metric, of |v⁻|): what C05 asks for. Active-set solutions of
# well-conditioned cases end near 1e-15; true disagreement starts near 1e-4 in all families.
SAME = 1e-12
# p >= 0 reproduces the motion below this distance: ten times SAME, so that one tie in rounding is no counterexample.
REPRODUCED = 1e-11
# A contact approaches below minus this share of the largest contact velocity: rounding of an exact zero stays above.
APPROACHING = 1e-9
LAWS = ("newton_lcp", "poisson")
Resolver = Callable[[ImpactCase], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Comparison:
    """IAPB and one complementarity law on one case; lengths in the kinetic metric, relative to |v⁻|.

    distance : |v⁺ − v⁺_law|; cone_distance : of IAPB's impulse from {Jᵀp : p >= 0}
    energy_lost, energy_lost_law : share of KE⁻; law_2, law_3 : defects of the statements 1 and 3 above
    adhesion : "none", "artefact of the minimum norm" or "adhesive"; adhesive_share : of the impulses as given
    approaching : contacts, given or touching, that IAPB leaves approaching
    momentum_residual : share of M(v⁺−v⁻) outside range(Jᵀ)
    """

    family: str
    law: str
    contacts: int
    redundancy: int
    restitution: float
    distance: float
    cone_distance: float
    energy_lost: float
    energy_lost_law: float
    adhesion: str
    adhesive_share: float
    approaching: int
    approaching_law: int
    momentum_residual: float

    @property
    def agrees(self) -> bool:
        """Whether the two motions are one."""
        return self.distance <= SAME

    @property
    def pushes(self) -> bool:
        """Whether some p >= 0 gives IAPB's motion."""
        return self.cone_distance <= REPRODUCED

    @property
    def projection_defect(self) -> float:
        """|distance − cone_distance|: zero by statement 1 (Newton LCP)."""
        return abs(self.distance - self.cone_distance)

    @property
    def energy_defect(self) -> float:
        """Defect of statement 3 (Newton LCP), as a share of KE⁻."""
        e = self.restitution
        return abs(self.energy_lost - self.energy_lost_law - (1.0 - e) / (1.0 + e) * self.distance**2)


def iapb(case: ImpactCase) -> tuple[np.ndarray, np.ndarray]:
    """v⁺ and p of the engine."""
    impact = resolve_impact(case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution)
    return impact.velocity, impact.impulses


def compare_case(case: ImpactCase, law: str = "newton_lcp", resolver: Resolver = iapb) -> Comparison:
    """Compare a resolver's outcome with a complementarity law's on one case.

    Raises
    ------
    SolverError
        Where the law's own solver leaves a residual: then there is nothing to compare with.
    """
    problem = ImpactProblem.from_impact(case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution)
    v, p = resolver(case)
    outcome: Outcome = laws[law].apply(problem)
    upper = np.linalg.cholesky(case.mass_matrix).T
    before, change = upper @ case.velocity, upper @ (v - case.velocity)
    speed = float(np.linalg.norm(before)) or 1.0
    total, scale = float(np.abs(p).sum()), float(np.abs(problem.gamma_minus).max(initial=0.0)) or 1.0
    return Comparison(
        case.family, law, case.contacts, case.redundancy, case.restitution,
        distance=float(np.linalg.norm(upper @ (v - outcome.velocity))) / speed,
        cone_distance=_cone_distance(problem, change) / speed,
        energy_lost=_lost(before, change), energy_lost_law=_lost(before, upper @ (outcome.velocity - case.velocity)),
        adhesion=adhesion(case.contact_jacobian, p, case.mass_matrix),
        adhesive_share=float(-p[p < 0.0].sum()) / total if total > 0.0 else 0.0,
        approaching=_approaching(case, v, scale), approaching_law=_approaching(case, outcome.velocity, scale),
        momentum_residual=_outside(problem.factor, change),
    )  # fmt: skip


def _lost(before: np.ndarray, change: np.ndarray) -> float:
    """KE⁻ − KE⁺ as a share of KE⁻, from the change itself so that nothing cancels."""
    energy = 0.5 * float(before @ before)
    return -float(before @ change + 0.5 * change @ change) / energy if energy > 0.0 else 0.0


def _approaching(case: ImpactCase, velocity: np.ndarray, scale: float) -> int:
    rows = case.contact_jacobian if case.touching is None else np.vstack([case.contact_jacobian, case.touching])
    return int(np.count_nonzero(rows @ velocity < -APPROACHING * scale))


def _cone_distance(problem: ImpactProblem, change: np.ndarray) -> float:
    """Distance of a change of velocity from {Aᵀp : p >= 0}, by non-negative least squares on unit rows."""
    from scipy.optimize import nnls

    rows = problem.factor
    length = np.linalg.norm(rows, axis=1)
    size = float(np.linalg.norm(change))
    if not len(rows) or size == 0.0:
        return size
    unit = rows / np.where(length > 0.0, length, 1.0)[:, None]
    return float(nnls(unit.T, change / size)[1]) * size


def _outside(rows: np.ndarray, change: np.ndarray) -> float:
    size = float(np.linalg.norm(change))
    if size == 0.0 or not len(rows):
        return 0.0 if size == 0.0 else 1.0
    inside = rows.T @ np.linalg.lstsq(rows.T, change)[0]
    return float(np.linalg.norm(change - inside)) / size


def compare_cases(
    cases: Iterable[ImpactCase], law: str = "newton_lcp", resolver: Resolver = iapb,
    failures: list[Failure] | None = None,
) -> tuple[Comparison, ...]:
    """Compare on every case; `failures` receives those that raise."""
    found = (attempt(f"{case.family}, e = {case.restitution:g}, impact {number}",
                     partial(compare_case, case, law, resolver), failures)
             for number, case in enumerate(cases, 1))  # fmt: skip
    return tuple(comparison for comparison in found if comparison is not None)

"""Where IAPB's factored equality and the Newton LCP agree, by how much they differ, and why.

This module tests three exact statements on every case. Let Δ_eq = −(1+e) P u be IAPB's change of velocity in kinetic
coordinates (u = Lᵀv, A = J L⁻ᵀ, P projects onto the row space of A) and let C = {Aᵀp : p >= 0}. If all contacts have
the same e, then for *any* gamma_minus:

1. The LCP's change is the projection of Δ_eq on the cone C (its QP is min |Aᵀp + (1+e)u|, and (I − P)u is normal to C).
   So the laws agree if and only if some p >= 0 gives IAPB's velocity; their distance is the distance of Δ_eq from C.
2. Both changes are (1+e) times those of the plastic impact: whether the laws agree does not depend on e.
3. IAPB never keeps more energy than the LCP: loss_eq − loss_LCP = ½ (1−e)/(1+e) · distance². At e = 1 neither loses
   energy.

`agreement_map` sums up the agreement by geometry, restitution and redundancy; `two_contact_map` tests two contacts.

Let two contacts have unit rows with the cosine c in the kinetic metric and approach at speeds 1 and r <= 1. Both
impulses of IAPB push if and only if r >= c, because W⁻¹ (1, r) is proportional to (1 − c r, r − c). If r < c, the
slower contact pulls. Neither the restitution nor any other component of the velocity matters.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from iapb import resolve_impact
from reference.complementarity.laws import LAWS as laws
from reference.complementarity.laws import Outcome, adhesion
from reference.complementarity.problem import ImpactProblem
from verification.complementarity.cases import two_contacts
from verification.finding import Failure, attempt
from verification.impacts import ImpactCase

# Two velocities count as equal below this distance (kinetic metric, relative to |v⁻|), which is also C05's tolerance.
# Active-set solutions of well-conditioned cases reach about 1e-15; true differences are above 1e-4 in all families.
SAME = 1e-12
# Below this distance p >= 0 reproduces the velocity: ten times SAME, so that rounding alone gives no counterexample.
REPRODUCED = 1e-11
# A contact approaches if its velocity is below minus this share of the largest contact velocity. Rounding of an exact
# zero is smaller than this.
APPROACHING = 1e-9
LAWS = ("newton_lcp", "poisson")
Resolver = Callable[[ImpactCase], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Comparison:
    """IAPB and one complementarity law on one case; distances in the kinetic metric, relative to |v⁻|.

    distance : |v⁺ − v⁺_law|; cone_distance : distance of IAPB's impulse from {Jᵀp : p >= 0}
    energy_lost, energy_lost_law : loss of kinetic energy under IAPB and under the law, as a share of KE⁻
    adhesion : "none", "artefact of the minimum norm" or "adhesive"
    adhesive_share : sum of the pulling impulses that IAPB returns, divided by the sum of all |p|
    approaching, approaching_law : number of contacts, given or touching, that still approach after the impact
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
        """Whether the two laws give the same velocity."""
        return self.distance <= SAME

    @property
    def pushes(self) -> bool:
        """Whether some p >= 0 gives IAPB's velocity."""
        return self.cone_distance <= REPRODUCED

    @property
    def projection_defect(self) -> float:
        """|distance − cone_distance|; statement 1 says that it is zero for the Newton LCP."""
        return abs(self.distance - self.cone_distance)

    @property
    def energy_defect(self) -> float:
        """Error of the equation in statement 3, as a share of KE⁻; it is zero for the Newton LCP."""
        e = self.restitution
        return abs(self.energy_lost - self.energy_lost_law - (1.0 - e) / (1.0 + e) * self.distance**2)


def iapb(case: ImpactCase) -> tuple[np.ndarray, np.ndarray]:
    """Return v⁺ and p of the engine."""
    impact = resolve_impact(case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution)
    return impact.velocity, impact.impulses


def compare_case(case: ImpactCase, law: str = "newton_lcp", resolver: Resolver = iapb) -> Comparison:
    """Compare a resolver's outcome with a complementarity law's on one case.

    Raises
    ------
    SolverError
        The law's own solver leaves a residual, so there is no solution to compare with.
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
    """Return (KE⁻ − KE⁺) / KE⁻, computed from the change of velocity to avoid cancellation."""
    energy = 0.5 * float(before @ before)
    return -float(before @ change + 0.5 * change @ change) / energy if energy > 0.0 else 0.0


def _approaching(case: ImpactCase, velocity: np.ndarray, scale: float) -> int:
    rows = case.contact_jacobian if case.touching is None else np.vstack([case.contact_jacobian, case.touching])
    return int(np.count_nonzero(rows @ velocity < -APPROACHING * scale))


def _cone_distance(problem: ImpactProblem, change: np.ndarray) -> float:
    """Return the distance of a change of velocity from {Aᵀp : p >= 0}, by non-negative least squares on unit rows."""
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
    """Compare IAPB with a law on every case; `failures` receives the cases that raise an exception."""
    found = (attempt(f"{case.family}, e = {case.restitution:g}, impact {number}",
                     partial(compare_case, case, law, resolver), failures)
             for number, case in enumerate(cases, 1))  # fmt: skip
    return tuple(comparison for comparison in found if comparison is not None)


COSINES = (-0.9, -0.6, -0.3, 0.0, 0.15, 0.35, 0.55, 0.75, 0.9)
SPEED_RATIOS = (0.05, 0.25, 0.45, 0.65, 0.85, 1.0)
ARTEFACT, ADHESIVE = "artefact of the minimum norm", "adhesive"


@dataclass(frozen=True)
class MapCell:
    """All comparisons with one family, restitution, redundancy and law.

    agree : share of cases in which both laws give the same velocity
    adhesive : share of cases in which no p >= 0 gives IAPB's velocity
    artefact : share of cases in which only the least-norm impulses pull, while some p >= 0 gives the same velocity
    nearest, typical : least and median distance among the cases that differ; farthest : largest distance of all cases
    extra_loss, least_extra_loss : largest and least loss of IAPB beyond the law's loss, as a share of KE⁻
    left_approaching, left_approaching_law : share of cases after which a contact (given or touching) approaches
    contradictions : cases that agree although no p >= 0 gives the velocity, or differ although some p >= 0 does
    defect : largest error in statements 1 and 3 of this module; momentum : largest momentum residual
    """

    family: str
    law: str
    restitution: float
    redundancy: int
    cases: int
    agree: float
    adhesive: float
    artefact: float
    adhesive_share: float
    nearest: float
    typical: float
    farthest: float
    extra_loss: float
    least_extra_loss: float
    left_approaching: float
    left_approaching_law: float
    contradictions: int
    defect: float
    momentum: float


@dataclass(frozen=True)
class TwoContactCell:
    """One grid point of two contacts: whether agreement is predicted (r >= c) and found, and the laws' distance."""

    cosine: float
    speed_ratio: float
    predicted: bool
    found: bool
    distance: float


def agreement_map(comparisons: Iterable[Comparison]) -> tuple[MapCell, ...]:
    """Group comparisons by family, law, restitution and redundancy."""
    groups: dict[tuple[str, str, float, int], list[Comparison]] = {}
    for found in comparisons:
        groups.setdefault((found.family, found.law, found.restitution, found.redundancy), []).append(found)
    return tuple(_cell(key, members) for key, members in groups.items())


def _cell(key: tuple[str, str, float, int], members: Sequence[Comparison]) -> MapCell:
    family, law, restitution, redundancy = key
    apart = [m.distance for m in members if not m.agrees]
    newton = law == "newton_lcp"
    return MapCell(
        family, law, restitution, redundancy, len(members),
        agree=_share(m.agrees for m in members),
        adhesive=_share(m.adhesion == ADHESIVE for m in members),
        artefact=_share(m.adhesion == ARTEFACT for m in members),
        adhesive_share=float(np.mean([m.adhesive_share for m in members])),
        nearest=min(apart, default=np.nan), typical=float(np.median(apart)) if apart else np.nan,
        farthest=max(m.distance for m in members),
        extra_loss=max(m.energy_lost - m.energy_lost_law for m in members),
        least_extra_loss=min(m.energy_lost - m.energy_lost_law for m in members),
        left_approaching=_share(m.approaching > 0 for m in members),
        left_approaching_law=_share(m.approaching_law > 0 for m in members),
        contradictions=sum(contradicts(m) for m in members) if newton else 0,
        defect=max(max(m.projection_defect, m.energy_defect) for m in members) if newton else np.nan,
        momentum=max(m.momentum_residual for m in members),
    )  # fmt: skip


def contradicts(found: Comparison) -> bool:
    """Whether a case contradicts "the laws agree if and only if some p >= 0 gives IAPB's velocity"."""
    return (found.distance <= SAME and found.cone_distance > REPRODUCED) or (
        found.cone_distance <= SAME and found.distance > REPRODUCED
    )


def _share(outcomes: Iterable[bool]) -> float:
    return float(np.mean([bool(outcome) for outcome in outcomes]))


def two_contact_map(
    cosines: Sequence[float] = COSINES, speed_ratios: Sequence[float] = SPEED_RATIOS, seed: int = 2,
    failures: list[Failure] | None = None,
) -> tuple[TwoContactCell, ...]:
    """Test the condition r >= c on a grid of two-contact impacts; grid points with r = c are left out."""
    rng = np.random.default_rng(seed)
    cells = []
    for cosine in cosines:
        for ratio in speed_ratios:
            if cosine == ratio:
                continue
            case = two_contacts(cosine, ratio, rng)
            name = f"two contacts, cosine {cosine:g}, speed ratio {ratio:g}"
            found = attempt(name, partial(compare_case, case), failures)
            if found is not None:
                cells.append(TwoContactCell(cosine, ratio, ratio >= cosine, found.agrees, found.distance))
    return tuple(cells)

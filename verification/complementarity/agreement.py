"""Where IAPB's factored equality and the Newton LCP agree, by how much they differ, and why.

Three exact statements, each tried on every case here. Let Δ_eq = −(1+e) P u be IAPB's change of velocity in kinetic
coordinates (u = Lᵀv, A = J L⁻ᵀ, P the projector onto A's rows) and C = {Aᵀp : p >= 0}. For one e and *any* gamma_minus:

1. The LCP's change is the projection of Δ_eq on the cone C (its QP is min |Aᵀp + (1+e)u|, and (I − P)u is normal to C).
   So the laws agree if and only if some p >= 0 gives IAPB's motion, and their distance is the distance of Δ_eq from C.
2. Both changes are (1+e) times those of the plastic impact: e moves no case from agreement to disagreement.
3. IAPB never keeps more energy: loss_eq − loss_LCP = ½ (1−e)/(1+e) · distance². At e = 1 both keep all of it.

The map: agreement with complementarity by geometry, restitution and redundancy; and two contacts, exactly.

For two contacts whose unit rows have the cosine c in the kinetic metric and close at speeds 1 and r <= 1, both
impulses of IAPB push if and only if r >= c: W⁻¹ applied to (1, r) is proportional to (1 − c r, r − c). Below that line
the slower contact pulls. Restitution and all other motion play no part. The map tries this on a grid.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from iapb import resolve_impact
from reference.complementarity.adhesion import adhesion
from reference.complementarity.laws import LAWS as laws
from reference.complementarity.laws import Outcome
from reference.complementarity.problem import ImpactProblem
from verification.complementarity.cases import two_contacts
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


COSINES = (-0.9, -0.6, -0.3, 0.0, 0.15, 0.35, 0.55, 0.75, 0.9)
SPEED_RATIOS = (0.05, 0.25, 0.45, 0.65, 0.85, 1.0)
ARTEFACT, ADHESIVE = "artefact of the minimum norm", "adhesive"


@dataclass(frozen=True)
class MapCell:
    """All comparisons with one family, restitution, redundancy and law.

    agree : share whose motions are one; adhesive, artefact : shares whose impulses truly pull, or only as chosen
    nearest : least distance among those that differ (how sharp the border is), farthest : largest of all
    typical : median distance among those that differ
    extra_loss, least_extra_loss : largest and least share of KE⁻ that IAPB loses in addition
    left_approaching, left_approaching_law : share with a contact (given or touching) left approaching
    contradictions : cases in which the motions are one without a p >= 0 for it, or the other way round
    defect : largest defect of statements 1 and 3 (`agreement`), momentum : largest momentum residual
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
    """Cosine of the rows and speed ratio: predicted agreement (r >= c), found agreement, distance of the motions."""

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
    """Whether a case speaks against "equal motions if and only if some p >= 0 gives IAPB's motion"."""
    return (found.distance <= SAME and found.cone_distance > REPRODUCED) or (
        found.cone_distance <= SAME and found.distance > REPRODUCED
    )


def _share(outcomes: Iterable[bool]) -> float:
    return float(np.mean([bool(outcome) for outcome in outcomes]))


def two_contact_map(
    cosines: Sequence[float] = COSINES, speed_ratios: Sequence[float] = SPEED_RATIOS, seed: int = 2,
    failures: list[Failure] | None = None,
) -> tuple[TwoContactCell, ...]:
    """Try the border r = c on a grid of two-contact impacts; grid points on the border itself are left out."""
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

"""Where IAPB's factored equality and the Newton LCP agree, by how much they differ, and why.

This module tests three exact statements on every case. Let Δ_eq = −(1+e) P u be IAPB's change of velocity in kinetic
coordinates (u = Lᵀv, A = J L⁻ᵀ, P projects onto the row space of A) and let C = {Aᵀp : p >= 0}. If all contacts have
the same e, then for *any* gamma_minus:

1. The LCP's change is the projection of Δ_eq on the cone C (its QP is min |Aᵀp + (1+e)u|, and (I − P)u is normal to C).
   So the laws agree if and only if some p >= 0 gives IAPB's velocity; their distance is the distance of Δ_eq from C.
2. Both changes are (1+e) times those of the plastic impact: whether the laws agree does not depend on e.
3. IAPB never keeps more energy than the LCP: loss_eq − loss_LCP = ½ (1−e)/(1+e) · distance². At e = 1 neither loses
   energy.

`map_rows` sums up the agreement by geometry, restitution and redundancy; `TWO_CONTACTS` tests two contacts.

Let two contacts have unit rows with the cosine c in the kinetic metric and approach at speeds 1 and r <= 1. Both
impulses of IAPB push if and only if r >= c, because W⁻¹ (1, r) is proportional to (1 − c r, r − c). If r < c, the
slower contact pulls. Neither the restitution nor any other component of the velocity matters.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np

from iapb import resolve_impact
from iapb.scene import scene_names
from reference.complementarity.laws import ADHESIVE, ARTEFACT, adhesion, newton_lcp
from reference.complementarity.problem import ImpactProblem
from verification.check import Check, Study
from verification.complementarity.families import FAMILIES, random_cases, two_contacts
from verification.complementarity.of_runs import scene_impacts
from verification.finding import MIXED, REPRODUCED, Failure, Part, attempt, verdict_of_share
from verification.impacts import ImpactCase
from verification.table import Row, Table

# Two velocities count as equal below this distance (kinetic metric, relative to |v⁻|), which is also C05's tolerance.
# Active-set solutions of well-conditioned cases reach about 1e-15; true differences are above 1e-4 in all families.
SAME = 1e-12
# Below this distance p >= 0 reproduces the velocity: ten times SAME, so that rounding alone gives no counterexample.
PUSHED = 1e-11
# A contact approaches if its velocity is below minus this share of the largest contact velocity. Rounding of an exact
# zero is smaller than this.
APPROACHING = 1e-9
# M(v⁺−v⁻) lies in range(Jᵀ) up to the rounding of two solves with M; condition numbers reach 1e4 in the families.
MOMENTUM = 1e-9
Resolver = Callable[[ImpactCase], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Comparison:
    """IAPB and the Newton LCP on one case; distances in the kinetic metric, relative to |v⁻|.

    distance : |v⁺ − v⁺_LCP|; cone_distance : distance of IAPB's impulse from {Jᵀp : p >= 0}
    energy_lost, energy_lost_law : loss of kinetic energy under IAPB and under the LCP, as a share of KE⁻
    adhesion : "none", "artefact of the minimum norm" or "adhesive"
    adhesive_share : sum of the pulling impulses that IAPB returns, divided by the sum of all |p|
    approaching, approaching_law : whether a contact, given or touching, still approaches after the impact
    momentum_residual : share of M(v⁺−v⁻) outside range(Jᵀ)
    """

    case: ImpactCase
    distance: float
    cone_distance: float
    energy_lost: float
    energy_lost_law: float
    adhesion: str
    adhesive_share: float
    approaching: bool
    approaching_law: bool
    momentum_residual: float

    @property
    def agrees(self) -> bool:
        """Whether the two laws give the same velocity."""
        return self.distance <= SAME

    @property
    def pushes(self) -> bool:
        """Whether some p >= 0 gives IAPB's velocity."""
        return self.cone_distance <= PUSHED

    @property
    def contradicts(self) -> bool:
        """Whether the case contradicts "the laws agree if and only if some p >= 0 gives IAPB's velocity"."""
        near, far = sorted((self.distance, self.cone_distance))
        return near <= SAME and far > PUSHED

    @property
    def defect(self) -> float:
        """Largest error of statements 1 and 3: |distance − cone_distance|, and that of the energy as a share of KE⁻."""
        e = self.case.restitution
        energy = self.energy_lost - self.energy_lost_law - (1.0 - e) / (1.0 + e) * self.distance**2
        return max(abs(self.distance - self.cone_distance), abs(energy))


def iapb(case: ImpactCase) -> tuple[np.ndarray, np.ndarray]:
    """Return v⁺ and p of the engine."""
    impact = resolve_impact(case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution)
    return impact.velocity, impact.impulses


def compare_case(case: ImpactCase, resolver: Resolver = iapb) -> Comparison:
    """Compare a resolver's outcome with the Newton LCP's on one case.

    Raises
    ------
    SolverError
        The law's own solver leaves a residual, so there is no solution to compare with.
    """
    problem = ImpactProblem.from_impact(case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution)
    v, p = resolver(case)
    law = newton_lcp(problem).velocity
    upper = np.linalg.cholesky(case.mass_matrix).T
    before, change = upper @ case.velocity, upper @ (v - case.velocity)
    speed = float(np.linalg.norm(before)) or 1.0
    total, scale = float(np.abs(p).sum()), float(np.abs(problem.gamma_minus).max(initial=0.0)) or 1.0
    rows = case.contact_jacobian if case.touching is None else np.vstack([case.contact_jacobian, case.touching])
    return Comparison(
        case, distance=float(np.linalg.norm(upper @ (v - law))) / speed,
        cone_distance=_cone_distance(problem, change) / speed,
        energy_lost=_lost(before, change), energy_lost_law=_lost(before, upper @ (law - case.velocity)),
        adhesion=adhesion(case.contact_jacobian, p, case.mass_matrix),
        adhesive_share=float(-p[p < 0.0].sum()) / total if total > 0.0 else 0.0,
        approaching=bool(np.any(rows @ v < -APPROACHING * scale)),
        approaching_law=bool(np.any(rows @ law < -APPROACHING * scale)),
        momentum_residual=_outside(problem.factor, change),
    )  # fmt: skip


def _lost(before: np.ndarray, change: np.ndarray) -> float:
    """Return (KE⁻ − KE⁺) / KE⁻, computed from the change of velocity to avoid cancellation."""
    energy = 0.5 * float(before @ before)
    return -float(before @ change + 0.5 * change @ change) / energy if energy > 0.0 else 0.0


def _cone_distance(problem: ImpactProblem, change: np.ndarray) -> float:
    """Return the distance of a change of velocity from {Aᵀp : p >= 0}, by non-negative least squares on unit rows."""
    from scipy.optimize import nnls

    rows, size = problem.factor, float(np.linalg.norm(change))
    if not len(rows) or size == 0.0:
        return size
    length = np.linalg.norm(rows, axis=1)
    unit = rows / np.where(length > 0.0, length, 1.0)[:, None]
    return float(nnls(unit.T, change / size)[1]) * size


def _outside(rows: np.ndarray, change: np.ndarray) -> float:
    size = float(np.linalg.norm(change))
    if size == 0.0 or not len(rows):
        return 0.0 if size == 0.0 else 1.0
    inside = rows.T @ np.linalg.lstsq(rows.T, change)[0]
    return float(np.linalg.norm(change - inside)) / size


def compare_cases(
    cases: Iterable[ImpactCase], resolver: Resolver = iapb, failures: list[Failure] | None = None
) -> tuple[Comparison, ...]:
    """Compare IAPB with the LCP on every case; `failures` receives the cases that raise an exception."""
    found = (attempt(f"{case.family}, e = {case.restitution:g}, impact {number}",
                     partial(compare_case, case, resolver), failures)
             for number, case in enumerate(cases, 1))  # fmt: skip
    return tuple(comparison for comparison in found if comparison is not None)


def map_rows(comparisons: Iterable[Comparison]) -> Iterator[Row]:
    """Yield a row for each family, restitution and redundancy, in the order of their first appearance."""
    groups: dict[tuple[str, float, int], list[Comparison]] = {}
    for found in comparisons:
        case = found.case
        groups.setdefault((case.family, case.restitution, case.redundancy), []).append(found)
    for (family, e, redundancy), members in groups.items():
        apart = [m.distance for m in members if not m.agrees]
        yield {
            "impacts": family, "e": e, "redundant rows": redundancy, "cases": len(members),
            "share that agrees": _share(m.agrees for m in members),
            "share that truly pulls": _share(m.adhesion == ADHESIVE for m in members),
            "share that pulls as chosen": _share(m.adhesion == ARTEFACT for m in members),
            "negative share of p": float(np.mean([m.adhesive_share for m in members])),
            "median distance where they differ": float(np.median(apart)) if apart else None,
            "largest distance": max(m.distance for m in members),
            "largest extra loss of KE⁻": max(0.0, *(m.energy_lost - m.energy_lost_law for m in members)),
            "left approaching by IAPB": _share(m.approaching for m in members),
            "left approaching by the LCP": _share(m.approaching_law for m in members),
            "contradictions": sum(m.contradicts for m in members), "defect": max(m.defect for m in members),
            "momentum outside range(Jᵀ)": max(m.momentum_residual for m in members),
        }  # fmt: skip


def _share(outcomes: Iterable[bool]) -> float:
    return float(np.mean([bool(outcome) for outcome in outcomes]))


COUNTS = {"quick": 25, "full": 250}  # impacts of each family, restitution and redundancy
SCENE_RESTITUTIONS = (None, 0.5)  # e of the scene (None), and e = 0.5, which gives more impacts, some of which differ


def _random(study: Study, family: str) -> Iterator[Row]:
    return map_rows(compare_cases(random_cases(COUNTS[study.depth], families=[family]), failures=study.failures))


def _of_scene(study: Study, name: str) -> Iterator[Row]:
    impacts = [scene_impacts(name, restitution=e) for e in SCENE_RESTITUTIONS]
    cases = [case for found in impacts for case in found.cases]
    return map_rows(compare_cases(cases, failures=study.failures))


def _map_says(table: Table) -> list[Part]:
    """Return the parts on the statements, on the project's scenes, and on contacts that touch without approaching."""
    rows = table.records()
    scenes = [row for row in rows if row["impacts"].startswith("scene ")]
    families = {name: [row for row in rows if row["impacts"] == name] for name in FAMILIES}
    whole = ", ".join(sorted(name for name, found in families.items() if _agreement(found) == 1.0))
    parts = [Part(
        "With equal e the two laws agree if and only if some p >= 0 gives IAPB's velocity; "
        f"{sum(row['contradictions'] for row in rows)} of {sum(row['cases'] for row in rows)} impacts contradict this. "
        "Where they differ, the distance is that of IAPB's impulse from the cone of pushing impulses, and IAPB loses ½ "
        f"(1−e)/(1+e) · distance² more (to {max(row['defect'] for row in rows):.0e}), at most "
        f"{max(row['largest extra loss of KE⁻'] for row in rows):.0%} of KE⁻. They agree in all impacts of: {whole}.",
        "", "statements")]  # fmt: skip
    if scenes:
        apart = sorted({row["impacts"].removeprefix("scene ") for row in scenes if row["share that agrees"] < 1.0})
        where = f"the laws differ in {', '.join(apart)}" if apart else "the laws agree in all"
        pulling, chosen = (sum(round(row[f"share that {kind}"] * row["cases"]) for row in scenes)
                           for kind in ("truly pulls", "pulls as chosen"))  # fmt: skip
        parts.append(Part(
            f"Impacts of the project's scenes, each run with its own e and with e = {SCENE_RESTITUTIONS[1]:g}: "
            f"{sum(row['cases'] for row in scenes)}; {where}. {pulling} impacts need a pulling impulse (no p >= 0 "
            f"gives their velocity); {chosen} have one only in the least-norm p.",
            MIXED if apart else REPRODUCED, "scenes"))  # fmt: skip
    if beside := families["with a neighbour"]:
        ours, theirs = (float(np.mean([row[f"left approaching by {law}"] for row in beside]))
                        for law in ("IAPB", "the LCP"))  # fmt: skip
        parts.append(Part(
            "A neighbouring contact that touches without approaching has no row in (19). After the impact it "
            f"approaches in {100 * ours:.0f} % of such impacts with IAPB, and in {100 * theirs:.0f} % with the LCP on "
            "the same rows.", verdict_of_share(1.0 - ours), "touching"))  # fmt: skip
    return parts


def _agreement(rows: Sequence[Row]) -> float:
    """Return the share of all impacts in which the laws agree."""
    return sum(row["share that agrees"] * row["cases"] for row in rows) / (sum(row["cases"] for row in rows) or 1)


MAP = Check(
    key="map", question="With equal e the laws agree if and only if some p >= 0 gives IAPB's velocity.",
    cases=lambda study: [*FAMILIES, *scene_names()],
    row=lambda study, name: _random(study, name) if name in FAMILIES else _of_scene(study, name),
    holds=lambda row: row["contradictions"] == 0 and row["defect"] <= PUSHED
    and row["momentum outside range(Jᵀ)"] <= MOMENTUM,
    says=_map_says, digits=3,
    note="IAPB and the Newton LCP; distances in the kinetic metric, relative to |v⁻|. An impact truly pulls where no "
    "p >= 0 gives its velocity; it pulls as chosen where only the least-norm p does. Left approaching: share of "
    "impacts after which some contact approaches, touching contacts without a row included. Defect: error of the "
    "statement on distance and energy. Impacts with per-body rows, friction or device limits are left out.",
)  # fmt: skip


COSINES = (-0.9, -0.6, -0.3, 0.0, 0.15, 0.35, 0.55, 0.75, 0.9)
SPEED_RATIOS = (0.05, 0.25, 0.45, 0.65, 0.85, 1.0)


def _grid(study: Study) -> list[tuple[float, float, ImpactCase]]:
    """Return the two-contact impacts on a grid; points with r = c are left out."""
    rng, points = np.random.default_rng(2), product(COSINES, SPEED_RATIOS)
    return [(cosine, ratio, two_contacts(cosine, ratio, rng)) for cosine, ratio in points if cosine != ratio]


def _two_contacts(study: Study, point: tuple[float, float, ImpactCase]) -> Row:
    cosine, ratio, case = point
    found = compare_case(case)
    return {"cosine": cosine, "speed ratio": ratio, "agreement predicted": ratio >= cosine,
            "agreement found": found.agrees, "distance": found.distance}  # fmt: skip


TWO_CONTACTS = Check(
    key="two contacts", question="Two contacts with approach speeds 1 and r, whose rows have the cosine c in the "
    "kinetic metric: the laws agree exactly where r >= c.",
    cases=_grid, row=_two_contacts, holds=lambda row: row["agreement predicted"] == row["agreement found"], digits=3,
    note="Two contacts with approach speeds 1 and r, whose rows have this cosine in the kinetic metric.",
)  # fmt: skip

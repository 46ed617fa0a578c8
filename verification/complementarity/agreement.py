"""Where IAPB's factored equality and the Newton LCP agree, by how much they differ, and why.

This module tests three exact statements on every case. Let Δ_eq = −(1+e) P u be IAPB's change of
velocity in kinetic coordinates (u = Lᵀv, A = J L⁻ᵀ, P projects onto the row space of A) and let C =
{Aᵀp : p >= 0}. If all contacts have the same e, then for *any* gamma_minus:

1. The LCP's change is the projection of Δ_eq on the cone C (its QP is min |Aᵀp + (1+e)u|, and
   (I − P)u is normal to C). So the laws agree if and only if some p >= 0 gives IAPB's velocity;
   their distance is the distance of Δ_eq from C.
2. Both changes are (1+e) times those of the plastic impact: whether the laws agree does not depend
   on e.
3. IAPB never keeps more energy than the LCP: loss_eq − loss_LCP = ½ (1−e)/(1+e) · distance². At
   e = 1 neither loses energy.

Let two contacts have unit rows with the cosine c in the kinetic metric and approach at speeds 1 and
r <= 1. Both impulses of IAPB push if and only if r >= c, because W⁻¹ (1, r) is proportional to (1 −
c r, r − c). If r < c, the slower contact pulls. Neither the restitution nor any other component of
the velocity matters.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from iapb import resolve_impact
from iapb.scene import scene_names
from reference.complementarity.laws import newton_lcp, unpushed_share
from reference.complementarity.problem import ImpactProblem
from verification.check import Check, Study, no_row_fails
from verification.complementarity.families import FAMILIES, random_cases, two_contacts
from verification.complementarity.of_runs import scene_impacts
from verification.complementarity.piles import sphere_piles
from verification.finding import Failure, Part, attempt
from verification.impacts import Floats, ImpactCase
from verification.table import Row, Table

# Two velocities count as equal below this distance (kinetic metric, relative to |v⁻|), which is
# also C05's tolerance. Active-set solutions of well-conditioned cases reach about 1e-15; true
# differences are above 1e-4 in all families.
SAME = 1e-12
# Below this distance p >= 0 reproduces the velocity: ten times SAME, so that rounding alone gives
# no counterexample.
PUSHED = 1e-11
# A contact approaches if its velocity is below minus this share of the largest contact velocity.
# Rounding of an exact zero is smaller than this.
APPROACHING = 1e-9
# M(v⁺−v⁻) lies in range(Jᵀ) up to the rounding of two solves with M; condition numbers reach 1e4 in
# the families.
MOMENTUM = 1e-9


def compare_case(case: ImpactCase) -> dict[str, Any]:
    """Compare IAPB's outcome with the Newton LCP's on one case.

    Returns
    -------
    dict
        distance : |v⁺ − v⁺_LCP| in the kinetic metric, relative to |v⁻|.  agrees : whether the
        velocities are equal; pushes : whether some p >= 0 gives v⁺;
        contradicts : whether one holds without the other, which statement 1 excludes.
        extra loss : loss of kinetic energy beyond that of the LCP, as a share of KE⁻.
        defect : largest error of statements 1 and 3.
        approaching, approaching by the LCP : whether a contact, given or touching, still
            approaches.
        outside : share of M(v⁺−v⁻) outside range(Jᵀ).

    Raises
    ------
    SolverError
        The law's own solver leaves a residual, so there is no solution to compare with.
    """
    problem = ImpactProblem.from_impact(*case.arrays, case.restitution)
    v = resolve_impact(*case.arrays, case.restitution).velocity
    law = newton_lcp(problem).velocity
    upper = case.lower.T
    e = case.restitution
    change = upper @ (v - case.velocity)
    scale = float(np.abs(problem.gamma_minus).max(initial=0.0)) or 1.0
    rows = (
        case.contact_jacobian
        if case.touching is None
        else np.vstack([case.contact_jacobian, case.touching])
    )
    distance, cone = distances(case, v, law)
    extra = _lost(case.u, change) - _lost(case.u, upper @ (law - case.velocity))
    near, far = sorted((distance, cone))
    return {
        "impacts": case.family,
        "distance": distance,
        "agrees": distance <= SAME,
        "pushes": cone <= PUSHED,
        "contradicts": near <= SAME and far > PUSHED,
        "extra loss": extra,
        "defect": max(abs(distance - cone), abs(extra - (1.0 - e) / (1.0 + e) * distance**2)),
        "approaching": bool(np.any(rows @ v < -APPROACHING * scale)),
        "approaching by the LCP": bool(np.any(rows @ law < -APPROACHING * scale)),
        "outside": _outside(case.rows, change),
    }


def distances(case: ImpactCase, velocity: Floats, law: Floats) -> tuple[float, float]:
    """Return how far v⁺ (d,) is from the law's, and its impulse from {Jᵀp : p >= 0}.

    Both are in the kinetic metric, relative to |v⁻|.
    """
    change = case.lower.T @ (velocity - case.velocity)
    pulled = unpushed_share(case.rows.T, change) * float(np.linalg.norm(change))
    return case.distance(velocity, law), pulled / (case.speed or 1.0)


def _lost(before: Floats, change: Floats) -> float:
    """Return (KE⁻ − KE⁺) / KE⁻, computed from the change of velocity to avoid cancellation."""
    energy = 0.5 * float(before @ before)
    return -float(before @ change + 0.5 * change @ change) / energy if energy > 0.0 else 0.0


def _outside(rows: Floats, change: Floats) -> float:
    size = float(np.linalg.norm(change))
    if size == 0.0 or not len(rows):
        return 0.0 if size == 0.0 else 1.0
    inside = rows.T @ np.linalg.lstsq(rows.T, change)[0]
    return float(np.linalg.norm(change - inside)) / size


def compare_cases(
    cases: Iterable[ImpactCase], failures: list[Failure] | None = None
) -> list[dict[str, Any]]:
    """Return `compare_case` of every case; `failures` receives the cases that raise an
    exception."""
    found = (
        attempt(
            f"{case.family}, e = {case.restitution:g}, impact {number}",
            partial(compare_case, case),
            failures,
        )
        for number, case in enumerate(cases, 1)
    )
    return [row for row in found if row is not None]


PILES = "piles of spheres"
COUNTS = {"quick": 25, "full": 250}  # impacts of each family, restitution and redundancy
# e of the scene (None), and e = 0.5, which gives more impacts, some of which differ
SCENE_RESTITUTIONS = (None, 0.5)


def _compared(study: Study, name: str) -> Row | tuple[()]:
    """Return the row of a family or of a scene; none if a scene has no impact to compare."""
    cases: Iterable[ImpactCase]
    if name in FAMILIES:
        cases = random_cases(COUNTS[study.depth], families=[name])
    elif name == PILES:
        cases = sphere_piles(study.depth)
    else:
        cases = (case for e in SCENE_RESTITUTIONS for case in scene_impacts(name, e))
    compared = compare_cases(cases, failures=study.failures)
    return map_row(name, compared) if compared else ()


def map_row(name: str, compared: Sequence[Row]) -> Row:
    """Return the row of a kind of impacts."""
    every = {key: np.array([one[key] for one in compared]) for key in compared[0]}
    apart = every["distance"][~every["agrees"]]
    agree = int(every["agrees"].sum())
    return {
        "impacts": name,
        "kind": RANDOM if name in FAMILIES or name == PILES else SCENE,
        "cases": len(compared),
        "agree": agree,
        "differ": len(compared) - agree,
        "median distance where they differ": float(np.median(apart)) if len(apart) else None,
        "largest extra loss of KE⁻": max(0.0, float(every["extra loss"].max())),
        "left approaching by IAPB": float(np.mean(every["approaching"])),
        "left approaching by the LCP": float(np.mean(every["approaching by the LCP"])),
        "contradictions": int(every["contradicts"].sum()),
        "defect": float(every["defect"].max()),
        "momentum outside range(Jᵀ)": float(every["outside"].max()),
    }


def _map_targets(table: Table) -> Iterator[Part]:
    yield Part.on("impacts that contradict the condition", sum(table["contradictions"]), 0)


RANDOM = "random"
SCENE = "scene"
MAP = Check(
    key="map",
    question="Do the laws agree exactly where some p >= 0 gives IAPB's velocity?",
    cases=lambda study: [*FAMILIES, PILES, *scene_names()],
    row=_compared,
    holds=lambda row: (
        row["contradictions"] == 0
        and row["defect"] <= PUSHED
        and row["momentum outside range(Jᵀ)"] <= MOMENTUM
    ),
    targets=_map_targets,
)


COSINES = (-0.9, -0.6, -0.3, 0.0, 0.15, 0.35, 0.55, 0.75, 0.9)
SPEED_RATIOS = (0.05, 0.25, 0.45, 0.65, 0.85, 1.0)


def _grid(study: Study) -> list[tuple[float, float, ImpactCase]]:
    """Return the two-contact impacts on a grid; points with r = c are left out."""
    rng = np.random.default_rng(2)
    points = product(COSINES, SPEED_RATIOS)
    return [
        (cosine, ratio, two_contacts(cosine, ratio, rng))
        for cosine, ratio in points
        if cosine != ratio
    ]


def _two_contacts(study: Study, point: tuple[float, float, ImpactCase]) -> Row:
    cosine, ratio, case = point
    found = compare_case(case)
    return {
        "cosine": cosine,
        "speed ratio": ratio,
        "agreement predicted": ratio >= cosine,
        "agreement found": found["agrees"],
        "distance": found["distance"],
    }


TWO_CONTACTS = Check(
    key="two contacts",
    question="Do the laws agree at two contacts exactly where r >= c?",
    cases=_grid,
    row=_two_contacts,
    holds=lambda row: row["agreement predicted"] == row["agreement found"],
    targets=no_row_fails("points of the map that contradict r >= c"),
)

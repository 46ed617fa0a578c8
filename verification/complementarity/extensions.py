"""Compare IAPB's extensions with complementarity: friction in the impact, and unequal restitution.

Friction: the engine's law (`resolve_frictional_impact`) is compared with Coulomb's law (NCP) and
its convex relaxation (CCP). Unequal restitution: the engine and the reference solve the two LCPs of
Poisson's law with independent solvers.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np

from iapb import resolve_frictional_impact, resolve_impact
from iapb.errors import SolverError
from reference.complementarity.laws import (
    coulomb_ccp,
    coulomb_ncp,
    newton_equality,
    newton_lcp,
    poisson,
)
from reference.complementarity.problem import ImpactProblem
from reference.exact import relative_energy_gain
from verification.check import Check, Study
from verification.complementarity.families import random_mass_matrix
from verification.finding import Part
from verification.impacts import Floats, ImpactCase
from verification.table import Row, Table

# The sweeps of NSGS reach about 1e-10 of the velocities; outcomes of two different laws differ by
# far more.
SAME_WITH_FRICTION = 1e-7
GAIN = 1e-12  # a relative gain of kinetic energy below this is rounding
# Largest difference of two solvers of one law: ten times the residual that
# `reference.complementarity.laws` accepts.
SAME_LAW = 1e-8
RESTITUTIONS = (0.0, 0.5, 1.0)
FRICTIONS = (0.1, 0.5, 1.0)
COUNTS = {"quick": 40, "full": 300}  # impacts of each e and μ
UNEQUAL_COUNTS = {"quick": 100, "full": 1000}


def draw(rng: np.random.Generator, approaching: bool) -> ImpactCase:
    """Draw an impact with one to three contacts, one or two tangents each, and three to eight
    coordinates."""
    d = int(rng.integers(3, 9))
    c = int(rng.integers(1, 4))
    m = int(rng.integers(1, 3))
    velocity = rng.normal(size=d)
    rows = rng.normal(size=(c, d))
    if approaching:
        rows = np.where(rows @ velocity > 0.0, -1.0, 1.0)[:, None] * rows
    mass = random_mass_matrix(rng, d)
    return ImpactCase(mass, rows, velocity, tangents=0.5 * rng.normal(size=(c, m, d)))


def _gain(impact: ImpactCase, v_plus: Floats) -> float:
    """Return (KE⁺ − KE⁻)/KE⁻."""
    return relative_energy_gain(impact.mass_matrix, impact.velocity, v_plus)


def with_friction(study: Study, case: tuple[float, float]) -> Row:
    """Compare the engine's frictional impact with Coulomb's NCP and CCP on random impacts with one
    e and one μ."""
    (e, mu) = case
    rng = np.random.default_rng(44)
    drawn = [draw(rng, approaching=True) for _ in range(COUNTS[study.depth])]
    impacts = [replace(one, restitution=e, friction=np.full(one.contacts, mu)) for one in drawn]
    pushing = same = reduced = unsolved = 0
    of_ours = list[float]()
    of_ncp = list[float]()
    of_ccp = list[float]()
    distances = list[float]()
    for impact in impacts:
        mass, rows, v = impact.arrays
        ours = resolve_frictional_impact(*impact.given())
        of_ours.append(_gain(impact, ours.velocity))
        reduced += ours.friction_share < 1.0
        ncp, ccp = _counterparts(impact, e, mu)
        for gains, v_plus in ((of_ncp, ncp), (of_ccp, ccp)):
            if v_plus is not None:
                gains.append(_gain(impact, v_plus))
        if ncp is None or ours.status not in ("complete", "scaled"):
            unsolved += 1
            continue
        distances.append(impact.distance(ours.velocity, ncp))
        without = resolve_impact(mass, rows, v, e).impulses
        if (
            ours.friction_share == 1.0 and min(ours.impulses.min(), without.min()) >= 0.0
        ):  # all push, either way
            pushing += 1
            same += distances[-1] <= SAME_WITH_FRICTION
    return {
        "e": e,
        "μ": mu,
        "cases": len(impacts),
        "all contacts push": pushing,
        "equal to the NCP": same,
        "friction reduced": reduced,
        "unsolved": unsolved,
        "NCP gains": sum(g > GAIN for g in of_ncp),
        "CCP gains": sum(g > GAIN for g in of_ccp),
        "largest change of KE, IAPB": max(of_ours),
        "NCP": max(of_ncp, default=None),
        "CCP": max(of_ccp, default=None),
        "median distance from the NCP": float(np.median(distances)) if distances else None,
    }


def _counterparts(impact: ImpactCase, e: float, mu: float) -> Iterator[Floats | None]:
    """Yield v⁺ of the NCP and of the CCP; None for a problem that NSGS does not solve."""
    mass, rows, v = impact.arrays
    blocks = np.concatenate([rows[:, None, :], impact.tangents], axis=1)
    problem = ImpactProblem.from_impact(
        mass, blocks.reshape(-1, len(v)), v, e, mu, contact_size=blocks.shape[1]
    )
    for law in (coulomb_ncp, coulomb_ccp):
        try:
            yield law(problem).velocity
        except SolverError:
            yield None


def _friction_targets(table: Table) -> Iterator[Part]:
    apart = sum(table["all contacts push"]) - sum(table["equal to the NCP"])
    yield Part.on("impacts with friction that push and differ from Coulomb's law", apart, 0)
    most = max(table["largest change of KE, IAPB"])
    yield Part.on("largest gain of an impact with friction, of the energy", most, GAIN)


FRICTION = Check(
    key="friction",
    question="Is the law of friction in impacts Coulomb's where all contacts push, and passive?",
    cases=lambda study: product(RESTITUTIONS, FRICTIONS),
    row=with_friction,
    targets=_friction_targets,
    holds=lambda row: bool(
        row["equal to the NCP"] == row["all contacts push"]
        and row["largest change of KE, IAPB"] <= GAIN
    ),
)


def with_unequal(study: Study, signs: str) -> Row:
    """Compare the engine's law for unequal restitution with Poisson, the Newton LCP and plain
    equalities."""
    rng = np.random.default_rng([45, len(signs)])
    count = UNEQUAL_COUNTS[study.depth]
    distances = []
    gains = np.zeros((count, 3))
    for k in range(count):
        impact = draw(rng, approaching=signs == "all approach")
        e = rng.choice([0.0, 0.2, 0.7, 1.0], size=impact.contacts)
        ours = resolve_impact(*impact.arrays, e)
        problem = ImpactProblem.from_impact(*impact.arrays, e)
        if len(set(e)) > 1:
            distances.append(impact.distance(ours.velocity, poisson(problem).velocity))
        others = [law(problem).velocity for law in (newton_lcp, newton_equality)]
        gains[k] = [_gain(impact, v_plus) for v_plus in (ours.velocity, *others)]
    names = ("largest change of KE, IAPB", "Newton LCP", "equalities")
    return {
        "contacts": signs,
        "cases": count,
        "distance from Poisson's law": max(distances, default=None),
        **dict(zip(names, gains.max(axis=0).tolist(), strict=True)),
    }


def _unequal_targets(table: Table) -> Iterator[Part]:
    apart = max(table["distance from Poisson's law"])
    yield Part.on("impacts of unequal restitution, from Poisson's law, of |v⁻|", apart, SAME_LAW)
    most = max(table["largest change of KE, IAPB"])
    yield Part.on("largest gain of an impact of unequal restitution, of the energy", most, GAIN)


UNEQUAL = Check(
    key="unequal restitution",
    question="Is the law of unequal restitution Poisson's, and passive?",
    cases=lambda study: ("all approach", "mixed signs"),
    row=with_unequal,
    targets=_unequal_targets,
    holds=lambda row: bool(
        row["distance from Poisson's law"] <= SAME_LAW and row["largest change of KE, IAPB"] <= GAIN
    ),
)

"""Compare IAPB's extensions with complementarity: friction in the impact, and unequal restitution.

Friction: the engine's law (`resolve_frictional_impact`) is compared with Coulomb's law as a nonlinear complementarity
problem (NCP) and with the convex relaxation of this problem (CCP). If all contacts push and the engine did not reduce
friction, the engine and the NCP give the same velocity. With e > 0 the NCP can gain energy; the engine cannot.

Unequal restitution: the engine and the reference solve the two LCPs of Poisson's law with independent solvers. Two
other laws are compared: the Newton LCP, which can gain energy if some contacts separate, and plain equalities, which
can gain energy even if all contacts approach.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb import FrictionalImpact, resolve_frictional_impact, resolve_impact
from iapb.errors import SolverError
from reference.complementarity.laws import (
    LAWS,
    coulomb_ccp,
    coulomb_ncp,
    newton_equality,
    newton_lcp,
    poisson,
)
from reference.complementarity.problem import ImpactProblem
from verification.complementarity.cases import random_mass_matrix
from verification.finding import Failure, attempt

Floats = NDArray[np.float64]

# The sweeps of NSGS reach about 1e-10 of the velocities; outcomes of two different laws differ by far more.
SAME_WITH_FRICTION = 1e-7
GAIN = 1e-12  # a relative gain of kinetic energy below this is rounding
RESTITUTIONS, FRICTIONS = (0.0, 0.5, 1.0), (0.1, 0.5, 1.0)


@dataclass(frozen=True)
class FrictionCell:
    """All impacts with one e and one μ; numbers of impacts, and energies as shares of KE⁻.

    pushing : impacts in which every contact pushes, with and without friction, and friction is not reduced
    same : number of those in which the velocity equals that of the NCP
    reduced : impacts in which the engine reduces friction to avoid a gain of energy
    ncp_gains, ccp_gains : impacts in which that law gains energy
    unsolved : impacts in which NSGS or the engine does not converge; only their energies are compared
    """

    restitution: float
    friction: float
    cases: int
    pushing: int
    same: int
    reduced: int
    unsolved: int
    ncp_gains: int
    ccp_gains: int
    largest_gain: float
    largest_gain_ncp: float
    largest_gain_ccp: float
    typical_distance: float


@dataclass(frozen=True)
class UnequalCell:
    """Impacts with unequal restitution: the engine's Poisson law compared with three reference laws.

    signs : "all approach" or "mixed signs", the signs of the contact velocities before the impact
    distance : largest distance of v⁺ from the reference's Poisson law, in the kinetic metric, relative to |v⁻|
    gain, gain_newton_lcp, gain_equality : largest relative gain of energy of each law
    """

    signs: str
    cases: int
    distance: float
    gain: float
    gain_newton_lcp: float
    gain_equality: float


class _Impact(NamedTuple):
    mass: Floats
    rows: Floats
    tangents: Floats
    velocity: Floats

    @property
    def energy(self) -> float:
        return 0.5 * float(self.velocity @ self.mass @ self.velocity)

    def gain(self, v_plus: Floats) -> float:
        """Return (KE⁺ − KE⁻)/KE⁻."""
        return (0.5 * float(v_plus @ self.mass @ v_plus) - self.energy) / self.energy

    def distance(self, first: Floats, second: Floats) -> float:
        """Return the distance of two velocities in the kinetic metric, relative to |v⁻|."""
        change = first - second
        return float(np.sqrt(change @ self.mass @ change / (2.0 * self.energy)))


def _draw(rng: np.random.Generator, approaching: bool) -> _Impact:
    """Draw an impact with one to three contacts, one or two tangents each, and three to eight coordinates."""
    d, c, m = int(rng.integers(3, 9)), int(rng.integers(1, 4)), int(rng.integers(1, 3))
    velocity, rows = rng.normal(size=d), rng.normal(size=(c, d))
    if approaching:
        rows = np.where(rows @ velocity > 0.0, -1.0, 1.0)[:, None] * rows
    return _Impact(random_mass_matrix(rng, d), rows, 0.5 * rng.normal(size=(c, m, d)), velocity)


def compare_friction(
    count: int = 60, restitutions: tuple[float, ...] = RESTITUTIONS, frictions: tuple[float, ...] = FRICTIONS,
    seed: int = 44, progress: Callable[[str, int, int], None] | None = None,
    failures: list[Failure] | None = None,
) -> tuple[FrictionCell, ...]:
    """Compare the engine's frictional impact with Coulomb's NCP and CCP on random impacts."""
    rng = np.random.default_rng(seed)
    impacts, cells = [_draw(rng, approaching=True) for _ in range(count)], []
    pairs = [(e, mu) for e in restitutions for mu in frictions]
    for done, (e, mu) in enumerate(pairs):
        cells.append(attempt(f"friction, e = {e:g}, μ = {mu:g}", partial(_friction_cell, impacts, e, mu), failures))
        if progress is not None:
            progress("friction", done + 1, len(pairs))
    return tuple(cell for cell in cells if cell is not None)


def _friction_cell(impacts: list[_Impact], e: float, mu: float) -> FrictionCell:
    pushing = same = reduced = unsolved = 0
    gains: dict[str, list[float]] = {"ours": [], "ncp": [], "ccp": []}
    distances = []
    for impact in impacts:
        ours = resolve_frictional_impact(impact.mass, impact.rows, impact.tangents, impact.velocity, e, mu)
        gains["ours"].append(ours.energy_change / impact.energy)
        reduced += ours.friction_share < 1.0
        ncp, ccp = _counterparts(impact, e, mu)
        for name, v_plus in (("ncp", ncp), ("ccp", ccp)):
            if v_plus is not None:
                gains[name].append(impact.gain(v_plus))
        if ncp is None or ours.status != "complete":
            unsolved += 1
            continue
        distances.append(impact.distance(ours.velocity, ncp))
        if _pushes(impact, e, ours):
            pushing += 1
            same += distances[-1] <= SAME_WITH_FRICTION
    largest = {name: max(found, default=np.nan) for name, found in gains.items()}
    return FrictionCell(
        e, mu, len(impacts), pushing, same, reduced, unsolved,
        ncp_gains=sum(g > GAIN for g in gains["ncp"]), ccp_gains=sum(g > GAIN for g in gains["ccp"]),
        largest_gain=largest["ours"], largest_gain_ncp=largest["ncp"], largest_gain_ccp=largest["ccp"],
        typical_distance=float(np.median(distances)) if distances else np.nan,
    )  # fmt: skip


def _pushes(impact: _Impact, e: float, ours: FrictionalImpact) -> bool:
    """Return whether every contact pushes, with friction and without it, and friction is not reduced."""
    without = resolve_impact(impact.mass, impact.rows, impact.velocity, e).impulses
    return bool(ours.friction_share == 1.0 and min(ours.impulses.min(), without.min()) >= 0.0)


def _counterparts(impact: _Impact, e: float, mu: float) -> tuple[Floats | None, Floats | None]:
    """Return v⁺ of the NCP and of the CCP; None for a problem that NSGS does not solve."""
    blocks = np.concatenate([impact.rows[:, None, :], impact.tangents], axis=1)
    rows, size = blocks.reshape(-1, blocks.shape[2]), blocks.shape[1]
    problem = ImpactProblem.from_impact(impact.mass, rows, impact.velocity, e, mu, contact_size=size)
    found: list[Floats | None] = []
    for law in (coulomb_ncp, coulomb_ccp):
        try:
            found.append(law(problem).velocity)
        except SolverError:
            found.append(None)
    return found[0], found[1]


def compare_unequal(
    count: int = 200, seed: int = 45, failures: list[Failure] | None = None
) -> tuple[UnequalCell, ...]:
    """Compare the engine's law for unequal restitution with Poisson, the Newton LCP and plain equalities."""
    cells = (attempt(f"unequal restitution, {signs}", partial(_unequal_cell, signs, count, seed), failures)
             for signs in ("all approach", "mixed signs"))  # fmt: skip
    return tuple(cell for cell in cells if cell is not None)


def _unequal_cell(signs: str, count: int, seed: int) -> UnequalCell:
    rng = np.random.default_rng([seed, len(signs)])
    distances, gains = [], np.zeros((count, 3))
    for k in range(count):
        impact = _draw(rng, approaching=signs == "all approach")
        e = rng.choice([0.0, 0.2, 0.7, 1.0], size=len(impact.rows))
        ours = resolve_impact(impact.mass, impact.rows, impact.velocity, e)
        problem = ImpactProblem.from_impact(impact.mass, impact.rows, impact.velocity, e)
        if len(set(e)) > 1:
            distances.append(impact.distance(ours.velocity, poisson(problem).velocity))
        gains[k] = [ours.energy_change / impact.energy,
                    *(impact.gain(law(problem).velocity) for law in (newton_lcp, newton_equality))]  # fmt: skip
    return UnequalCell(signs, count, max(distances, default=np.nan), *(float(g) for g in gains.max(axis=0)))


def struck_bar() -> dict[str, float]:
    """Return the kinetic energies [J] by law of the bar of docs/theory.md, struck at 0.5 and 0.4 with e = (1, 0)."""
    mass, rows = np.diag([1.0, 1.0 / 12.0]), np.array([[1.0, 0.5], [1.0, 0.4]])
    velocity, e = np.array([-1.0, 0.0]), (1.0, 0.0)
    problem = ImpactProblem.from_impact(mass, rows, velocity, e)
    outcomes = {name: LAWS[name].apply(problem).velocity for name in ("newton_equality", "newton_lcp", "poisson")}
    outcomes["IAPB, unequal restitution"] = resolve_impact(mass, rows, velocity, e).velocity
    return {"before": 0.5} | {name: 0.5 * float(v @ mass @ v) for name, v in outcomes.items()}

"""Impacts on which equalities and complementarity have the same exact answer, so that both can be measured.

The approach is u⁻ = −Aᵀw + z with w > 0 and A z = 0: then p = (1 + e) w pushes at every contact, so that the
equality law (21) and Newton's LCP have one and the same v⁺ (to the rounding of v⁻ in nearly dependent directions).
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.exact import exact_impact

Floats = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class TimedProblem:
    """One impact to be timed.

    Attributes
    ----------
    family : "conditioning" or "contacts".  closeness : relative distance of nearly dependent rows (1 = generic).
    mass_condition : κ(M) it was made with.
    """

    family: str
    mass_matrix: Floats
    contact_jacobian: Floats
    velocity: Floats
    restitution: float
    mass_condition: float
    closeness: float

    @property
    def coordinates(self) -> int:
        """d."""
        return len(self.velocity)

    @property
    def contacts(self) -> int:
        """c."""
        return len(self.contact_jacobian)

    @property
    def label(self) -> str:
        """Short name for a table."""
        return f"d={self.coordinates} c={self.contacts} κ(M)={self.mass_condition:.0e} rows {self.closeness:.0e} apart"

    @cached_property
    def truth(self) -> tuple[Fraction, ...]:
        """Exact v⁺ of the numbers given."""
        return exact_impact(self.mass_matrix, self.contact_jacobian, self.velocity, self.restitution).velocity


def timed_problems(families: tuple[str, ...] = ("conditioning", "contacts"), seed: int = 0) -> tuple[TimedProblem, ...]:
    """Return the problems: conditioning of M and of the rows at d = 6, c = 4; contact counts 4 to 300 at d = 12."""
    problems = []
    if "conditioning" in families:
        for condition in (1e0, 1e4, 1e8):
            for closeness in (1.0, 1e-4, 1e-8):
                problems.append(_problem("conditioning", 6, 4, condition, closeness, seed))
    if "contacts" in families:
        for contacts in (4, 12, 60, 300):
            problems.append(_problem("contacts", 12, contacts, 1e2, 1.0, seed))
    return tuple(problems)


def _problem(family: str, d: int, c: int, condition: float, closeness: float, seed: int) -> TimedProblem:
    rng = np.random.default_rng([seed, d, c, int(np.log10(condition)), int(-np.log10(closeness))])
    axes = np.linalg.qr(rng.normal(size=(d, d)))[0]
    mass = axes * condition ** -np.linspace(0.0, 1.0, d) @ axes.T
    mass = 0.5 * (mass + mass.T)
    rows = _rows(rng, d, c, closeness)
    lower = np.linalg.cholesky(mass)
    whitened = np.linalg.solve(lower, rows.T).T
    approach = -whitened.T @ (rng.uniform(0.2, 1.0, size=c) / np.linalg.norm(whitened, axis=1))
    sliding = rng.normal(size=d)
    _, values, right = np.linalg.svd(whitened, full_matrices=False)
    for direction in right[values > 1e-12 * values[0]]:
        sliding -= (direction @ sliding) * direction
    sliding /= max(float(np.linalg.norm(sliding)), 1.0)
    v = np.linalg.solve(lower.T, approach / float(np.linalg.norm(approach)) + sliding)
    return TimedProblem(family, mass, rows, v, 0.5, condition, closeness)


def _rows(rng: np.random.Generator, d: int, c: int, closeness: float) -> Floats:
    """Half of the rows lie `closeness` beside the other half; many contacts span two thirds of the motion."""
    rank = min(c, (2 * d) // 3)
    base = rng.integers(-4, 5, size=(c, rank)) @ rng.integers(-4, 5, size=(rank, d)).astype(float)
    if c <= d:
        base = rng.normal(size=(c, d))
    if closeness < 1.0:
        half = c // 2
        base[half:] = base[: c - half] + closeness * rng.normal(size=(c - half, d))
    return base

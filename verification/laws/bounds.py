"""Residuals of the laws, and their tolerances, each with its reason."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from verification.impacts import ImpactCase

EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class LawResidual:
    """Residual of one law; it passes if value <= tolerance (a value that is not finite never passes).

    For a law with tolerance 0, `excused` is the largest value that rounding can cause. A value up to `excused` is a
    failure, but not a severe one.
    """

    law: str
    value: float
    tolerance: float
    excused: float = field(default=0.0, repr=False)

    @property
    def ratio(self) -> float:
        """value / tolerance; infinite if the value is not finite."""
        if not math.isfinite(self.value):
            return np.inf
        return self.value / self.tolerance if self.tolerance > 0.0 else (np.inf if self.value > 0.0 else 0.0)

    @property
    def passed(self) -> bool:
        """Whether the law holds within its tolerance."""
        return self.ratio <= 1.0

    @property
    def severe(self) -> bool:
        """Whether rounding cannot explain the failure."""
        return not self.passed and not self.value <= self.excused


@dataclass(frozen=True)
class Bounds:
    """Tolerances for a resolver.

    Attributes
    ----------
    factor, power, ceiling : relative energy gain at most min(ceiling, factor · d · ε · κ(M)^power).
    restitution : largest |Jᵢv⁺ + e Jᵢv⁻| / (‖Aᵢ‖ |u|).
    bitwise_scaling : True if scaling rows by powers of two must change no bit.
    least : lower limit of the tolerances: the accuracy, relative to |u|, of a solver that iterates or uses J M⁻¹ Jᵀ.
    """

    factor: float
    power: float
    ceiling: float
    restitution: float
    bitwise_scaling: bool
    least: float = 0.0

    def energy_gain(self, case: ImpactCase) -> float:
        """Largest allowed relative gain (KE⁺ − KE⁻)/KE⁻, which rounding can cause."""
        return max(self.least, min(self.ceiling, self.factor * case.coordinates * EPS * case.condition**self.power))

    def comparison(self, case: ImpactCase) -> float:
        """Largest allowed distance, relative to |u|, between two velocities that are equal in exact arithmetic.

        Whitening causes an error ε κ(M) (Cholesky's backward error); a direction of singular value σ has an error
        ε √κ(M) / σ. Rows that are dependent up to a noise below 1e-13 span directions that differ by noise / σ; the
        factor 1 + e = 2 doubles this.
        """
        root = np.sqrt(case.condition)
        rounding = 100.0 * case.coordinates * EPS * float(root * (root + 1.0 / case.smallest_motion))
        noise = 4.0 * float(np.sqrt(max(case.contacts, 1))) * case.largest_noise / case.smallest_motion
        return max(self.least, rounding + noise)


# Any correct resolver in plain numpy (Cholesky, then an SVD of unit rows) keeps these.
KIT = Bounds(factor=100.0, power=1.0, ceiling=1e-7, restitution=1e-8, bitwise_scaling=False)
# The guarantees of `factored` with its clamp (docstring of resolve_impact), for any κ(M) that Cholesky accepts.
FACTORED = Bounds(factor=10.0, power=0.5, ceiling=np.inf, restitution=1e-8, bitwise_scaling=True)
# Unilateral contacts: a textbook solver of the complementarity problem, by pivoting or by sweeps, keeps these.
ONE_SIDED = Bounds(factor=100.0, power=1.0, ceiling=1e-7, restitution=1e-7, bitwise_scaling=False, least=1e-7)

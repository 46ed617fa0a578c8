"""How far an impact is from a law, and the tolerances of the laws, each with its reason."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from verification.impacts import ImpactCase

EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class LawResidual:
    """How far an impact is from keeping a law; passes while value <= tolerance (an unknown value never does).

    A law without tolerance says in `excused` how much of the value may be rounding: there it fails, but not severely.
    """

    law: str
    value: float
    tolerance: float
    excused: float = field(default=0.0, repr=False)

    @property
    def ratio(self) -> float:
        """value / tolerance; infinite where the value is unknown."""
        if not math.isfinite(self.value):
            return np.inf
        return self.value / self.tolerance if self.tolerance > 0.0 else (np.inf if self.value > 0.0 else 0.0)

    @property
    def passed(self) -> bool:
        """Whether the law holds to its tolerance."""
        return self.ratio <= 1.0

    @property
    def severe(self) -> bool:
        """Whether the law is broken by more than rounding."""
        return not self.passed and not self.value <= self.excused


@dataclass(frozen=True)
class Bounds:
    """What is asked of a resolver.

    Attributes
    ----------
    factor, power, ceiling : relative energy gain at most min(ceiling, factor · d · ε · κ(M)^power).
    restitution : largest |Jᵢv⁺ + e Jᵢv⁻| / (‖Aᵢ‖ |u|).
    bitwise_scaling : powers of two in row scale must change no bit.
    least : no tolerance is smaller: the accuracy, relative to |u|, of a solver that iterates or goes through J M⁻¹ Jᵀ.
    """

    factor: float
    power: float
    ceiling: float
    restitution: float
    bitwise_scaling: bool
    least: float = 0.0

    def energy_gain(self, case: ImpactCase) -> float:
        """Largest relative gain (KE⁺ − KE⁻)/KE⁻ that rounding excuses."""
        return max(self.least, min(self.ceiling, self.factor * case.coordinates * EPS * case.condition**self.power))

    def comparison(self, case: ImpactCase) -> float:
        """Largest distance, relative to |u|, of two velocities that ought to be equal.

        Whitening loses ε κ(M) (Cholesky's backward error); a direction of singular value σ carries ε √κ(M) / σ. Rows
        dependent but for a noise below 1e-13 span directions that differ by the noise over σ, twice with 1 + e = 2.
        """
        root = np.sqrt(case.condition)
        rounding = 100.0 * case.coordinates * EPS * float(root * (root + 1.0 / case.smallest_motion))
        noise = 4.0 * float(np.sqrt(max(case.contacts, 1))) * case.largest_noise / case.smallest_motion
        return max(self.least, rounding + noise)


# Any sound resolver written with plain numpy (Cholesky, then an SVD of unit rows) keeps these.
KIT = Bounds(factor=100.0, power=1.0, ceiling=1e-7, restitution=1e-8, bitwise_scaling=False)
# What `factored` with its clamp promises (docstring of resolve_impact), on any κ(M) that Cholesky accepts.
FACTORED = Bounds(factor=10.0, power=0.5, ceiling=np.inf, restitution=1e-8, bitwise_scaling=True)
# One-sided contacts: a textbook solver of the complementarity problem keeps these, by pivoting or by sweeps.
ONE_SIDED = Bounds(factor=100.0, power=1.0, ceiling=1e-7, restitution=1e-7, bitwise_scaling=False, least=1e-7)

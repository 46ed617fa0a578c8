"""Residuals of the laws, their tolerances, each with its reason, and the tables that hold the
laws."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeVar

import numpy as np

from verification.impacts import EPS, ImpactCase

CEILING_UP_TO = 1e8  # κ(M) of the kit's own draws
Measure = TypeVar("Measure", bound=Callable[..., Any])
# value of a residual and its tolerance; None if the law does not apply
Found = tuple[float, float] | None


@dataclass(frozen=True)
class LawResidual:
    """Residual of one law; it passes if value <= tolerance (a value that is not finite never
    passes)."""

    law: str
    value: float
    tolerance: float

    @property
    def ratio(self) -> float:
        """value / tolerance; infinite if the value is not finite."""
        if self.tolerance > 0.0 and math.isfinite(self.value):
            return self.value / self.tolerance
        return 0.0 if self.value <= 0.0 and math.isfinite(self.value) else np.inf

    @property
    def rank(self) -> tuple[float, float]:
        """What makes it worse than others: its ratio, then its value."""
        return self.ratio, self.value

    @property
    def words(self) -> str:
        """The value and its tolerance."""
        return f"error {self.value:.1e}, limit {self.tolerance:.1e}"

    @property
    def passed(self) -> bool:
        """Whether the law holds within its tolerance."""
        return self.ratio <= 1.0


@dataclass
class LawCount:
    """Counts of one law over some cases, updated case by case; `worst` has the largest value /
    tolerance."""

    law: str
    checked: int = 0
    failures: int = 0
    worst: LawResidual | None = None

    def add(self, residual: LawResidual) -> bool:
        """Count one case; return whether the law holds in it."""
        self.checked += 1
        self.failures += not residual.passed
        if self.worst is None or residual.rank > self.worst.rank:
            self.worst = residual
        return residual.passed

    def __add__(self, other: LawCount) -> LawCount:
        """Return the counts of two sets of cases of one law."""
        residuals = [count.worst for count in (self, other) if count.worst is not None]
        worst = max(residuals, key=lambda residual: residual.rank, default=None)
        return LawCount(
            self.law, self.checked + other.checked, self.failures + other.failures, worst
        )


class Law(NamedTuple):
    """A law: its statement in words and its check, which returns None if the law does not apply.

    The check of a law of impacts takes (ImpactCase, resolver, Bounds), that of a trajectory a
    `Trajectory`, and that of the engine a case that `draw` makes with a random generator and a
    subject, by default `ours`.
    """

    statement: str
    check: Callable[..., Any]
    draw: Any = None
    ours: Any = None


def law(
    table: dict[str, Law], name: str, statement: str, draw: Any = None, ours: Any = None
) -> Callable[[Measure], Measure]:
    """Add the decorated function to a table of laws; it returns a value and its tolerance, or
    None."""

    def added(measure: Measure) -> Measure:
        def check(*given: Any) -> LawResidual | None:
            found = measure(*given)
            return None if found is None else LawResidual(name, *found)

        table[name] = Law(statement, check, draw, ours)
        return measure

    return added


@dataclass(frozen=True)
class Bounds:
    """Tolerances for a resolver.

    Attributes
    ----------
    factor, power, ceiling : relative energy gain at most factor · d · ε · κ(M)^power, and at most
        `ceiling`, times κ(M) / 1e8 above 1e8.
    restitution : largest |Jᵢv⁺ + e Jᵢv⁻| / (‖Aᵢ‖ |u|) of rows that a resolver may drop because
        others nearly determine them, and of unilateral contacts; for independent rows the limit
        follows from M, J and v.
    bitwise_scaling : True if scaling rows by powers of two must change no bit.
    least : lower limit of the tolerances: the accuracy, relative to |u|, of a solver that iterates
        or uses J M⁻¹ Jᵀ.
    """

    factor: float
    power: float
    ceiling: float
    restitution: float
    bitwise_scaling: bool
    least: float = 0.0

    def energy_gain(self, case: ImpactCase) -> float:
        """Largest allowed relative gain (KE⁺ − KE⁻)/KE⁻, which rounding can cause."""
        ceiling = self.ceiling * max(1.0, case.condition / CEILING_UP_TO)
        return max(
            self.least,
            min(ceiling, self.factor * case.coordinates * EPS * case.condition**self.power),
        )

    def comparison(self, case: ImpactCase) -> float:
        """Largest allowed distance, relative to |u|, between two velocities that are equal in exact
        arithmetic.

        Whitening causes an error ε κ(M) (Cholesky's backward error); a direction of singular value
        σ has an error ε √κ(M) / σ. Rows that are dependent up to a noise below 1e-13 span
        directions that differ by noise / σ; the factor 1 + e = 2 doubles this. A resolver may use
        any r independent rows of c: of the best r rows, the smallest σ is only known to be σ_min /
        √(1 + r (c − r)) or more (Gu and Eisenstat 1996, with f = 1). One that takes others (say the
        fastest) has a smaller σ, limited by its rank decision: the tolerance is `restitution` or
        more.
        """
        root = np.sqrt(case.condition)
        rank = len(case.row_space)
        smallest = case.smallest_motion / np.sqrt(1.0 + rank * (case.contacts - rank))
        rounding = 100.0 * case.coordinates * EPS * float(root * (root + 1.0 / smallest))
        noise = 4.0 * float(np.sqrt(max(case.contacts, 1)) * case.largest_noise / smallest)
        return max(self.least, self.restitution if rank < case.contacts else 0.0, rounding + noise)


# Any correct resolver in plain numpy (Cholesky, then an SVD of unit rows) keeps these.
KIT = Bounds(factor=100.0, power=1.0, ceiling=1e-7, restitution=1e-8, bitwise_scaling=False)
# The guarantees of `factored` with its clamp (docstring of resolve_impact), for any κ(M) that
# Cholesky accepts.
FACTORED = Bounds(factor=10.0, power=0.5, ceiling=np.inf, restitution=1e-8, bitwise_scaling=True)
# Unilateral contacts: a textbook solver of the complementarity problem, by pivoting or by sweeps,
# keeps these.
ONE_SIDED = Bounds(
    factor=100.0, power=1.0, ceiling=1e-7, restitution=1e-7, bitwise_scaling=False, least=1e-7
)

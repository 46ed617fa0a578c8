"""One impact to be judged, what is known about it, and the record a law returns."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.errors import IapbError

Floats = NDArray[np.floating[Any]]
Resolver = Callable[[Floats, Floats, Floats, Any], Any]

# Singular values of the unit-scaled rows of A in this gap are neither clearly rounding nor clearly motion: a sound
# resolver may take them for either, so laws that compare velocities do not judge such impacts.
ROUNDING_BELOW, MOTION_ABOVE = 1e-13, 1e-5
RANK_CUT = 1e-9  # anywhere in the gap


class ResolverFault(IapbError):
    """A resolver raised, or returned no finite velocity of the right shape."""


@dataclass(frozen=True)
class LawResidual:
    """How far an impact is from keeping a law; passes while value <= tolerance (an unknown value never does)."""

    law: str
    value: float
    tolerance: float

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


@dataclass(frozen=True)
class ImpactCase:
    """M (d, d), J (c, d), v (d,) and scalar e; `translations` (k, d) are motions z with J z = 0 exactly.

    `unequal` (c,), each in [0, 1], takes the place of e where it is given.
    """

    mass_matrix: Floats
    contact_jacobian: Floats
    velocity: Floats
    restitution: float
    family: str = ""
    translations: Floats | None = field(default=None)
    unequal: Floats | None = field(default=None)

    @property
    def coordinates(self) -> int:
        """d."""
        return len(self.velocity)

    @property
    def contacts(self) -> int:
        """c."""
        return len(self.contact_jacobian)

    def given_restitution(self) -> Any:
        """What a resolver gets: the scalar e, or a copy of the unequal ones."""
        return self.restitution if self.unequal is None else self.unequal.copy()

    @cached_property
    def condition(self) -> float:
        """κ(M)."""
        values = np.linalg.eigvalsh(self.mass_matrix)
        return float(values[-1] / values[0]) if values[0] > 0.0 else np.inf

    @cached_property
    def lower(self) -> Floats:
        """L with M = L Lᵀ."""
        return np.linalg.cholesky(self.mass_matrix)

    @cached_property
    def rows(self) -> Floats:
        """A = J L⁻ᵀ (c, d)."""
        return np.linalg.solve(self.lower, self.contact_jacobian.T).T

    @cached_property
    def unit_rows(self) -> Floats:
        """Rows of A scaled to unit length; zero rows stay."""
        length = np.linalg.norm(self.rows, axis=1, keepdims=True)
        return np.divide(self.rows, length, out=np.zeros_like(self.rows), where=length > 0.0)

    @cached_property
    def _svd(self) -> tuple[Floats, Floats]:
        _, values, right = np.linalg.svd(self.unit_rows, full_matrices=False)
        return values, right

    @cached_property
    def is_separated(self) -> bool:
        """No singular value of the unit rows lies between rounding and motion: the rank is beyond doubt."""
        values = self._svd[0]
        return not np.any((values > ROUNDING_BELOW) & (values < MOTION_ABOVE))

    @cached_property
    def row_space(self) -> Floats:
        """Orthonormal basis (rank, d) of the row space of A."""
        values, right = self._svd
        return right[values > RANK_CUT]

    @cached_property
    def smallest_motion(self) -> float:
        """Smallest singular value of the unit rows that counts as motion; 1 without rows."""
        values = self._svd[0]
        return float(np.min(values[values > RANK_CUT], initial=1.0))

    @cached_property
    def largest_noise(self) -> float:
        """Largest singular value of the unit rows that counts as rounding; 0 where there is none."""
        values = self._svd[0]
        return float(np.max(values[values <= ROUNDING_BELOW], initial=0.0))

    @cached_property
    def speed(self) -> float:
        """|u| = √(vᵀMv)."""
        return float(np.linalg.norm(self.lower.T @ self.velocity))

    def distance(self, one: Floats, other: Floats) -> float:
        """Distance of two velocities in the kinetic metric, relative to |u|."""
        length = float(np.linalg.norm(self.lower.T @ (one - other)))
        return length / self.speed if self.speed > 0.0 else (0.0 if length == 0.0 else np.inf)

    @cached_property
    def _answers(self) -> dict[int, tuple[Resolver, Answer]]:
        """What resolvers gave for this very case, by their identity; kept with them, so that it stays theirs."""
        return {}


@dataclass(frozen=True)
class Answer:
    """One call: v⁺ (d,), or why there is none, and how many of its arguments the call has changed."""

    velocity: Floats | ResolverFault
    changed: int


def own_answer(resolver: Resolver, case: ImpactCase) -> Answer:
    """Return what the resolver gives for the case itself; all laws of a case share the one call."""
    known = case._answers.get(id(resolver))
    if known is None:
        own = (case.mass_matrix, case.contact_jacobian, case.velocity, case.given_restitution())
        given = tuple(np.copy(argument) if isinstance(argument, np.ndarray) else argument for argument in own)
        velocity = _velocity(resolver, given, case)
        changed = sum(not np.array_equal(one, other) for one, other in zip(own, given, strict=True))
        known = case._answers[id(resolver)] = resolver, Answer(velocity, changed)
    return known[1]


def own_outcome(resolver: Resolver, case: ImpactCase) -> Floats:
    """Return v⁺ (d,) of the case itself, from the call that all its laws share."""
    velocity = own_answer(resolver, case).velocity
    if isinstance(velocity, ResolverFault):
        raise velocity
    return velocity


def outcome(resolver: Resolver, case: ImpactCase) -> Floats:
    """Return v⁺ (d,) of a call of its own, on copies of the case's arrays, checked for shape and finiteness."""
    given = case.mass_matrix.copy(), case.contact_jacobian.copy(), case.velocity.copy(), case.given_restitution()
    velocity = _velocity(resolver, given, case)
    if isinstance(velocity, ResolverFault):
        raise velocity
    return velocity


def _velocity(resolver: Resolver, given: tuple[Any, ...], case: ImpactCase) -> Floats | ResolverFault:
    """Return v⁺, copied, or what is wrong with it; raise ResolverFault where the resolver raises."""
    try:
        answer = resolver(*given)
    except Exception as error:  # anybody's resolver: whatever it raises is the finding
        raise ResolverFault(f"raised {type(error).__name__}: {error}") from error
    velocity = np.asarray(getattr(answer, "velocity", answer))
    if velocity.dtype.kind != "f" or velocity.shape != case.velocity.shape:
        return ResolverFault(f"returned {velocity.dtype} of shape {velocity.shape}, not float {case.velocity.shape}")
    if not np.all(np.isfinite(velocity)):
        return ResolverFault("returned a velocity that is not finite")
    return velocity.astype(np.float64)

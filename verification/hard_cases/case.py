"""Hard cases: what a resolver or a world is given, and what is meant exactly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from iapb.errors import IapbError
from iapb.run import Run
from iapb.scene import Scene
from verification.hard_cases.poisson import exact_poisson

Floats = NDArray[np.floating[Any]]
Exact = NDArray[np.object_] | Floats
EPS = float(np.finfo(float).eps)


class CaseAbsent(IapbError):
    """A case whose files are not at hand; the message says which."""


@dataclass(frozen=True)
class Truth:
    """The exact outcome: v⁺ (d fractions), rank, κ(M) and κ(A) of what is meant."""

    velocity: tuple[Fraction, ...]
    rank: int
    condition: float
    row_condition: float


@dataclass(frozen=True)
class HardCase:
    """One named impact.

    Attributes
    ----------
    name, source, why_hard, expected : for the report; `expected` says what a sound method does with it.
    mass_matrix, contact_jacobian, velocity : as the resolver is given them (doubles).
    restitution : scalar, or one e per contact (Poisson's law).
    exact_jacobian : (c, d) of fractions where the doubles are only rounded geometry; None = the doubles are meant.
    well_posed : False where the exact answer hangs on digits that doubles do not have: the motion is not judged.
    methods : names to try; None = all of them.
    """

    name: str
    source: str
    why_hard: str
    expected: str
    mass_matrix: Floats
    contact_jacobian: Floats
    velocity: Floats
    restitution: float | Floats
    exact_jacobian: Exact | None = field(default=None)
    well_posed: bool = True
    methods: tuple[str, ...] | None = None
    law: ClassVar[str] = "(21), or Poisson's law where restitution differs, in exact rational arithmetic"

    @property
    def meant_jacobian(self) -> Exact:
        """J as it is meant, in fractions or doubles."""
        return self.contact_jacobian if self.exact_jacobian is None else self.exact_jacobian

    @cached_property
    def truth(self) -> Truth:
        """Exact v⁺ of (21), or of Poisson's law where restitution differs, by rational arithmetic."""
        from reference.exact import condition_number, exact_impact, row_condition_number

        mass, rows = self.mass_matrix, self.meant_jacobian
        conditions = condition_number(mass), row_condition_number(mass, rows)
        if np.ndim(self.restitution):
            velocity, pushing = exact_poisson(mass, rows, self.velocity, np.asarray(self.restitution))
            return Truth(velocity, pushing, *conditions)
        impact = exact_impact(mass, rows, self.velocity, float(self.restitution))
        return Truth(impact.velocity, impact.rank, *conditions)


@dataclass(frozen=True)
class Measured:
    """What a trajectory case asks of a run.

    Attributes
    ----------
    energy_gain, energy_bound : see `verification.hard_cases.energy.largest_gain`.
    error, error_bound : distance from the law, and what the world's own step and stiffness excuse; a bound of NaN
        shows the distance and does not judge it.
    """

    energy_gain: float
    energy_bound: float
    error: float
    error_bound: float


@dataclass(frozen=True)
class TrajectoryCase:
    """One named motion.

    Attributes
    ----------
    name, source, why_hard, expected : for the report.
    law : what the truth is, and why it is certain.
    scene : the scene to simulate.
    measure : judges a run of it.
    worlds : names that `verification.hard_cases.worlds.run_in_world` knows.
    """

    name: str
    source: str
    why_hard: str
    expected: str
    law: str
    scene: Scene
    measure: Callable[[Run], Measured]
    worlds: tuple[str, ...] = ("IAPB", "PB", "ideal")


AnyCase = HardCase | TrajectoryCase

"""Hard cases: what a resolver or a world is given, what is meant exactly, and what a verdict holds."""

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
from reference.exact import condition_number, exact_impact, row_condition_number
from verification.hard_cases.exact import FrictionalImpact, exact_poisson

Floats = NDArray[np.floating[Any]]
Exact = NDArray[np.object_] | Floats
EPS = float(np.finfo(float).eps)

NEWTON_COULOMB = "Newton with Coulomb"  # friction at an impact as Kane and Levinson found it
COULOMB = "ideal with friction"  # the rigid world with Coulomb's law; the paper's rigid worlds have no friction
RESTITUTION_TOLERANCE = 1e-8  # as the kit asks of anybody's resolver
NO_GAIN = 1e-12  # rounding of the ledger's sums over the run's steps
DEPENDS_ON_ROUNDING = "depends on rounding"
_NONE = float("nan")


class CaseAbsent(IapbError):
    """A case whose files are not at hand; the message says which."""


@dataclass(frozen=True)
class Truth:
    """The exact outcome: v⁺ (d fractions), rank, κ(M), κ of M scaled to a unit diagonal, κ(A) of what is meant."""

    velocity: tuple[Fraction, ...]
    rank: int
    condition: float
    scaled_condition: float
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

    @property
    def all_rows(self) -> Exact:
        """Every row that takes an impulse, tangents included: the answer is as sensitive as all of them together."""
        return self.meant_jacobian

    @cached_property
    def truth(self) -> Truth:
        """Exact v⁺ of the case's law, with the condition numbers that bound what doubles can know of it."""
        velocity, rank = self.exact_outcome()
        scale = 1.0 / np.sqrt(np.diag(self.mass_matrix))
        scaled = condition_number(scale[:, None] * self.mass_matrix * scale)
        rows = row_condition_number(self.mass_matrix, self.all_rows)
        return Truth(velocity, rank, condition_number(self.mass_matrix), scaled, rows)

    def exact_outcome(self) -> tuple[tuple[Fraction, ...], int]:
        """v⁺ of (21), or of Poisson's law where restitution differs; and the rank, or how many contacts push."""
        mass, rows = self.mass_matrix, self.meant_jacobian
        if np.ndim(self.restitution):
            return exact_poisson(mass, rows, self.velocity, np.asarray(self.restitution))
        impact = exact_impact(mass, rows, self.velocity, float(self.restitution))
        return impact.velocity, impact.rank


@dataclass(frozen=True)
class FrictionalCase(HardCase):
    """One contact with its tangent row (1, d) and coefficient μ."""

    tangent: Floats = field(kw_only=True)
    friction: float = field(kw_only=True)
    law = "Newton's law with Coulomb friction, reduced to no gain: rational arithmetic, the root by ball arithmetic"

    @property
    def all_rows(self) -> Exact:
        """Normal and tangent."""
        return np.vstack([self.contact_jacobian, self.tangent])

    @property
    def impact(self) -> FrictionalImpact:
        """The impact in fractions."""
        return FrictionalImpact(self.mass_matrix, self.contact_jacobian, self.tangent, self.velocity,
                                float(self.restitution), self.friction)  # fmt: skip

    def exact_outcome(self) -> tuple[tuple[Fraction, ...], int]:
        """v⁺ up to the certified root."""
        impact = self.impact
        return impact.velocity(impact.passive_share()), 1

    def newton_with_coulomb(self) -> tuple[Fraction, ...]:
        """v⁺ without the reduction: what Kane and Levinson's equations say."""
        return self.impact.velocity(Fraction(1))


@dataclass(frozen=True)
class Measured:
    """What a trajectory case asks of a run.

    Attributes
    ----------
    energy_gain, energy_bound : see `largest_gain`.
    error, error_bound : distance from the law as a share of the answer, and what the world's own step excuses.
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
    worlds : names that `verification.hard_cases.judge.run_in_world` knows.
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


def largest_gain(run: Run) -> float:
    """Return the most that tool and device ever held beyond what they had and what the hand gave, relative.

    Kinetic energy of tool and device and the tool's potential energy, less the hand's work on both; relative to the
    most energy that was there or was given. Springs of walls and coupling hold some of it, never less than none:
    what is found here above zero was made from nothing.
    """
    ledger = run.energy
    works = [ledger[name] for name in ("hand_work", "device_hand_work") if name in ledger]  # by the end of each step
    kinetic = sum((ledger[name] for name in ("kinetic", "device_kinetic") if name in ledger), np.zeros(run.steps + 1))
    given = sum((np.concatenate([[0.0], work]) for work in works), np.zeros(run.steps + 1))
    gain = kinetic - kinetic[0] + ledger["potential"] - ledger["potential"][0] - given
    dropped = float(ledger["potential"][0] - ledger["potential"].min())
    fed = float(kinetic[0] + np.abs(given).max()) + dropped
    return float(gain.max()) / max(fed, float(np.finfo(float).tiny))


@dataclass(frozen=True)
class HardCaseVerdict:
    """One method or world on one case; NaN where a quantity does not apply or was not delivered.

    Attributes
    ----------
    verdict : "stable", "gains energy", "restitution unmet", "wrong motion", "refused", "timed out", "out of memory",
        "failed", or DEPENDS_ON_ROUNDING: a method that goes through LAPACK leaves a residual within a factor of ten of
        the tolerance, or moves wrong by more than half of |v⁻|: another BLAS would change what is wrong first.
    note : the error's words where there is no answer.
    energy_gain : impacts (KE⁺ − KE⁻)/KE⁻ exactly, trajectories the largest gain at any instant, as a share of what
        the motion started with or was fed.  energy_bound : what rounding (10 d ε √κ(M)) or the step excuses.
    restitution_residual : max |Jᵢv⁺ + e Jᵢv⁻| / (‖Aᵢ‖ |u|); Poisson's law: the fastest approach left,
        likewise; trajectories: see `judge.restitution_residual`.
    forward_error : |v⁺ − truth| / |v⁻| in the kinetic metric, or the case's own distance from its law.
    forward_bound : what the conditioning, or the law's own step, excuses.
    smallest_fault : of a stable verdict, the smallest relative fault planted in the answer that turns it.
    rank, exact_rank : as used, and of the meant Jacobian; trajectories: the largest rank of an impact, and None.
    clamp : factor of the energy clamp.
    seconds : median time of one call, or of one step [s].
    """

    case: str
    method: str
    verdict: str
    note: str = ""
    energy_gain: float = _NONE
    energy_bound: float = _NONE
    restitution_residual: float = _NONE
    forward_error: float = _NONE
    forward_bound: float = _NONE
    rank: int = 0
    exact_rank: int | None = 0
    clamp: float = _NONE
    seconds: float = _NONE
    smallest_fault: float = _NONE

    @property
    def is_stable(self) -> bool:
        """Whether every number is within its bound."""
        return self.verdict == "stable"


def smallest_fault(turns: Callable[[float], bool]) -> float:
    """Return the smallest relative fault, in steps of a third of a decade, that turns a verdict with either sign."""
    sizes = 10.0 ** (np.arange(-54, 1) / 3.0)
    return next((float(f) for f in sizes if turns(float(f)) and turns(-float(f))), float("inf"))

"""Hard cases: the input of a resolver or a world, the exact truth, and the verdict."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.run import Run
from iapb.scene import Scene, scene_from_text
from reference.exact import condition_number, exact_impact, row_condition_number
from verification.data import data_of
from verification.hard_cases.exact_outcomes import FrictionalImpact, exact_poisson
from verification.impacts import Floats
from verification.scenes.books import risen, work_given

Exact = NDArray[np.object_] | Floats

NEWTON_COULOMB = (
    "Newton with Coulomb"  # Newton's law with Coulomb friction, as in Kane and Levinson
)
RESTITUTION_TOLERANCE = 1e-8  # the tolerance of the kit for all resolvers
NO_GAIN = 1e-12  # rounding of the sums of energies over the run's steps
STABLE = "stable"
DEPENDS_ON_ROUNDING = "depends on rounding"
NOT_TRIED = "not tried"


@dataclass(frozen=True)
class Truth:
    """The exact outcome: v⁺ (d fractions), rank, κ(M), κ of M scaled to a unit diagonal, κ(A) of
    the exact rows."""

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
    name, source, why_hard, expected : texts for the report; `expected` is the outcome of a correct
        method.
    mass_matrix, contact_jacobian, velocity : arguments of the resolver, in doubles.
    restitution : scalar, or one e per contact (Poisson's law).
    exact_jacobian : (c, d) fractions if the doubles are rounded geometry; None if the doubles are
        exact.
    well_posed : False if the exact answer depends on digits that doubles do not have; then v⁺ is
        not judged.
    methods : names of the methods to judge; None for all methods.
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
    law: ClassVar[str] = (
        "the velocity by equation (21), in exact fractions; if e differs between contacts, the "
        "velocity by Poisson's law (impulse of the rebound = e times the impulse of the "
        "compression)"
    )

    @property
    def meant_jacobian(self) -> Exact:
        """The exact J, in fractions or doubles."""
        return self.contact_jacobian if self.exact_jacobian is None else self.exact_jacobian

    @property
    def all_rows(self) -> Exact:
        """All rows that carry an impulse, tangents included; their condition number bounds the
        error of v⁺."""
        return self.meant_jacobian

    @cached_property
    def truth(self) -> Truth:
        """Exact v⁺ of the case's law, with the condition numbers that bound the error of v⁺ in
        doubles."""
        velocity, rank = self.exact_outcome()
        scale = 1.0 / np.sqrt(np.diag(self.mass_matrix))
        scaled = condition_number(scale[:, None] * self.mass_matrix * scale)
        rows = row_condition_number(self.mass_matrix, self.all_rows)
        return Truth(velocity, rank, condition_number(self.mass_matrix), scaled, rows)

    def exact_outcome(self) -> tuple[tuple[Fraction, ...], int]:
        """Return v⁺ and rank by (21); for one e per contact, v⁺ and the number of pushing contacts
        by Poisson's law."""
        mass = self.mass_matrix
        rows = self.meant_jacobian
        if np.ndim(self.restitution):
            return exact_poisson(mass, rows, self.velocity, np.asarray(self.restitution))
        impact = exact_impact(mass, rows, self.velocity, float(self.restitution))
        return impact.velocity, impact.rank


@dataclass(frozen=True)
class FrictionalCase(HardCase):
    """An impact at one contact with its tangent row (1, d) and coefficient of friction μ."""

    tangent: Floats = field(kw_only=True)
    friction: float = field(kw_only=True)
    law = (
        "Newton's restitution law with Coulomb friction, in exact fractions; a square root has 400 bits. "
        "If these laws gain "
        "energy, the friction impulse is scaled down until the gain is zero"
    )

    @property
    def all_rows(self) -> Exact:
        """The normal row and the tangent row."""
        return np.vstack([self.contact_jacobian, self.tangent])

    @property
    def impact(self) -> FrictionalImpact:
        """The impact in rational arithmetic."""
        return FrictionalImpact(
            self.mass_matrix,
            self.contact_jacobian,
            self.tangent,
            self.velocity,
            float(self.restitution),
            self.friction,
        )

    def exact_outcome(self) -> tuple[tuple[Fraction, ...], int]:
        """Return v⁺, exact except for the root, and the rank 1."""
        impact = self.impact
        return impact.velocity(impact.passive_share()), 1


class Measured(NamedTuple):
    """The quantities of a run that a trajectory case measures.

    Attributes
    ----------
    error : relative distance of the run from the law; error_allowed : what the time step may cause
    gain : of energy, relative; None: `largest_gain` of the run
    """

    error: float
    error_allowed: float
    gain: float | None = None
    gain_allowed: float = NO_GAIN


@dataclass(frozen=True)
class TrajectoryCase:
    """One named motion.

    Attributes
    ----------
    name, source, why_hard, expected : texts for the report.
    law : the exact law of the motion, in words.
    scene : the scene to simulate.
    measure : function that measures a run of the scene.
    worlds : names of worlds.
    """

    name: str
    source: str
    why_hard: str
    expected: str
    law: str
    scene: Scene
    measure: Callable[[Run], Measured]
    worlds: tuple[str, ...]


AnyCase = HardCase | TrajectoryCase


def written(file: str) -> dict[str, dict[str, Any]]:
    """Return the impacts, motions or scenes of a file beside this module, by name."""
    found: dict[str, dict[str, Any]] = data_of(__file__, file)
    return found


def scene_named(name: str) -> Scene:
    """Return a scene of scenes.yaml."""
    return scene_from_text(json.dumps(written("scenes.yaml")[name]))


def largest_gain(run: Run) -> float:
    """Return the largest relative energy gain of a run.

    The gain is the change of the kinetic energy of tool and device and of the tool's potential
    energy, minus the hand's work on both. It is divided by the initial kinetic energy plus the
    largest work of the hand plus the largest drop of potential energy. The springs of walls and
    coupling also store energy, and this energy is never negative. Therefore a positive gain is
    energy that the simulation has created.
    """
    potential = run.energy["potential"]
    given = work_given(run, device=True)
    dropped = float(potential[0] - potential.min())
    kinetic = run.energy["kinetic"][0] + run.energy.get("device_kinetic", [0.0])[0]
    fed = float(kinetic + np.abs(given).max()) + dropped
    gain = float(risen(run, device=True).max())
    return gain / max(fed, float(np.finfo(float).tiny))


def smallest_fault(turns: Callable[[float], bool]) -> float:
    """Return the smallest relative fault that changes a verdict with either sign; it tries three
    faults per decade."""
    sizes = 10.0 ** (np.arange(-54, 1) / 3.0)
    return next((float(f) for f in sizes if turns(float(f)) and turns(-float(f))), float("inf"))

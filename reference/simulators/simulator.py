"""The base class of adapters to engines, and the settings of an engine.

For engines without a coefficient e, a spring and damper give the wanted restitution. Per unit of effective mass,
x'' = −k x − b x' while the force pushes; contact ends when the force is zero (Schwager and Pöschel, Granular Matter 9,
2007).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from importlib.metadata import version
from math import atan2, exp, log, pi, sqrt
from typing import Any

from iapb.errors import ArgumentError, MissingDependencyError, installing
from reference.simulators.scene import FixedScene
from reference.simulators.trajectory import Trajectory

LOWEST = 0.14  # e of a nearly critically damped spring; below it there is no half period


@dataclass(frozen=True)
class Settings:
    """Settings of an engine for a scene."""

    step: float  #: the longest step [s]; an integrator with error control may take shorter ones
    options: Mapping[str, str | float] = field(default_factory=dict)  #: other settings, by the engine's own names
    note: str = ""  #: what the engine cannot do, and what replaces it

    def __str__(self) -> str:
        """Return the settings on one line."""
        texts = (f"{name} {x if isinstance(x, str) else f'{x:.4g}'}" for name, x in self.options.items())
        return ", ".join([f"step {1e3 * self.step:g} ms", *texts])


class Simulator(ABC):
    """An adapter of an engine. It imports the engine only in `version` and `run`."""

    title: str
    module: str
    package: str

    def version(self) -> str:
        """Return the version of the installed engine.

        Raises
        ------
        MissingDependencyError
            The engine is not installed; the message says how to install it.
        """
        self.engine()
        return version(self.package)

    def engine(self) -> Any:
        """Import the engine; if it is missing, raise a MissingDependencyError, which says how to install it."""
        try:
            return import_module(self.module)
        except ImportError as error:
            purpose = f"The adapter of {self.package}"
            raise MissingDependencyError(self.package, purpose, installing("reference")) from error

    @abstractmethod
    def settings(self, scene: FixedScene, step: float | None = None) -> Settings:
        """Return the engine's best settings for the scene; if `step` [s] is given, the best ones at this step."""

    @abstractmethod
    def run(self, scene: FixedScene, settings: Settings, step: float, duration: float) -> Trajectory:
        """Simulate the scene for a duration [s]."""


def spring_restitution(damping_ratio: float) -> float:
    """Return e of a spring and damper that do not pull; damping_ratio = b/(2 √k) in [0, 1)."""
    z = damping_ratio
    turning = sqrt(1.0 - z * z)
    return exp(-z / turning * (pi - atan2(2.0 * z * turning, 1.0 - 2.0 * z * z)))


def damping_for(restitution: float, stiffness: float) -> float:
    """Return b [1/s] for e in [LOWEST, 1] and k [1/s2] per unit of mass, by bisection."""
    if restitution < LOWEST:
        raise ArgumentError("restitution", restitution, f"at least {LOWEST}: else the damped spring does not bounce")
    if restitution >= 1.0:
        return 0.0
    low, high = 0.0, 0.999
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if spring_restitution(middle) > restitution else (low, middle)
    return 2.0 * low * sqrt(stiffness)


def viscous_dissipation_for(restitution: float, speed: float) -> float:
    """Return d [s/m] of Hunt and Crossley's force k x (1 + d x') that gives restitution e at impact speed `speed`.

    The orbit in (x, x') gives d v (1 + e) = log((1 + d v) / (1 − e d v)).
    """
    if restitution >= 1.0:
        return 0.0
    low, high = 0.0, (1.0 - 1e-12) / restitution
    for _ in range(100):
        middle = 0.5 * (low + high)
        rest = middle * (1.0 + restitution) - log((1.0 + middle) / (1.0 - restitution * middle))
        low, high = (middle, high) if rest > 0.0 else (low, middle)
    return low / speed

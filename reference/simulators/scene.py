"""A scene that every engine can be given: rigid bodies of spheres and boxes, fixed boxes, gravity, one restitution.

Plain numbers only, SI units. Contacts are frictionless. Quaternions are x, y, z, w and turn body axes into world axes;
velocities are of the centre of mass, world axes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

ORIGIN: Vector = (0.0, 0.0, 0.0)
UPRIGHT: Quaternion = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Sphere:
    """A ball: radius [m] and centre in body axes [m]."""

    radius: float
    center: Vector = ORIGIN


@dataclass(frozen=True)
class Cuboid:
    """A box along the body axes: full side lengths [m] and centre in body axes [m]."""

    size: Vector
    center: Vector = ORIGIN


@dataclass(frozen=True)
class RigidBody:
    """A free body; its centre of mass is its origin, its axes are principal.

    mass [kg], inertia: three principal moments [kg m2], velocity [m/s] and spin [rad/s] in world axes
    """

    name: str
    mass: float
    inertia: Vector
    shapes: tuple[Sphere | Cuboid, ...]
    position: Vector
    orientation: Quaternion = UPRIGHT
    velocity: Vector = ORIGIN
    spin: Vector = ORIGIN


@dataclass(frozen=True)
class Obstacle:
    """A fixed box: full side lengths, centre [m] and turn."""

    name: str
    size: Vector
    center: Vector
    orientation: Quaternion = UPRIGHT


@dataclass(frozen=True)
class FixedScene:
    """One scene of the set, and what is known about its motion.

    law : what must hold, in words
    final_velocities : (bodies, 3) world axes, after the last impact; None for a scene that stays at rest
    length : size of the bodies [m], against which depths are read
    """

    name: str
    title: str
    law: str
    bodies: tuple[RigidBody, ...]
    obstacles: tuple[Obstacle, ...]
    restitution: float
    duration: float
    length: float
    gravity: Vector = ORIGIN
    final_velocities: tuple[Vector, ...] | None = None

    @property
    def rests(self) -> bool:
        """Whether the bodies must stay where they are."""
        return self.final_velocities is None

    @property
    def masses(self) -> Floats:
        """(bodies,) [kg]."""
        return np.array([body.mass for body in self.bodies])

    @property
    def fastest(self) -> float:
        """Largest speed at the start [m/s]."""
        return max(float(np.linalg.norm(body.velocity)) for body in self.bodies)


def rotation(quaternion: Any) -> Floats:
    """Rotations (..., 3, 3) of quaternions (..., 4), x, y, z, w, of any length but zero."""
    q = np.asarray(quaternion, np.float64)
    x, y, z, w = np.moveaxis(q / np.linalg.norm(q, axis=-1, keepdims=True), -1, 0)
    entries = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(entries), (0, 1), (-2, -1))

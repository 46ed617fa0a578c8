"""Trajectory: the recorded motion of a scene, in one form for all engines, and its largest overlap."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from reference.simulators.scene import Cuboid, FixedScene, Floats, Sphere, rotation

SAMPLE_INTERVAL = 1e-3  # [s] interval of kept states; longer steps are all kept
INSTANTS = 2000


@dataclass(frozen=True)
class Trajectory:
    """Sampled motion at n instants of b bodies, in world axes."""

    time: Floats  #: (n,) [s]
    position: Floats  #: (n, b, 3) [m]
    orientation: Floats  #: (n, b, 4) x, y, z, w
    velocity: Floats  #: (n, b, 3) [m/s]
    spin: Floats  #: (n, b, 3) [rad/s]

    @property
    def finite(self) -> bool:
        """Whether all numbers are finite."""
        return all(np.isfinite(part).all() for part in (self.position, self.orientation, self.velocity, self.spin))

    def kinetic_energy(self, scene: FixedScene) -> Floats:
        """Return the kinetic energy (n,) [J], ½ m v² and ½ I ω² in principal axes."""
        inertia = np.array([body.inertia for body in scene.bodies])
        local = np.einsum("nbji,nbj->nbi", rotation(self.orientation), self.spin)
        moving = 0.5 * np.einsum("b,nbi->n", scene.masses, self.velocity**2)
        return np.asarray(moving + 0.5 * np.einsum("bi,nbi->n", inertia, local**2))

    def potential_energy(self, scene: FixedScene) -> Floats:
        """Return the potential energy of gravity (n,) [J], which is zero at the world's origin."""
        return np.asarray(-np.einsum("b,nbi,i->n", scene.masses, self.position, np.array(scene.gravity)))


class Samples:
    """Collects the states in an adapter's loop."""

    def __init__(self) -> None:
        self._rows: list[tuple[Any, ...]] = []

    def add(self, time: float, position: ArrayLike, orientation: ArrayLike, velocity: ArrayLike, spin: ArrayLike
            ) -> None:
        """Keep copies of the arrays (b, 3), (b, 4), (b, 3), (b, 3) of one instant."""
        self._rows.append((time, *(np.array(part) for part in (position, orientation, velocity, spin))))

    def trajectory(self) -> Trajectory:
        """Return the trajectory of all kept instants."""
        return Trajectory(*(np.array(part) for part in zip(*self._rows, strict=True)))


def steps_between_samples(step: float) -> int:
    """Return the number of steps of this length [s] between two samples."""
    return max(1, round(SAMPLE_INTERVAL / step))


def deepest_overlap(scene: FixedScene, motion: Trajectory) -> float:
    """Return the largest overlap [m] of shapes at up to INSTANTS instants of the motion.

    This measure is the same for all engines and uses positions alone: for balls the distance, for boxes the smallest
    overlap along the normals of their faces (separating axes; edge axes are not needed for faces in contact).
    """
    every = max(1, len(motion.time) // INSTANTS)
    frames: list[tuple[Any, Floats, Floats]] = [
        (body.shapes, motion.position[::every, k], rotation(motion.orientation[::every, k]))
        for k, body in enumerate(scene.bodies)]  # fmt: skip
    frames += [(wall.shapes, np.array([wall.position]), rotation([wall.orientation])) for wall in scene.obstacles]
    pairs = [(one, other) for k, one in enumerate(frames[: len(scene.bodies)]) for other in frames[k + 1 :]]
    return max([0.0, *(float(_overlap(a, x_a, turn_a, b, x_b, turn_b).max()) for (shapes_a, x_a, turn_a),
                       (shapes_b, x_b, turn_b) in pairs for a in shapes_a for b in shapes_b)])  # fmt: skip


def _overlap(a: Sphere | Cuboid, x_a: Floats, turn_a: Floats, b: Sphere | Cuboid, x_b: Floats,
             turn_b: Floats) -> Floats:  # fmt: skip
    """Return the overlap (n,) of two shapes; it is negative or zero if they are apart."""
    apart = (x_b + turn_b @ np.array(b.center)) - (x_a + turn_a @ np.array(a.center))
    if isinstance(a, Sphere) and isinstance(b, Sphere):
        return np.asarray(a.radius + b.radius - np.linalg.norm(apart, axis=1))
    if isinstance(b, Sphere):
        a, turn_b, apart, b = b, turn_a, -apart, a
    half_b = 0.5 * np.array(b.size)  # type: ignore[union-attr]
    if isinstance(a, Sphere):  # exact while the ball's centre is outside
        reach = np.abs(np.einsum("nji,nj->ni", turn_b, -apart)) - half_b
        outside = np.linalg.norm(np.maximum(reach, 0.0), axis=1)
        return np.asarray(np.where(outside > 0.0, a.radius - outside, a.radius + np.min(-reach, axis=1)))
    depths, half_a = [], 0.5 * np.array(a.size)
    for axis in (axes[:, :, k] for axes in (turn_a, turn_b) for k in range(3)):
        reach = sum(np.abs(np.einsum("ni,nij->nj", axis, turn)) @ half
                    for turn, half in ((turn_a, half_a), (turn_b, half_b)))  # fmt: skip
        depths.append(reach - np.abs(np.einsum("ni,ni->n", axis, apart)))
    return np.asarray(np.min(depths, axis=0))

"""Trajectory: the recorded motion of a scene, in one form for all engines, and its largest overlap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reference.simulators.scene import Cuboid, FixedScene, Floats, Sphere, rotation

SAMPLE_INTERVAL = 1e-3  # [s] interval of kept states; longer steps are all kept


@dataclass(frozen=True)
class Trajectory:
    """Sampled motion at n instants of b bodies, in world axes.

    time (n,) [s]; position (n, b, 3) [m]; orientation (n, b, 4) x, y, z, w; velocity (n, b, 3) [m/s];
    spin (n, b, 3) [rad/s]; contacts (n,) number of touching points that the engine reports, −1 if it reports none
    """

    time: Floats
    position: Floats
    orientation: Floats
    velocity: Floats
    spin: Floats
    contacts: NDArray[np.int64]

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

    def momentum(self, scene: FixedScene) -> Floats:
        """Return the momentum (n, 3) [N s]."""
        return np.asarray(np.einsum("b,nbi->ni", scene.masses, self.velocity))


class Recorder:
    """Collects the states in an adapter's loop."""

    def __init__(self) -> None:
        self._rows: list[tuple[float, Floats, Floats, Floats, Floats, int]] = []

    def add(self, time: float, position: Floats, orientation: Floats, velocity: Floats, spin: Floats,
            contacts: int) -> None:  # fmt: skip
        """Keep copies of the arrays (b, 3), (b, 4), (b, 3), (b, 3) of one instant."""
        row = (time, np.array(position), np.array(orientation), np.array(velocity), np.array(spin), contacts)
        self._rows.append(row)

    def trajectory(self) -> Trajectory:
        """Return the trajectory of all kept instants."""
        time, position, orientation, velocity, spin, contacts = (np.array(part) for part in
                                                                 zip(*self._rows, strict=True))  # fmt: skip
        return Trajectory(time, position, orientation, velocity, spin, contacts)


def steps_between_samples(step: float) -> int:
    """Return the number of steps of this length [s] between two samples."""
    return max(1, round(SAMPLE_INTERVAL / step))


def deepest_overlap(scene: FixedScene, motion: Trajectory, instants: int = 2000) -> float:
    """Return the largest overlap [m] of shapes at up to so many instants of the motion.

    This measure is the same for all engines and uses positions alone: for balls the distance, for boxes the smallest
    overlap along the normals of their faces (separating axes; edge axes are not needed for faces in contact).
    """
    every = max(1, len(motion.time) // instants)
    frames = [(motion.position[::every, k], rotation(motion.orientation[::every, k]), body.shapes)
              for k, body in enumerate(scene.bodies)]  # fmt: skip
    count = len(motion.time[::every])
    for wall in scene.obstacles:
        turn = np.broadcast_to(rotation(wall.orientation), (count, 3, 3))
        frames.append((np.broadcast_to(np.array(wall.center), (count, 3)), turn, (Cuboid(wall.size),)))
    depth = 0.0
    for first in range(len(scene.bodies)):
        for second in range(first + 1, len(frames)):
            for a in frames[first][2]:
                for b in frames[second][2]:
                    depth = max(depth, float(_overlap(a, frames[first], b, frames[second]).max()))
    return depth


def _overlap(a: Sphere | Cuboid, frame_a: tuple, b: Sphere | Cuboid, frame_b: tuple) -> Floats:
    """Return the overlap (n,) of two shapes; it is negative or zero if they are apart."""
    apart = (frame_b[0] + frame_b[1] @ np.array(b.center)) - (frame_a[0] + frame_a[1] @ np.array(a.center))
    if isinstance(a, Sphere) and isinstance(b, Sphere):
        return np.asarray(a.radius + b.radius - np.linalg.norm(apart, axis=1))
    if isinstance(a, Sphere):
        return _sphere_in_box(a, b, -apart, frame_b[1])
    if isinstance(b, Sphere):
        return _sphere_in_box(b, a, apart, frame_a[1])
    half_a, half_b = 0.5 * np.array(a.size), 0.5 * np.array(b.size)
    depths = []
    for axes in (frame_a[1], frame_b[1]):
        for k in range(3):
            axis = axes[:, :, k]
            reach = sum(np.abs(np.einsum("ni,nij->nj", axis, turn)) @ half
                        for turn, half in ((frame_a[1], half_a), (frame_b[1], half_b)))  # fmt: skip
            depths.append(reach - np.abs(np.einsum("ni,ni->n", axis, apart)))
    return np.asarray(np.min(depths, axis=0))


def _sphere_in_box(ball: Sphere, box: Cuboid | Sphere, offset: Floats, turn: Floats) -> Floats:
    """Return the overlap (n,) of a ball at `offset` from a box's centre; exact while the ball's centre is outside."""
    half = 0.5 * np.array(box.size if isinstance(box, Cuboid) else (0.0,) * 3)
    local = np.einsum("nji,nj->ni", turn, offset)
    outside = np.linalg.norm(np.maximum(np.abs(local) - half, 0.0), axis=1)
    inside = np.min(half - np.abs(local), axis=1)
    return np.asarray(np.where(outside > 0.0, ball.radius - outside, ball.radius + inside))

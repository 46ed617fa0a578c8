"""The numbers of a trajectory, the same for every engine and computed from its positions and velocities alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from reference.simulators import FixedScene, Trajectory
from reference.simulators.trajectory import deepest_overlap


def measured(scene: FixedScene, motion: Trajectory) -> dict[str, Any]:
    """The measures of an `EngineRecord`; only a failure where a number is not finite."""
    if not motion.finite:
        first = int(np.argmin(np.isfinite(motion.velocity).all(axis=(1, 2))))
        return {"failure": f"not a number from {motion.time[first]:.4g} s on"}
    common = {"penetration": max(0.0, deepest_overlap(scene, motion)), "most_contacts": _most_contacts(motion),
              "energy_gain": _energy_gain(scene, motion)}  # fmt: skip
    return {**common, **(_rest(motion) if scene.rests else _impacts(scene, motion))}


def _most_contacts(motion: Trajectory) -> int | None:
    most = int(motion.contacts.max())
    return most if most >= 0 else None


def _energy_gain(scene: FixedScene, motion: Trajectory) -> float:
    kinetic = motion.kinetic_energy(scene)
    energy = kinetic + motion.potential_energy(scene)
    scale = kinetic[0]
    if scene.rests:
        scale = float(scene.masses.sum() * np.linalg.norm(scene.gravity) * scene.length)
    return float((energy.max() - energy[0]) / scale)


def _impacts(scene: FixedScene, motion: Trajectory) -> dict[str, float]:
    truth, masses = np.array(scene.final_velocities), scene.masses
    kinetic = motion.kinetic_energy(scene)
    true_energy = 0.5 * float(masses @ (truth**2).sum(axis=1))
    speeds = np.linalg.norm(motion.velocity[0], axis=1)
    off = motion.velocity[-1] - truth
    return {
        "energy_error": float((kinetic[-1] - true_energy) / kinetic[0]),
        "momentum_error": float(np.linalg.norm(masses @ off) / (masses @ speeds)),
        "velocity_error": float(np.linalg.norm(off, axis=1).max() / scene.fastest),
    }


def _rest(motion: Trajectory) -> dict[str, float]:
    halfway = motion.position[len(motion.position) // 2]
    return {"drift": _farthest(motion.position - motion.position[0]), "creep": _farthest(motion.position[-1] - halfway)}


def _farthest(moved: Any) -> float:
    return float(np.linalg.norm(moved, axis=-1).max())

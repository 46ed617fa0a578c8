"""A run to be judged from its arrays and its scene text alone, so that a stored run will do as well as a fresh one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.run import Run

Floats = NDArray[np.float64]

EPS = float(np.finfo(float).eps)
ENGINE_LAWS = ("impulse-augmented penalty", "penalty")


@dataclass(frozen=True)
class Trajectory:
    """A run, and what follows from its scene."""

    run: Run

    @property
    def by_the_engine(self) -> bool:
        """One of the engine's laws, one force per step: v moves first, then q by the new v."""
        run = self.run
        return run.law in ENGINE_LAWS and run.law_settings.get("integrator") == "semi_implicit_euler"

    @property
    def carries_itself(self) -> bool:
        """No unilateral coupler, which carries the tool from outside."""
        return self.run.coupling != "unilateral"

    @cached_property
    def system(self) -> Any:
        """Mechanism, gravity and step of the scene."""
        from iapb.scene import scene_from_text
        from iapb.system import System

        return System(scene_from_text(self.run.scene_source))

    @cached_property
    def masses(self) -> Floats:
        """M at the beginning of each step, (n, d, d); one of them for all steps where M is constant."""
        mechanism, q = self.system.mechanism, self.run.q[:-1]
        if mechanism.has_constant_mass_matrix:
            one = mechanism.mass_matrix(q[0])
            return np.asarray(np.broadcast_to(one, (len(q), *one.shape)))
        return np.asarray(mechanism.mass_matrices(q))

    @cached_property
    def v_struck(self) -> Floats:
        """Velocity (n, d) after the impulse of each step and before its forces."""
        v, impulse = self.run.v[:-1].copy(), self.run.impulse
        struck = np.flatnonzero(np.any(impulse, axis=1))
        if len(struck):
            v[struck] += np.linalg.solve(self.masses[struck], impulse[struck][:, :, None])[:, :, 0]
        return v

    @cached_property
    def bias_and_gravity(self) -> Floats:
        """B + G (n, d) of (1) at the beginning of each step, after the impulse."""
        system, q = self.system, self.run.q[:-1]
        out = np.zeros_like(self.v_struck)
        if system.mechanism.has_velocity_terms:
            out += system.mechanism.biases(q, self.v_struck)
        if np.any(system.gravity):
            out += np.array([system.mechanism.gravity(at, system.gravity) for at in q])
        return out

    @cached_property
    def forces(self) -> Floats:
        """All generalized forces (n, d) that the record knows of."""
        run = self.run
        return run.hand_force + run.coupling_force + run.penalty_force + run.friction_force

    @cached_property
    def displacements(self) -> Floats:
        """Displacement (n, d) of each step."""
        mechanism, q = self.system.mechanism, self.run.q
        if mechanism.nq == mechanism.nv:
            return np.asarray(np.diff(q, axis=0))
        return np.array([mechanism.difference(a, b) for a, b in zip(q[:-1], q[1:], strict=True)])


def norm(vector: Floats) -> Floats:
    """Largest magnitude along the last axis."""
    return np.asarray(np.max(np.abs(vector), axis=-1, initial=0.0))

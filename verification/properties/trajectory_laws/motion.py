"""(1): the recorded forces, and nothing else, move the bodies: M (v_{k+1} − v_k⁺)/Δt + B + G = Σ F."""

from __future__ import annotations

import numpy as np

from verification.properties.case import LawResidual
from verification.properties.trajectory_laws.trajectory import EPS, Trajectory, norm


def forces_explain_motion(trajectory: Trajectory) -> LawResidual | None:
    """Largest |M Δv − Δt (Σ F − B − G)|∞ over |M|(|v| + |v'|) + Δt Σ|F|, in units of d ε."""
    if not (trajectory.by_the_engine and trajectory.carries_itself):
        return None
    run, masses = trajectory.run, trajectory.masses
    changed = np.einsum("kij,kj->ki", masses, run.v[1:] - trajectory.v_struck)
    pushed = run.dt * (trajectory.forces - trajectory.bias_and_gravity)
    speed = np.abs(run.v[1:]) + np.abs(trajectory.v_struck) + np.abs(run.v[:-1])
    parts = (run.hand_force, run.coupling_force, run.penalty_force, run.friction_force, trajectory.bias_and_gravity)
    size = np.einsum("kij,kj->ki", np.abs(masses), speed) + run.dt * sum(np.abs(part) for part in parts)
    # One scale per step, not per coordinate: a force of one link rounds in the equations of the others.
    apart = norm(changed - pushed) / np.maximum(norm(size), np.finfo(float).tiny)
    return LawResidual("motion", float(np.max(apart)), 20.0 * run.v.shape[1] * EPS)

"""q moves by the new velocity, q_{k+1} = q_k ⊕ Δt v_{k+1}: integrated, never added where a rotation is no vector."""

from __future__ import annotations

import numpy as np

from verification.properties.case import LawResidual
from verification.properties.trajectory_laws.trajectory import EPS, Trajectory, norm


def velocity_moves_configuration(trajectory: Trajectory) -> LawResidual | None:
    """Largest |q_{k+1} − q_k ⊕ Δt v_{k+1}|∞ over |q| + Δt |v|."""
    if not (trajectory.by_the_engine and trajectory.carries_itself):
        return None
    run, mechanism = trajectory.run, trajectory.system.mechanism
    if mechanism.nq == mechanism.nv:
        moved = run.q[:-1] + run.dt * run.v[1:]
    else:
        moved = np.array([mechanism.integrate(q, v, run.dt) for q, v in zip(run.q[:-1], run.v[1:], strict=True)])
    size = 1.0 + norm(run.q[1:]) + run.dt * norm(run.v[1:])
    return LawResidual("kinematics", float(np.max(norm(moved - run.q[1:]) / size)), 16.0 * EPS)

"""(6): friction is at most μ F_n, lies in the plane of contact, and is not there where nothing pushes."""

from __future__ import annotations

import numpy as np

from verification.properties.case import LawResidual
from verification.properties.trajectory_laws.trajectory import EPS, Trajectory


def friction_stays_in_its_cone(trajectory: Trajectory) -> LawResidual | None:
    """Largest of |F_f| − μ F_n and |F_f · n|, over μ F_n; infinite where there is friction and no push.

    Taking v_n off the velocity rounds v_t by ε |v_n|, and (6) divides by v_threshold at least: allowed for.
    """
    run, contacts = trajectory.run, trajectory.run.contacts
    if not trajectory.by_the_engine or not len(contacts.gap):
        return None
    constants = run.scene_resolved["contact"]
    most = constants["friction"] * np.maximum(contacts.normal_force, 0.0)
    length = np.linalg.norm(contacts.friction_force, axis=1)
    along = np.abs(np.einsum("ni,ni->n", contacts.friction_force, contacts.normal))
    excess = np.maximum(length - most, along)
    rounding = 1.0 + np.abs(contacts.normal_velocity) / constants["friction_velocity"]
    relative = np.divide(excess, most * rounding, out=np.where(excess > 0.0, np.inf, 0.0), where=most > 0.0)
    return LawResidual("friction", float(np.max(relative)), 16.0 * EPS)

"""(5): a contact that rests pushes with −K s − B v_n, never pulls unless the scene says `printed`; else not at all."""

from __future__ import annotations

import numpy as np

from verification.properties.case import LawResidual
from verification.properties.trajectory_laws.trajectory import EPS, Trajectory


def contacts_push_by_the_penalty(trajectory: Trajectory) -> LawResidual | None:
    """Largest |F − (−K s − B v_n)| over its parts, of the contacts with a force; infinite for one that pulls."""
    run, contacts = trajectory.run, trajectory.run.contacts
    if not trajectory.by_the_engine or not len(contacts.gap):
        return None
    constants = run.scene_resolved["contact"]
    K, B = constants["stiffness"], constants["damping"]
    force = -K * contacts.gap - B * contacts.normal_velocity
    if constants["penalty"] == "clamped":
        force = np.maximum(force, 0.0)
        if np.any(contacts.normal_force < 0.0):
            return LawResidual("penalty", np.inf, 1.0)
    size = K * np.abs(contacts.gap) + B * np.abs(contacts.normal_velocity) + np.finfo(float).tiny
    apart = np.where(contacts.normal_force != 0.0, np.abs(contacts.normal_force - force) / size, 0.0)
    return LawResidual("penalty", float(np.max(apart)), 16.0 * EPS)

"""Resting contact (paper section IV): penalty forces (5) and modified Coulomb friction (6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from iapb.compiled import block
from iapb.contact.contacts import ContactSet, finite_vector, require_not_negative
from iapb.contact.geometry import Floats
from iapb.contact.kernels.resting import resting_forces as kernel
from iapb.errors import ArgumentError
from iapb.mechanics.kernels import forward_kinematics, make_workspace
from iapb.mechanics.mechanism import Mechanism


@dataclass(frozen=True)
class RestingForces:
    """Forces of the penetrating contacts of a set, c contacts, d velocities."""

    normal_force: Floats  # (c,) [N] on a along the normal; negative pulls (only with clamped=False)
    friction_force: Floats  # (c, 3) [N] on a
    penalty_force: Floats  # (d,) generalized force of the normal forces
    generalized_friction: Floats  # (d,) generalized force of the friction


def resting_forces(
    mechanism: Mechanism,
    contacts: ContactSet,
    q: ArrayLike,
    stiffness: float,
    damping: float = 0.0,
    *,
    clamped: bool = True,
    friction: float = 0.0,
    friction_velocity: float = 1e-3,
) -> RestingForces:
    """Return (4) F_i = F_n n + F_f at each contact with gap <= 0, and Σ Jᵀ F_i of (1).

    Normal force (5): F_n = −K s − B v_n with s = gap <= 0. As printed it pulls while bodies separate quickly;
    `clamped` (the default) cuts it at zero. Friction (6): −μ F_n against the tangential velocity v_t, reduced
    by |v_t| / v_threshold below the threshold; zero where F_n pulls.

    Parameters
    ----------
    stiffness : float [N/m]
        K.
    damping : float [N s/m]
        B.
    clamped : bool
        Never pull; False: (5) as printed.
    friction : float
        μ; 0: the friction code is not entered.
    friction_velocity : float [m/s]
        v_threshold > 0.

    Raises
    ------
    ArgumentError
        A constant below zero or not finite, v_threshold = 0 with friction.
    """
    require_not_negative(
        stiffness=stiffness, damping=damping, friction=friction, friction_velocity=friction_velocity
    )
    if friction > 0.0 and friction_velocity == 0.0:
        raise ArgumentError("friction_velocity", friction_velocity, "a speed > 0 where there is friction")
    arrays, workspace = block(mechanism.arrays), block(make_workspace(len(mechanism.names), mechanism.nv))
    forward_kinematics(arrays, finite_vector("q", q, mechanism.nq), workspace)
    penalty, drag = np.zeros(mechanism.nv), np.zeros(mechanism.nv)
    buffer, count = contacts._buffer, len(contacts)
    constants = (float(stiffness), float(damping), bool(clamped), float(friction), float(friction_velocity))
    kernel(arrays, workspace, buffer, count, *constants, penalty, drag)
    return RestingForces(
        buffer.normal_force[:count].copy(), buffer.friction_force[:count].copy(), penalty, drag
    )

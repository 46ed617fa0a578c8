"""Resting forces of penetrating contacts: penalty (5), modified Coulomb friction (6), as generalized forces."""

from __future__ import annotations

import math

from iapb.compiled import kernel
from iapb.contact.kernels.rows import add_body_row
from iapb.linalg import dot, load, scale, store
from iapb.mechanics.kernels.kinematics import add_point_force


@kernel
def normal_force(gap, normal_velocity, stiffness, damping, clamped):
    """Return (5), F_n = −K s − B v_n [N] on body a along the normal, s = gap <= 0; with `clamped`, F_n >= 0."""
    force = -stiffness * gap
    if damping != 0.0:
        force -= damping * normal_velocity
    return 0.0 if clamped and force < 0.0 else force


@kernel
def friction_share(normal_force, speed, friction, friction_velocity):
    """Return F_f / v_t [N s/m] of (6): −μ F_n t above the threshold speed, −(v_t / v_threshold) μ F_n below it.

    A contact that pulls, F_n < 0 in (5) as printed, gets no friction: (6) would then push along the motion.
    """
    reach = max(speed, friction_velocity)
    if normal_force <= 0.0 or reach == 0.0:
        return 0.0
    return -friction * normal_force / reach


@kernel
def resting_force(m, w, contacts, i, stiffness, damping, clamped, friction, friction_velocity, penalty, drag):
    """Add the forces of contact i, if its gap <= 0, to `penalty` and `drag` (d,), generalized forces Jᵀ F.

    m, w : mechanism arrays and workspace at the current configuration
    contacts : velocities up to date (`contact_velocities`); normal_force and friction_force are written
    stiffness K [N/m], damping B [N s/m], friction μ, friction_velocity v_threshold [m/s]
    """
    contacts.normal_force[i] = 0.0
    store(contacts.friction_force, i, (0.0, 0.0, 0.0))
    if contacts.gap[i] > 0.0:
        return
    force = normal_force(contacts.gap[i], contacts.normal_velocity[i], stiffness, damping, clamped)
    contacts.normal_force[i] = force
    x, n = load(contacts.point, i), load(contacts.normal, i)
    add_body_row(m, w, contacts.body_a[i], x, n, force, penalty)
    add_body_row(m, w, contacts.body_b[i], x, n, -force, penalty)
    if friction != 0.0:
        add_friction(m, w, contacts, i, friction, friction_velocity, drag)


@kernel
def add_friction(m, w, contacts, i, friction, friction_velocity, drag):
    """Add Jᵀ F_f to `drag` (d,): friction (6) of contact i, opposed to the tangential velocity."""
    x, tangential = load(contacts.point, i), load(contacts.tangential_velocity, i)
    speed = math.sqrt(dot(tangential, tangential))
    force = scale(friction_share(contacts.normal_force[i], speed, friction, friction_velocity), tangential)
    store(contacts.friction_force, i, force)
    add_point_force(m, w, contacts.body_a[i], x, force, drag)
    add_point_force(m, w, contacts.body_b[i], x, scale(-1.0, force), drag)

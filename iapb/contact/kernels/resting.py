"""Resting forces of penetrating contacts: penalty (5), modified Coulomb friction (6), as
generalized forces."""

from __future__ import annotations

from iapb.contact.kernels.rows import add_body_row, friction_of
from iapb.mechanics.kernels.kinematics import add_point_force
from iapb.numerics.compiled import kernel
from iapb.numerics.linalg import load, norm, scale, store


@kernel
def normal_force(gap, normal_velocity, stiffness, damping, clamped):
    """Return (5), F_n = −K s − B v_n [N] on body a along the normal, s = gap <= 0; with `clamped`,
    F_n >= 0."""
    force = -stiffness * gap
    if damping != 0.0:
        force -= damping * normal_velocity
    return 0.0 if clamped and force < 0.0 else force


@kernel
def friction_share(normal_force, speed, friction, friction_velocity):
    """Return F_f / v_t [N s/m] of (6): −μ F_n t above the threshold speed, −(v_t / v_threshold) μ
    F_n below it.

    A contact that pulls, F_n < 0 in (5) as printed, gets no friction: (6) would then push along the
    motion.
    """
    reach = max(speed, friction_velocity)
    if normal_force <= 0.0 or reach == 0.0:
        return 0.0
    return -friction * normal_force / reach


@kernel
def resting_force(world, state, contacts, i):
    """Add the forces (4) of contact i to those of the step, as generalized forces Jᵀ F.

    contacts : velocities up to date (`contact_velocities`); normal_force and friction_force are
        written
    """
    force = normal_force(
        contacts.gap[i], contacts.normal_velocity[i], world.stiffness, world.damping, world.clamped
    )
    contacts.normal_force[i] = force
    x = load(contacts.point, i)
    n = load(contacts.normal, i)
    add_body_row(world, state, contacts.body_a[i], x, n, force, state.penalty_force)
    add_body_row(world, state, contacts.body_b[i], x, n, -force, state.penalty_force)
    friction = friction_of(world, contacts, i)
    if friction == 0.0:
        return
    tangential = load(contacts.tangential_velocity, i)
    speed = norm(tangential)
    friction_force = scale(
        friction_share(force, speed, friction, world.friction_velocity), tangential
    )
    store(contacts.friction_force, i, friction_force)
    add_point_force(
        world.mechanism, state.body, contacts.body_a[i], x, friction_force, state.friction_force
    )
    opposite = scale(-1.0, friction_force)
    add_point_force(
        world.mechanism, state.body, contacts.body_b[i], x, opposite, state.friction_force
    )

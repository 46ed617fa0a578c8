"""Which terms of the equations of motion a mechanism has at all, read from its structure.

Both answers are exact zeros, never thresholds: a centre of mass 1e-17 m off its axis keeps the terms on.
A "no" is a theorem; a "yes" may be cautious (a balanced second link after a first one is not looked for).
"""

from __future__ import annotations

import numpy as np

from iapb.dense import product
from iapb.mechanics.kernels.arrays import FREE_FLYER, PLANAR_SE2, SPHERICAL, MechanismArrays
from iapb.mechanics.moving_parts import point_inertia, turned_inertia


def _rigid_part(m: MechanismArrays, body: int) -> list[int] | None:
    """Bodies fixed to `body`, itself included; None if anything moves relative to it."""
    part = [body]
    for b in range(body + 1, len(m.kind)):
        if m.parent[b] in part:
            if m.v_count[b] > 0:
                return None
            part.append(b)
    return part


def _mass_properties(m: MechanismArrays, part: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """First moment of mass and inertia of a rigid part about its first body's origin, in that body's axes."""
    rotation, position = {part[0]: np.eye(3)}, {part[0]: np.zeros(3)}
    moment, inertia = np.zeros(3), np.zeros((3, 3))
    for b in part:
        if b != part[0]:
            parent = int(m.parent[b])
            rotation[b] = product(rotation[parent], m.placement_rotation[b])
            position[b] = position[parent] + product(rotation[parent], m.placement_position[b])
        center = position[b] + product(rotation[b], m.center_of_mass[b])
        moment += m.mass[b] * center
        inertia += turned_inertia(rotation[b], m.inertia[b]) + m.mass[b] * point_inertia(center)
    return moment, inertia


def _moves_before(m: MechanismArrays, body: int) -> bool:
    """Does any dof of an ancestor carry the body?"""
    return int(m.parent[body]) >= 0 and int(m.last_dof[m.parent[body]]) >= 0


def _rotating_bodies(m: MechanismArrays) -> list[int]:
    return sorted({int(b) for b, rotates in zip(m.dof_body, m.dof_rotates, strict=True) if rotates})


def _rotation_keeps_mass_matrix(m: MechanismArrays, body: int) -> bool:
    """Is M independent of the rotation of this body's joint?

    Yes if what turns is one rigid part and either nothing moves before it, or it is balanced: its centre
    of mass lies on the axis (at the centre of a spherical joint). Free flyers and planar_se2 joints have
    velocities in body axes, so at the root their M is the body's own inertia.
    """
    part = _rigid_part(m, body)
    if part is None:
        return False
    if m.kind[body] in (FREE_FLYER, PLANAR_SE2):
        return not _moves_before(m, body)
    moment, _ = _mass_properties(m, part)
    own_translation = m.v_count[body] == 3 and m.kind[body] != SPHERICAL  # the planar chain
    if not _moves_before(m, body) and not own_translation:
        return True
    if m.kind[body] == SPHERICAL:
        return not moment.any()
    axis = np.array([0.0, 0.0, 1.0]) if own_translation else m.joint_axis[body]
    return not np.cross(axis, moment).any()


def has_constant_mass_matrix(m: MechanismArrays) -> bool:
    """True only if M does not depend on q."""
    return all(_rotation_keeps_mass_matrix(m, b) for b in _rotating_bodies(m))


def _spins_without_bias(m: MechanismArrays, body: int) -> bool:
    """With M constant: does the joint's rotation leave B zero, too?"""
    if m.kind[body] in (FREE_FLYER, PLANAR_SE2):
        return False  # m omega x u: the axes of the velocity turn with the body
    if m.kind[body] != SPHERICAL:
        return True  # v = dq/dt: B follows from dM/dq alone
    part = _rigid_part(m, body)
    inertia = _mass_properties(m, part)[1] if part is not None else np.diag([1.0, 2.0, 3.0])
    return bool((inertia == inertia[0, 0] * np.eye(3)).all())


def has_velocity_terms(m: MechanismArrays) -> bool:
    """False only if B(q, v) is zero everywhere."""
    return not has_constant_mass_matrix(m) or not all(_spins_without_bias(m, b) for b in _rotating_bodies(m))

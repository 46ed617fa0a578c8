"""Structure of a mechanism: its bodies as arrays, its moving parts alone, and which terms of its equations vanish.

`has_constant_mass_matrix` and `has_velocity_terms` compare with exact zeros, not with thresholds: a centre of mass
1e-17 m off its axis keeps the terms. A term reported as absent is exactly zero. A term reported as present may still
be zero in cases that are not checked, such as a balanced second link on a first one.
"""

from __future__ import annotations

from collections.abc import Container
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.linalg import product
from iapb.mechanics.bodies import Body
from iapb.mechanics.joints import FREE_FLYER, PLANAR_SE2, SPHERICAL
from iapb.mechanics.kernels.arrays import MechanismArrays


def rigid_part(m: MechanismArrays, body: int) -> list[int] | None:
    """Return the bodies fixed to `body`, with `body` itself; None if any body moves relative to it."""
    part = [body]
    for b in range(body + 1, len(m.kind)):
        if m.parent[b] in part:
            if m.v_count[b] > 0:
                return None
            part.append(b)
    return part


def _mass_properties(m: MechanismArrays, part: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return first moment of mass and inertia of a rigid part about its first body's origin, in that body's axes."""
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
    """Return whether an ancestor of the body has a dof."""
    return int(m.parent[body]) >= 0 and int(m.last_dof[m.parent[body]]) >= 0


def _rotating_bodies(m: MechanismArrays) -> list[int]:
    return sorted({int(b) for b, rotates in zip(m.dof_body, m.dof_rotates, strict=True) if rotates})


def _rotation_keeps_mass_matrix(m: MechanismArrays, body: int) -> bool:
    """Return whether M is independent of the rotation of this body's joint.

    True if the joint turns one rigid part and either no ancestor of the part moves or the part is balanced: its centre
    of mass lies on the axis (at the centre of a spherical joint). Free flyers and planar_se2 joints have
    velocities in body axes, so at the root their M is the inertia of the body itself.
    """
    part = rigid_part(m, body)
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
    """Return True only if M does not depend on q."""
    return all(_rotation_keeps_mass_matrix(m, b) for b in _rotating_bodies(m))


def _spins_without_bias(m: MechanismArrays, body: int) -> bool:
    """Return whether the joint's rotation leaves B zero, given that M is constant."""
    if m.kind[body] in (FREE_FLYER, PLANAR_SE2):
        return False  # m omega x u: the axes of the velocity turn with the body
    if m.kind[body] != SPHERICAL:
        return True  # v = dq/dt: B follows from dM/dq alone
    part = rigid_part(m, body)
    inertia = _mass_properties(m, part)[1] if part is not None else np.diag([1.0, 2.0, 3.0])
    return bool((inertia == inertia[0, 0] * np.eye(3)).all())


def has_velocity_terms(m: MechanismArrays, bodies: Container[int] | None = None) -> bool:
    """Return False only if B(q, v) of the given bodies, which are whole trees (default: all), is zero everywhere."""
    return not all(_rotation_keeps_mass_matrix(m, b) and _spins_without_bias(m, b) for b in _rotating_bodies(m)
                   if bodies is None or b in bodies)


# A mechanism with every fixed body merged into the body that carries it: this is enough for M and B.
#
# A robot's URDF has about two links per moving link (flanges, covers, tool frames).


Floats = NDArray[np.float64]


def moving_parts(m: MechanismArrays) -> MechanismArrays:
    """Return arrays of the moving bodies alone, each with the mass of the bodies fixed to it; the dofs are the same."""
    carrier, rotation, position = _frames_in_carriers(m)
    moving = [b for b in range(len(m.kind)) if m.v_count[b] > 0]
    new_index = {b: i for i, b in enumerate(moving)} | {-1: -1}
    masses = [_part_masses(m, b, np.flatnonzero(carrier == b), rotation, position) for b in moving]
    parents = [int(m.parent[b]) for b in moving]
    places = [_placement(m, b, rotation, position) for b in moving]
    return m._replace(
        kind=m.kind[moving],
        parent=np.array([new_index[int(carrier[p]) if p >= 0 else -1] for p in parents], dtype=np.int64),
        q_start=m.q_start[moving],
        v_start=m.v_start[moving],
        v_count=m.v_count[moving],
        joint_axis=m.joint_axis[moving],
        placement_rotation=np.array([R for R, _ in places]).reshape(-1, 3, 3),
        placement_position=np.array([p for _, p in places]).reshape(-1, 3),
        mass=np.array([mass for mass, _, _ in masses], dtype=np.float64),
        center_of_mass=np.array([center for _, center, _ in masses]).reshape(-1, 3),
        inertia=np.array([inertia for _, _, inertia in masses]).reshape(-1, 3, 3),
        last_dof=m.last_dof[moving],
        dof_body=np.array([new_index[int(b)] for b in m.dof_body], dtype=np.int64),
    )


def _frames_in_carriers(m: MechanismArrays) -> tuple[NDArray[np.int64], Floats, Floats]:
    """Return the moving body that carries each body (-1: the world), and each body's axes and origin in its frame."""
    count = len(m.kind)
    carrier = np.full(count, -1, dtype=np.int64)
    rotation, position = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
    for b in range(count):
        if m.v_count[b] > 0:
            carrier[b] = b
            continue
        rotation[b], position[b] = _placement(m, b, rotation, position)
        if m.parent[b] >= 0:
            carrier[b] = carrier[m.parent[b]]
    return carrier, rotation, position


def _placement(m: MechanismArrays, b: int, rotation: Floats, position: Floats) -> tuple[Floats, Floats]:
    """Return the joint frame of b in the frame of the moving body (or the world) that carries its parent."""
    parent = int(m.parent[b])
    if parent < 0 or m.v_count[parent] > 0:
        return m.placement_rotation[b], m.placement_position[b]
    place = position[parent] + product(rotation[parent], m.placement_position[b])
    return product(rotation[parent], m.placement_rotation[b]), place


def turned_inertia(rotation: Floats, inertia: Floats) -> Floats:
    """Return R I Rᵀ, the inertia in the axes that R turns to."""
    return product(product(rotation, inertia), rotation.T)


def point_inertia(place: Floats) -> Floats:
    """Return |r|² 1 − r rᵀ, the inertia about the origin of a unit mass at r."""
    return product(place[None], place) * np.eye(3) - np.outer(place, place)


def _part_masses(
    m: MechanismArrays, body: int, members: NDArray[np.int64], rotation: Floats, position: Floats
) -> tuple[float, Floats, Floats]:
    """Return mass, centre of mass and inertia about this centre of a part, in the frame of its moving body `body`."""
    mass = sum(m.mass[members].tolist())
    if len(members) == 1 or mass == 0.0:
        turned = [turned_inertia(rotation[b], m.inertia[b]) for b in members]
        return (
            mass,
            m.center_of_mass[body],
            m.inertia[body] if len(members) == 1 else sum(turned, np.zeros((3, 3))),
        )
    centers = np.array([position[b] + product(rotation[b], m.center_of_mass[b]) for b in members])
    center = product(centers.T, m.mass[members]) / mass
    inertia = np.zeros((3, 3))
    for b, place in zip(members, centers - center, strict=True):
        inertia += turned_inertia(rotation[b], m.inertia[b]) + m.mass[b] * point_inertia(place)
    return mass, center, inertia


# Bodies as arrays: the position of each joint's coordinates in q and v, and the dofs that move each body.


def collect_arrays(bodies: tuple[Body, ...], parents: list[int]) -> MechanismArrays:
    """Return the bodies as contiguous arrays; parents (n,) are body indices, -1 = world."""
    layouts = [body.joint.layout for body in bodies]
    v_count = np.array([layout.nv for layout in layouts], dtype=np.int64)
    v_start = np.cumsum(v_count) - v_count
    q_count = np.array([layout.nq for layout in layouts], dtype=np.int64)
    last_dof, dof_body, dof_parent = _chains(v_start, v_count, parents)
    return MechanismArrays(
        kind=np.array([layout.code for layout in layouts], dtype=np.int64),
        parent=np.array(parents, dtype=np.int64),
        q_start=np.cumsum(q_count) - q_count,
        v_start=v_start,
        v_count=v_count,
        joint_axis=_stack([body.joint.unit_axis for body in bodies], (3,)),
        placement_rotation=_stack([body.placement[0] for body in bodies], (3, 3)),
        placement_position=_stack([body.placement[1] for body in bodies], (3,)),
        mass=np.array([body.mass for body in bodies], dtype=np.float64),
        center_of_mass=_stack([body.center_of_mass for body in bodies], (3,)),
        inertia=_stack([body.inertia for body in bodies], (3, 3)),
        last_dof=np.array(last_dof, dtype=np.int64),
        dof_body=np.array(dof_body, dtype=np.int64),
        dof_parent=np.array(dof_parent, dtype=np.int64),
        dof_rotates=np.array([turns for layout in layouts for turns in layout.rotating], dtype=np.bool_),
    )


def _stack(rows: list[Floats], shape: tuple[int, ...]) -> Floats:
    return np.ascontiguousarray(np.array(rows, dtype=np.float64).reshape(len(rows), *shape))


def _chains(v_start: Any, v_count: Any, parents: list[int]) -> tuple[list[int], list[int], list[int]]:
    """Return for each body its last dof on the path from the world, and for each dof its body and the dof before it."""
    last_dof: list[int] = []
    dof_body: list[int] = []
    dof_parent: list[int] = []
    for b, parent in enumerate(parents):
        last = last_dof[parent] if parent >= 0 else -1
        for k in range(int(v_start[b]), int(v_start[b] + v_count[b])):
            dof_body.append(b)
            dof_parent.append(last)
            last = k
        last_dof.append(last)
    return last_dof, dof_body, dof_parent


def tree_ranges(m: MechanismArrays, tree_of_body: NDArray[np.int64]) -> list[tuple[int, int]]:
    """Return (start, stop) in v of each tree; empty for a tree of fixed bodies."""
    ranges = []
    for tree in range(int(tree_of_body.max()) + 1 if len(tree_of_body) else 0):
        members = np.flatnonzero(tree_of_body == tree)
        ranges.append((int(m.v_start[members[0]]), int(m.v_start[members[-1]] + m.v_count[members[-1]])))
    return ranges

"""Structure of a mechanism: bodies as arrays, moving parts alone, terms that vanish, constants of
its free motion.

`has_constant_mass_matrix` and `has_velocity_terms` compare with exact zeros, not with thresholds: a
centre of mass 1e-17 m off its axis keeps the terms. A term reported as absent is exactly zero. A
term reported as present may still be zero in cases that are not checked, such as a balanced second
link on a first one.
"""

from __future__ import annotations

from collections.abc import Container
from math import sqrt

import numpy as np

from iapb.errors import ArgumentError
from iapb.mechanics.bodies import Body
from iapb.mechanics.joints import FREE_FLYER, PLANAR, SPHERICAL, Mimic
from iapb.mechanics.kernels.arrays import MechanismArrays
from iapb.mechanics.kernels.free_motion import LINKAGE, RIGID, STRAIGHT, FreeMotion
from iapb.numerics.linalg import product
from iapb.numerics.schema import Floats, Integers, zeros_of


def collect_arrays(bodies: tuple[Body, ...], parents: list[int]) -> MechanismArrays:
    """Return the bodies as contiguous arrays; parents (n,) are body indices, -1 = world."""
    layouts = [body.joint.layout for body in bodies]
    count = len(bodies)
    follows = np.array([body.mimic is not None for body in bodies], np.bool_)
    v_count = np.array([layout.nv for layout in layouts], np.int64)
    q_own = np.where(follows, 0, np.array([layout.nq for layout in layouts], np.int64))
    q_start = np.cumsum(q_own) - q_own
    order = np.argsort(follows, kind="stable")  # those that follow another one are the last
    v_start = np.zeros(count, np.int64)
    v_start[order] = np.cumsum(v_count[order]) - v_count[order]
    dof_body = np.repeat(order, v_count[order])
    dof_rotates = np.array([turns for b in order for turns in layouts[b].rotating], np.bool_)
    motions = len(dof_body)
    dof_parent = np.arange(motions) - 1
    last_dof: list[int] = []  # of each body, on the path from the world
    for b, parent in enumerate(parents):
        last_dof.append(last_dof[parent] if parent >= 0 else -1)
        if v_count[b]:
            dof_parent[v_start[b]] = last_dof[b]
            last_dof[b] = v_start[b] + v_count[b] - 1
    dof_leader = np.arange(motions)
    dof_ratio = np.ones(motions)
    dof_offset = np.zeros(motions)
    for b in np.flatnonzero(follows).tolist():
        mimic = bodies[b].mimic or Mimic("")
        k = v_start[b]
        leader = _leader(bodies, mimic.body)
        q_start[b] = q_start[leader]
        dof_leader[k] = v_start[leader]
        dof_ratio[k] = mimic.multiplier
        dof_offset[k] = mimic.offset
    return MechanismArrays(
        bodies=count,
        motions=motions,
        kind=np.array([layout.code for layout in layouts], np.int64),
        parent=np.array(parents, np.int64),
        q_start=q_start,
        v_start=v_start,
        v_count=v_count,
        joint_axis=np.array([body.joint.unit_axis for body in bodies]).reshape(count, 3),
        placement_rotation=np.array([body.placement[0] for body in bodies]).reshape(count, 3, 3),
        placement_position=np.array([body.placement[1] for body in bodies]).reshape(count, 3),
        mass=np.array([body.mass for body in bodies], np.float64),
        center_of_mass=np.array([body.center_of_mass for body in bodies]).reshape(count, 3),
        inertia=np.array([body.inertia for body in bodies]).reshape(count, 3, 3),
        last_dof=np.array(last_dof, np.int64),
        dof_body=dof_body,
        dof_parent=dof_parent,
        dof_rotates=dof_rotates,
        dof_leader=dof_leader,
        dof_ratio=dof_ratio,
        dof_offset=dof_offset,
    )


def _leader(bodies: tuple[Body, ...], name: str) -> int:
    """Return the body whose joint another one follows."""
    for i, body in enumerate(bodies):
        leads = body.mimic is None and body.joint.kind in ("revolute", "prismatic")
        if body.name == name and leads:
            return i
    raise ArgumentError("mimic", name, "a revolute or prismatic body that follows no other")


def carriers(m: MechanismArrays) -> Integers:
    """Return the moving body that each body is fixed to, itself if it moves; -1 is the world."""
    found: list[int] = []
    for b, parent in enumerate(m.parent):
        beneath = found[parent] if parent >= 0 else -1
        found.append(b if m.v_count[b] else beneath)
    return np.array(found, np.int64)


def moving_parts(m: MechanismArrays) -> MechanismArrays:
    """Return arrays of the moving bodies alone, each with the mass of the bodies fixed to it; the
    dofs are the same.

    This is enough for M and B. A robot's URDF has about two links per moving link (flanges, covers,
    tool frames).
    """
    moves = m.v_count > 0
    carrier = carriers(m)
    placed: list[tuple[Floats, Floats]] = []  # joint frames in the frames of the parents' carriers
    own: list[tuple[Floats, Floats]] = []  # axes and origin of each body in its carrier's frame
    for b, parent in enumerate(m.parent):
        rotation = m.placement_rotation[b]
        position = m.placement_position[b]
        if parent >= 0 and not moves[parent]:
            turn, shift = own[parent]
            rotation = product(turn, rotation)
            position = shift + product(turn, position)
        placed.append((rotation, position))
        own.append((np.eye(3), np.zeros(3)) if moves[b] else placed[b])
    moving = np.flatnonzero(moves)
    new_index = np.append(np.cumsum(moves) - 1, -1)  # the last one is that of the world, -1
    of_joints = ("bodies", "motions", "dof_")
    kept = {k: rows[moving] for k, rows in m._asdict().items() if not k.startswith(of_joints)}
    parts = m._replace(**kept)._replace(
        bodies=len(moving),
        parent=new_index[np.append(carrier, -1)[m.parent[moving]]],
        dof_body=new_index[m.dof_body],
    )
    for i, body in enumerate(moving):
        members = np.flatnonzero(carrier == body)
        parts.mass[i] = mass = sum(m.mass[members])
        places = np.array([own[b][1] + product(own[b][0], m.center_of_mass[b]) for b in members])
        if len(members) > 1 and mass > 0.0:
            parts.center_of_mass[i] = product(places.T, m.mass[members]) / mass
        parts.inertia[i] = sum(
            (
                turned_inertia(own[b][0], m.inertia[b])
                + m.mass[b] * point_inertia(place - parts.center_of_mass[i])
                for b, place in zip(members, places, strict=True)
            ),
            np.zeros((3, 3)),
        )
        parts.placement_rotation[i], parts.placement_position[i] = placed[body]
    return parts


def turned_inertia(rotation: Floats, inertia: Floats) -> Floats:
    """Return R I Rᵀ, the inertia in the axes that R turns to."""
    return product(product(rotation, inertia), rotation.T)


def point_inertia(place: Floats) -> Floats:
    """Return |r|² 1 − r rᵀ, the inertia about the origin of a unit mass at r."""
    return product(place[None], place) * np.eye(3) - np.outer(place, place)


def has_constant_mass_matrix(parts: MechanismArrays) -> bool:
    """Return True only if M of the moving parts does not depend on q."""
    return all(
        _rotation_keeps_mass_matrix(parts, b) for b in set(parts.dof_body[parts.dof_rotates])
    )


def has_velocity_terms(parts: MechanismArrays, of: Container[int] | None = None) -> bool:
    """Return False only if B(q, v) of the given moving parts, whole trees (default: all), is zero
    everywhere."""
    return not all(
        _rotation_keeps_mass_matrix(parts, b) and _spins_without_bias(parts, b)
        for b in set(parts.dof_body[parts.dof_rotates])
        if of is None or b in of
    )


def _rotation_keeps_mass_matrix(parts: MechanismArrays, b: int) -> bool:
    """Return whether M is independent of the rotation of this part's joint.

    True if the part carries no other and either no part carries it or it is balanced: its centre of
    mass lies on the axis (at the centre of a spherical joint). A free flyer has velocities in body
    axes, so at the root its M is the inertia of the body itself.
    """
    kind = parts.kind[b]
    carried = parts.parent[b] >= 0
    if b in parts.parent:
        return False
    if kind == FREE_FLYER:
        return not carried
    if not carried and kind != PLANAR:
        return True
    moment = parts.mass[b] * parts.center_of_mass[b]
    if kind == SPHERICAL:
        return not moment.any()
    return not np.cross((0.0, 0.0, 1.0) if kind == PLANAR else parts.joint_axis[b], moment).any()


def _spins_without_bias(parts: MechanismArrays, b: int) -> bool:
    """Return whether the joint's rotation leaves B zero, given that M is constant."""
    if parts.kind[b] == FREE_FLYER:
        return False  # m omega x u: the axes of the velocity turn with the body
    if parts.kind[b] != SPHERICAL:
        return True  # v = dq/dt: B follows from dM/dq alone
    inertia = parts.inertia[b] + parts.mass[b] * point_inertia(parts.center_of_mass[b])
    return (inertia == inertia[0, 0] * np.eye(3)).all()


def make_free_motion(m: MechanismArrays, tree_of_body: Integers) -> FreeMotion:
    """Return the constants of `iapb.mechanics.kernels.free_motion` for the trees, given as the tree
    of each body."""
    count = 1 + tree_of_body.max()
    found = zeros_of(FreeMotion, tree=count)
    found.root[:] = -1
    found.moments[:] = 1.0
    parts = moving_parts(m)
    carriers = np.flatnonzero(m.v_count)
    for t in range(count):
        moving = np.flatnonzero(tree_of_body[carriers] == t)
        if not len(moving):
            continue
        first = moving[0]
        kind = parts.kind[first]
        center = parts.center_of_mass[first]
        inertia = parts.inertia[first]
        found.root[t] = carriers[first]
        if len(moving) == 1 and kind in (FREE_FLYER, SPHERICAL):
            found.kind[t] = RIGID
            if kind == FREE_FLYER:
                found.center[t] = center
            else:
                inertia = inertia + parts.mass[first] * point_inertia(center)
            found.moments[t], axes = principal_axes(inertia)
            found.axes[t] = axes.T
        elif has_velocity_terms(parts, moving):
            found.kind[t] = LINKAGE
            if kind in (FREE_FLYER, PLANAR, SPHERICAL) and (parts.parent[moving[1:]] >= 0).all():
                found.base[t] = parts.v_count[first]
    return found._replace(
        turning=(found.kind != STRAIGHT).any(),
        linked=(found.kind == LINKAGE).any(),
    )


def principal_axes(inertia: Floats) -> tuple[Floats, Floats]:
    """Return the principal moments, ascending, and the axes as columns of a rotation, by Jacobi's
    method.

    Without LAPACK: the same bits on every processor.
    """
    matrix = np.array(inertia, np.float64)
    axes = np.eye(3)
    for _ in range(30):
        i, j = max(((0, 1), (0, 2), (1, 2)), key=lambda at: abs(matrix[at]))
        if abs(matrix[i, j]) <= 1e-17 * (abs(matrix[i, i]) + abs(matrix[j, j])):
            break
        ratio = (matrix[j, j] - matrix[i, i]) / (2.0 * matrix[i, j])
        t = (1.0 if ratio >= 0.0 else -1.0) / (abs(ratio) + sqrt(ratio * ratio + 1.0))
        c = 1.0 / sqrt(t * t + 1.0)
        s = t * c
        for rows in (matrix.T, axes.T, matrix):
            rows[i], rows[j] = c * rows[i] - s * rows[j], s * rows[i] + c * rows[j]
    order = sorted(range(3), key=lambda k: matrix[k, k])
    turned = np.ascontiguousarray(axes[:, order])
    if (np.cross(turned[:, 0], turned[:, 1]) * turned[:, 2]).sum() < 0.0:
        turned[:, 2] *= -1.0
    return matrix[order, order], turned

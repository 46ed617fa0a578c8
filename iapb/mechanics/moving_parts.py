"""A mechanism with every fixed body merged into the one that carries it: what M and B need, and no more.

A robot's URDF has about two links for each that moves (flanges, covers, tool frames).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iapb.dense import product
from iapb.mechanics.kernels.arrays import MechanismArrays

Floats = NDArray[np.float64]


def moving_parts(m: MechanismArrays) -> MechanismArrays:
    """Return arrays of the moving bodies alone, each with the mass of what is fixed to it; the dofs are the same."""
    carrier, rotation, position = _frames_in_carriers(m)
    moving = [b for b in range(len(m.kind)) if m.v_count[b] > 0]
    new_index = {b: i for i, b in enumerate(moving)} | {-1: -1}
    masses = [_mass_properties(m, b, np.flatnonzero(carrier == b), rotation, position) for b in moving]
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
    """Moving body that each body belongs to (-1: the world), and its axes and origin in that body's frame."""
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
    """Joint frame of b in the frame of the moving body (or the world) that carries its parent."""
    parent = int(m.parent[b])
    if parent < 0 or m.v_count[parent] > 0:
        return m.placement_rotation[b], m.placement_position[b]
    place = position[parent] + product(rotation[parent], m.placement_position[b])
    return product(rotation[parent], m.placement_rotation[b]), place


def turned_inertia(rotation: Floats, inertia: Floats) -> Floats:
    """R I Rᵀ: the inertia in the axes that R turns to."""
    return product(product(rotation, inertia), rotation.T)


def point_inertia(place: Floats) -> Floats:
    """|r|² 1 − r rᵀ: the inertia about the origin of a unit mass at r."""
    return product(place[None], place) * np.eye(3) - np.outer(place, place)


def _mass_properties(
    m: MechanismArrays, body: int, members: NDArray[np.int64], rotation: Floats, position: Floats
) -> tuple[float, Floats, Floats]:
    """Mass, centre of mass and inertia about it of a part, in its first body's frame: sums of positive terms."""
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

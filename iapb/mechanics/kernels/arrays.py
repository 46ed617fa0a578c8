"""Input of the kernels (MechanismArrays, constant) and their scratch (Workspace, one per
thread)."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from iapb.numerics.schema import Booleans, Floats, Integers, VectorPerBody, zeros_of


class MechanismArrays(NamedTuple):
    """A mechanism as contiguous arrays; n bodies. Parents come before children.

    There are m motions: first the d velocities, then one for each joint that follows another one,
    with rate and position `dof_ratio` times the leader's, plus `dof_offset`.
    """

    bodies: int  # n
    motions: int  # m
    kind: Integers  # (n,) joint code
    parent: Integers  # (n,) body that carries this one, -1 = the world
    q_start: Integers  # (n,) first entry of the joint in q
    v_start: Integers  # (n,) first motion of the joint: its first entry in v
    v_count: Integers  # (n,) number of entries in v
    joint_axis: Floats  # (n, 3) unit, joint frame
    placement_rotation: Floats  # (n, 3, 3) joint frame in the parent body's frame
    placement_position: Floats  # (n, 3) [m]
    mass: Floats  # (n,) [kg]
    center_of_mass: Floats  # (n, 3) [m] body frame
    inertia: Floats  # (n, 3, 3) [kg m^2] about the centre of mass, body axes
    last_dof: Integers  # (n,) last dof on the path from the world to the body, -1 = none
    dof_body: Integers  # (m,) body that the dof moves
    dof_parent: Integers  # (m,) dof before it on the path from the world, -1 = none
    dof_rotates: Booleans  # (m,) turns about its axis; otherwise moves along it
    dof_leader: Integers  # (m,) the velocity that it follows, its own or another one
    dof_ratio: Floats  # (m,) 1 for its own
    dof_offset: Floats  # (m,)


class Workspace(NamedTuple):
    """Scratch of the kernels for one mechanism, world axes. `forward_kinematics` fills the first
    four fields."""

    rotation: Annotated[Floats, "body 3 3"]  # body axes as columns
    position: VectorPerBody  # [m] body origin
    center: VectorPerBody  # [m] centre of mass
    axis: Annotated[Floats, "dof 3"]  # unit, axis of each dof
    composite_mass: Annotated[Floats, "body"]  # mass of the body and all bodies that it carries
    composite_center: VectorPerBody
    composite_inertia: Annotated[Floats, "body 3 3"]  # about the composite centre
    angular_velocity: VectorPerBody
    linear_velocity: VectorPerBody  # of the body origin
    angular_acceleration: VectorPerBody
    linear_acceleration: VectorPerBody  # of the body origin, minus gravity
    force: VectorPerBody  # that the joint transmits to the body
    moment: VectorPerBody  # about the body origin
    # first nq: the q of the first four fields; NaN: not computed yet
    placed_q: Annotated[Floats, "placed"]


def make_workspace(bodies: int, dofs: int) -> Workspace:
    """Return scratch for a mechanism with that many bodies and dofs (joints have at most two
    entries of q per dof)."""
    made = zeros_of(Workspace, body=bodies, dof=dofs, placed=2 * dofs)
    made.placed_q[:] = np.nan
    return made

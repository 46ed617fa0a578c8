"""Input of the kernels (MechanismArrays, constant) and their scratch (Workspace, one per thread)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class MechanismArrays(NamedTuple):
    """A mechanism as contiguous arrays; n bodies, d velocities. Parents come before children."""

    kind: NDArray[np.int64]  # (n,) joint code
    parent: NDArray[np.int64]  # (n,) body that carries this one, -1 = the world
    q_start: NDArray[np.int64]  # (n,) first entry of the joint in q
    v_start: NDArray[np.int64]  # (n,) first entry of the joint in v
    v_count: NDArray[np.int64]  # (n,) number of entries in v
    joint_axis: NDArray[np.float64]  # (n, 3) unit, joint frame
    placement_rotation: NDArray[np.float64]  # (n, 3, 3) joint frame in the parent body's frame
    placement_position: NDArray[np.float64]  # (n, 3) [m]
    mass: NDArray[np.float64]  # (n,) [kg]
    center_of_mass: NDArray[np.float64]  # (n, 3) [m] body frame
    inertia: NDArray[np.float64]  # (n, 3, 3) [kg m^2] about the centre of mass, body axes
    last_dof: NDArray[np.int64]  # (n,) last dof on the path from the world to the body, -1 = none
    dof_body: NDArray[np.int64]  # (d,) body that the dof moves
    dof_parent: NDArray[np.int64]  # (d,) dof before it on the path from the world, -1 = none
    dof_rotates: NDArray[np.bool_]  # (d,) turns about its axis; otherwise moves along it


class Workspace(NamedTuple):
    """Scratch of the kernels for one mechanism, world axes. `forward_kinematics` fills the first four fields."""

    rotation: NDArray[np.float64]  # (n, 3, 3) body axes as columns
    position: NDArray[np.float64]  # (n, 3) [m] body origin
    center: NDArray[np.float64]  # (n, 3) [m] centre of mass
    axis: NDArray[np.float64]  # (d, 3) unit, axis of each dof
    composite_mass: NDArray[np.float64]  # (n,) mass of the body and all bodies that it carries
    composite_center: NDArray[np.float64]  # (n, 3)
    composite_inertia: NDArray[np.float64]  # (n, 3, 3) about the composite centre
    angular_velocity: NDArray[np.float64]  # (n, 3)
    linear_velocity: NDArray[np.float64]  # (n, 3) of the body origin
    angular_acceleration: NDArray[np.float64]  # (n, 3)
    linear_acceleration: NDArray[np.float64]  # (n, 3) of the body origin, minus gravity
    force: NDArray[np.float64]  # (n, 3) that the joint transmits to the body
    moment: NDArray[np.float64]  # (n, 3) about the body origin
    placed_q: NDArray[np.float64]  # (2 d,) first nq: the q of the first four fields; NaN: not computed yet


class Evaluation(NamedTuple):
    """A mechanism with its scratch, passed as one argument: each argument adds 0.1 µs to a call from Python."""

    mechanism: MechanismArrays
    workspace: Workspace


def make_workspace(bodies: int, dofs: int) -> Workspace:
    """Return scratch for a mechanism with that many bodies and dofs (joints have at most two entries of q per dof)."""
    rows, frames = (bodies, 3), (bodies, 3, 3)
    shapes = (frames, rows, rows, (dofs, 3), (bodies,), rows, frames, *([rows] * 6))
    nowhere = np.full(2 * dofs, np.nan)
    return Workspace(*[*(np.zeros(shape) for shape in shapes), nowhere])

"""Compiled kernels of the mechanics room: arrays in, `out` written, nothing allocated.

Everything is expressed in world axes. Each degree of freedom k has one unit axis: it translates its body
along it or turns it about the line through the body's origin; hence one formula serves every joint kind.
Order of calls: `forward_kinematics` fills the workspace, everything else reads it.
"""

from iapb.mechanics.kernels.arrays import Evaluation, MechanismArrays, Workspace, make_workspace
from iapb.mechanics.kernels.configuration import difference, integrate
from iapb.mechanics.kernels.dynamics import bias, gravity, inverse_dynamics, mass_matrix
from iapb.mechanics.kernels.evaluation import (
    all_finite,
    bias_at,
    biases_at,
    centroidal_momentum,
    is_configuration,
    kinetic_energy,
    mass_matrices_at,
    mass_matrix_at,
    misplaced_body,
    potential_energy,
)
from iapb.mechanics.kernels.kinematics import (
    add_point_force,
    forward_kinematics,
    frame_jacobian,
    point_jacobian,
    point_velocity,
)

__all__ = [
    "Evaluation",
    "MechanismArrays",
    "Workspace",
    "add_point_force",
    "all_finite",
    "bias",
    "bias_at",
    "biases_at",
    "centroidal_momentum",
    "difference",
    "forward_kinematics",
    "frame_jacobian",
    "gravity",
    "integrate",
    "is_configuration",
    "inverse_dynamics",
    "kinetic_energy",
    "make_workspace",
    "mass_matrices_at",
    "mass_matrix",
    "mass_matrix_at",
    "misplaced_body",
    "point_jacobian",
    "point_velocity",
    "potential_energy",
]

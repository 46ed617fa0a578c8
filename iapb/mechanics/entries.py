"""The kernels that Python calls, always with a mechanism's blocks and contiguous float arrays (see `Entry`)."""

import threading

from iapb.compiled import Block, Entry, block
from iapb.mechanics import kernels
from iapb.mechanics.kernels import Evaluation, MechanismArrays, Workspace

all_finite = Entry(kernels.all_finite)
bias_at = Entry(kernels.bias_at)
biases_at = Entry(kernels.biases_at)
centroidal_momentum = Entry(kernels.centroidal_momentum)
difference = Entry(kernels.difference)
forward_kinematics = Entry(kernels.forward_kinematics)
frame_jacobian = Entry(kernels.frame_jacobian)
gravity = Entry(kernels.gravity)
integrate = Entry(kernels.integrate)
inverse_dynamics = Entry(kernels.inverse_dynamics)
is_configuration = Entry(kernels.is_configuration)
kinetic_energy = Entry(kernels.kinetic_energy)
mass_matrices_at = Entry(kernels.mass_matrices_at)
mass_matrix_at = Entry(kernels.mass_matrix_at)
misplaced_body = Entry(kernels.misplaced_body)
point_jacobian = Entry(kernels.point_jacobian)
potential_energy = Entry(kernels.potential_energy)


class Scratch(threading.local):
    """Where kernels write; made anew in each thread that asks.

    Attributes
    ----------
    workspace : for the mechanism as it is
    parts : the moving parts alone, with a workspace of their own
    """

    def __init__(self, workspace: Workspace, parts: MechanismArrays) -> None:
        self.workspace: Block = block(_copied(workspace))
        self.parts: Block = block(Evaluation(parts, _copied(workspace)))


def _copied(workspace: Workspace) -> Workspace:
    return Workspace(*(array.copy() for array in workspace))

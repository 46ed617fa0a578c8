"""The forces on the tool in one step: the hand's and the position channels' (paper VI)."""

from __future__ import annotations

from iapb.compiled import kernel
from iapb.haptics.kernels.port import NO_COUPLING, UNILATERAL
from iapb.haptics.kernels.sensors import measure
from iapb.mechanics.kernels import add_point_force, difference, forward_kinematics


@kernel
def couple(world, state, port):
    """Forces on the tool for this step: the hand's J_hᵀF_h and the position channels' PD."""
    port.applied[:] = 0.0
    if port.tool_tree < 0:
        return
    feel_hand(world, state, port)
    if port.coupling != NO_COUPLING:
        measure(world, port)
        coordinate(state, port)
    for k in range(port.applied.shape[0]):
        port.applied[k] = port.hand_force[k] + port.coupling_force[k]
    if port.coupling == UNILATERAL and port.engaged[0]:
        for k in range(port.v_start, port.v_stop):  # the hand reaches a coupled tool through the coupler only
            port.applied[k] = port.coupling_force[k]


@kernel
def feel_hand(world, state, port):
    """J_hᵀF_h on the tool where it is, and on the device where it is; nothing while the hand holds still."""
    port.hand_force[:] = 0.0
    port.device_hand_force[:] = 0.0
    if not pushes(port):
        return
    forward_kinematics(world.mechanism, state.q, state.body)
    press(world.mechanism, state.body, port.hand_body, port, port.hand_force)
    if port.coupling != NO_COUPLING:
        forward_kinematics(port.mechanism, port.device_q, port.body)
        press(port.mechanism, port.body, port.device_body, port, port.device_hand_force)


@kernel
def pushes(port):
    """Does the hand do anything?"""
    pushing = False
    for k in range(port.wrench.shape[0]):
        pushing = pushing or port.wrench[k] != 0.0
    return pushing


@kernel
def press(mechanism, body, held, port, out):
    """out += J_hᵀF_h for the wrench at the held point."""
    rotation, origin, arm = body.rotation[held], body.position[held], port.hand_point
    point = (
        origin[0] + rotation[0, 0] * arm[0] + rotation[0, 1] * arm[1] + rotation[0, 2] * arm[2],
        origin[1] + rotation[1, 0] * arm[0] + rotation[1, 1] * arm[1] + rotation[1, 2] * arm[2],
        origin[2] + rotation[2, 0] * arm[0] + rotation[2, 1] * arm[1] + rotation[2, 2] * arm[2],
    )
    add_point_force(mechanism, body, held, point, port.wrench[:3], out)
    k = mechanism.last_dof[held]
    while k >= 0:
        if mechanism.dof_rotates[k]:
            for axis in range(3):
                out[k] += body.axis[k, axis] * port.wrench[3 + axis]
        k = mechanism.dof_parent[k]


@kernel
def coordinate(state, port):
    """Position channels: PD between tool and device, as a force on the tool (its opposite on the device)."""
    port.coupling_force[:] = 0.0
    if port.coupling == UNILATERAL and not port.engaged[0]:
        return
    difference(port.mechanism, state.q[port.q_start : port.q_stop], port.measured_q, port.error)
    for i in range(port.error.shape[0]):
        k = port.v_start + i
        port.coupling_force[k] = port.stiffness[i] * port.error[i] + port.damping[i] * (
            port.measured_v[i] - state.v[k]
        )

"""The forces on the tool in one step: the hand's and the position channels' (paper VI)."""

from __future__ import annotations

from iapb.compiled import kernel
from iapb.haptics.kernels.port import NO_COUPLING, UNILATERAL
from iapb.haptics.kernels.sensors import measure
from iapb.mechanics.kernels import add_point_force, difference, forward_kinematics
from iapb.mechanics.kernels.vectors import add, dot, load, transform


@kernel
def couple(world, state, port):
    """Forces on the tool for this step: the hand's J_hᵀF_h and the position channels' PD."""
    if port.tool_tree < 0:
        return  # `applied` holds the zeros that it was made with
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
    wrench, arm = port.wrench, port.hand_point
    force, torque = (wrench[0], wrench[1], wrench[2]), (wrench[3], wrench[4], wrench[5])
    point = add(load(body.position, held), transform(body.rotation, held, (arm[0], arm[1], arm[2])))
    add_point_force(mechanism, body, held, point, force, out)
    k = mechanism.last_dof[held]
    while k >= 0:
        if mechanism.dof_rotates[k]:
            out[k] += dot(load(body.axis, k), torque)
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

"""The hand's side of one step, compiled: hand force, coupling, rendering, device (paper V-C and VI)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iapb.compiled import copy_into, kernel
from iapb.contact.kernels.cholesky import cholesky, solve_mass
from iapb.contact.kernels.narrow_phase import detect
from iapb.contact.kernels.step import LARGEST_SPEED
from iapb.mechanics.kernels import (
    MechanismArrays,
    Workspace,
    add_point_force,
    bias,
    difference,
    forward_kinematics,
    integrate,
    mass_matrix,
)
from iapb.run import FREE

NO_COUPLING, FOUR_CHANNEL, UNILATERAL = 0, 1, 2


class Port(NamedTuple):
    """Hand, coupling and device of one world; d velocities of the world, d_t of the tool and the device."""

    coupling: int  # NO_COUPLING, FOUR_CHANNEL, UNILATERAL
    tool_tree: int  # -1: nobody holds anything
    q_start: int  # the tool's range in q
    q_stop: int
    v_start: int  # and in v
    v_stop: int
    hand_body: int  # held body in the world
    device_body: int  # the same in the device
    hand_point: np.ndarray  # (3,) [m] held point in the body's frame
    wrench: np.ndarray  # (6,) force [N] and torque [N m] of the hand, world axes
    stiffness: np.ndarray  # (d_t,) K [N/m, N m/rad]
    damping: np.ndarray  # (d_t,) B [N s/m, N m s/rad]
    mechanism: MechanismArrays  # the device: kinematically the tool
    body: Workspace
    varying_inertia: bool
    device_q: np.ndarray  # (nq_t,)
    device_v: np.ndarray  # (d_t,)
    device_mass: np.ndarray  # (d_t, d_t)
    device_lower: np.ndarray  # (d_t, d_t)
    device_damping: np.ndarray  # (d_t,) physical damping b of the device
    damped: bool
    force_limit: np.ndarray  # (d_t,) [N, N m], inf = none
    limited: bool  # the actuators clip what they are asked for to force_limit
    resolution: np.ndarray  # (nq_t,) [m, rad] of the position sensors
    quantised: bool
    delayed_force: np.ndarray  # (n + 1, d_t) ring of actuator forces on their way; n = 0: no delay
    delayed_q: np.ndarray  # (n + 1, nq_t) ring of measured positions on their way
    delayed_v: np.ndarray  # (n + 1, d_t)
    sensed_q: np.ndarray  # (nq_t,) what the sensors read
    measured_q: np.ndarray  # (nq_t,) what the simulation knows of the device
    measured_v: np.ndarray  # (d_t,)
    hand_force: np.ndarray  # (d,) of the hand on the tool
    device_hand_force: np.ndarray  # (d_t,) of the hand on the device
    coupling_force: np.ndarray  # (d,) on the tool
    environment_force: np.ndarray  # (d,) F_env (26)
    device_force: np.ndarray  # (d_t,) of the actuators on the device
    applied: np.ndarray  # (d,) hand and coupling together
    error: np.ndarray  # (d_t,) scratch
    acceleration: np.ndarray  # (d_t,) scratch
    engaged: np.ndarray  # (1,) bool: the unilateral coupler is on
    clock: np.ndarray  # (1,) int64: steps done


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
def measure(world, port):
    """What the simulation knows of the device: its state, through quantised sensors and the delay."""
    slots = port.delayed_q.shape[0]
    now = port.clock[0] % slots
    arriving = (port.clock[0] + 1) % slots if port.clock[0] + 1 >= slots else 0  # nothing older than the start
    if port.quantised:
        sense(world, port, port.delayed_v[now])
    else:
        copy_into(port.sensed_q, port.device_q)
        copy_into(port.delayed_v[now], port.device_v)
    copy_into(port.delayed_q[now], port.sensed_q)
    copy_into(port.measured_q, port.delayed_q[arriving])
    copy_into(port.measured_v, port.delayed_v[arriving])


@kernel
def sense(world, port, velocity):
    """Positions rounded to the sensors' resolution, and their difference over one step as velocity.

    Exact where the resolution is 0; at the first reading, which has none to differ from, the velocity is exact too.
    """
    first = port.clock[0] == 0
    for k in range(port.sensed_q.shape[0]):
        step = port.resolution[k]
        read = round(port.device_q[k] / step) * step if step > 0.0 else port.device_q[k]
        exact = first or step == 0.0
        velocity[k] = port.device_v[k] if exact else (read - port.sensed_q[k]) / world.dt
        port.sensed_q[k] = read


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


@kernel
def drive_device(world, state, port):
    """Render F_env (26) and move the device: M ẍ = F_h + F_env,applied − PD − b ẋ. False: it left all bounds."""
    for k in range(port.environment_force.shape[0]):
        contact = state.penalty_force[k] + state.friction_force[k]
        port.environment_force[k] = contact + state.impulse[k] / world.dt
    if port.coupling == NO_COUPLING:
        return True
    command(port)
    a = port.acceleration
    for i in range(a.shape[0]):
        a[i] = port.device_hand_force[i] + port.device_force[i]
        if port.damped:
            a[i] -= port.device_damping[i] * port.device_v[i]
    finite = True
    if port.varying_inertia:
        forward_kinematics(port.mechanism, port.device_q, port.body)
        mass_matrix(port.mechanism, port.body, port.device_mass)
        finite = cholesky(port.device_mass, port.device_lower) == 0
        bias(port.mechanism, port.body, port.device_v, port.error)
        for i in range(a.shape[0]):
            a[i] -= port.error[i]
    solve_mass(port.device_lower, a, a)
    for i in range(a.shape[0]):
        port.device_v[i] += world.dt * a[i]
        finite = finite and abs(port.device_v[i]) < LARGEST_SPEED
    integrate(port.mechanism, port.device_q, port.device_v, world.dt, port.device_q)
    port.clock[0] += 1
    if port.coupling == UNILATERAL and finite:
        engage(world, state, port)
    return finite


@kernel
def command(port):
    """Actuator force: F_env (four channels only) minus the PD, within the device's limits, after the delay."""
    slots = port.delayed_force.shape[0]
    now = port.clock[0] % slots
    for i in range(port.device_force.shape[0]):
        k = port.v_start + i
        force = port.environment_force[k] if port.coupling == FOUR_CHANNEL else 0.0
        force -= port.coupling_force[k]
        if port.limited:
            force = min(max(force, -port.force_limit[i]), port.force_limit[i])
        port.delayed_force[now, i] = force
        port.device_force[i] = port.delayed_force[(port.clock[0] + 1) % slots, i]


@kernel
def engage(world, state, port):
    """The coupler is on while the tool touches or the device is inside a body; else the tool follows the device."""
    port.engaged[0] = state.state_of_tree[port.tool_tree] != FREE or inside(world, state, port)
    if not port.engaged[0]:
        copy_into(state.q[port.q_start : port.q_stop], port.device_q)
        copy_into(state.v[port.v_start : port.v_stop], port.device_v)


@kernel
def inside(world, state, port):
    """Would the tool penetrate something at the device's pose? Uses the stage scratch of the state."""
    copy_into(state.start_q, state.q)
    copy_into(state.start_q[port.q_start : port.q_stop], port.device_q)
    forward_kinematics(world.mechanism, state.start_q, state.body)
    count = detect(world.shapes, world.pairs, state.body.rotation, state.body.position, 0.0, state.stage_contacts)
    for i in range(max(count, 0)):
        a, b = state.stage_contacts.body_a[i], state.stage_contacts.body_b[i]
        if world.tree_of_body[a] == port.tool_tree or (b >= 0 and world.tree_of_body[b] == port.tool_tree):
            return True
    return False

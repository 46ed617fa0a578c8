"""Compiled kernels of the haptic side of a step: hand force, coupling, rendering, device (paper V-C
and VI)."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from iapb.contact.kernels.contact_set import trees_of
from iapb.contact.kernels.motion import LARGEST_SPEED, place_bodies
from iapb.contact.kernels.narrow_phase import detect
from iapb.mechanics.kernels.arrays import MechanismArrays, Workspace
from iapb.mechanics.kernels.configuration import (
    difference,
    integrate,
    integrate_body,
    is_vector,
    own_count,
)
from iapb.mechanics.kernels.dynamics import bias, mass_matrix
from iapb.mechanics.kernels.free_motion import RIGID, FreeMotion, move_simple_trees
from iapb.mechanics.kernels.kinematics import add_point_force, forward_kinematics
from iapb.numerics.compiled import copy_into, kernel
from iapb.numerics.linalg import cholesky, dot, load, placed, solve_mass, three
from iapb.numerics.schema import (
    Booleans,
    FloatPerTool,
    FloatPerToolCoordinate,
    FloatPerVelocity,
    Floats,
    Integers,
    SingleInteger,
)
from iapb.run import FREE

NO_COUPLING = 0
FOUR_CHANNEL = 1
UNILATERAL = 2
PLANNED = 512  # steps for which a time-varying hand force is planned ahead; no chunk is longer


class Port(NamedTuple):
    """Hand, coupling and device of one world; `iapb.system` makes it from the fields."""

    coupling: int  # NO_COUPLING, FOUR_CHANNEL, UNILATERAL
    hand: bool  # whether a hand holds the tool
    tool_tree: int  # -1: no tool is held
    q_start: int  # the tool's range in q
    q_stop: int
    v_start: int  # and in v
    v_stop: int
    hand_body: int  # held body in the world
    device_body: int  # the same in the device
    hand_point: Annotated[Floats, "3"]  # [m] held point in the body's frame
    wrench: Annotated[Floats, "6"]  # force [N] and torque [N m] of the hand, world axes
    # the wrench of the coming steps; empty: it does not change
    planned: Annotated[Floats, "planned 6"]
    stiffness: FloatPerTool  # K [N/m, N m/rad]
    damping: FloatPerTool  # B [N s/m, N m s/rad]
    mechanism: MechanismArrays  # the device: kinematically the tool
    body: Workspace
    varying_inertia: bool
    free: FreeMotion  # of the device alone
    trees: Annotated[Integers, "tool_body"]  # zeros: the device is one tree
    device_q: FloatPerToolCoordinate
    device_v: FloatPerTool
    device_mass: Annotated[Floats, "tool tool"]
    device_lower: Annotated[Floats, "tool tool"]
    device_damping: FloatPerTool  # physical damping b of the device
    # [N, N m] to which the actuators clip the commanded force, inf = none
    force_limit: FloatPerTool
    # [m, rad] of the position sensors, in the tangent where q is no vector
    resolution: FloatPerTool
    quantised: bool
    # ring of actuator forces on their way; one slot: no delay
    delayed_force: Annotated[Floats, "slot tool"]
    delayed_q: Annotated[Floats, "slot tool_coordinate"]  # ring of measured positions on their way
    delayed_v: Annotated[Floats, "slot tool"]
    sensed_q: FloatPerToolCoordinate  # positions read by the sensors
    # position of the device as the simulation reads it
    measured_q: FloatPerToolCoordinate
    measured_v: FloatPerTool
    hand_force: FloatPerVelocity  # of the hand on the tool
    device_hand_force: FloatPerTool  # of the hand on the device
    coupling_force: FloatPerVelocity  # on the tool
    environment_force: FloatPerVelocity  # F_env (26)
    device_force: FloatPerTool  # of the actuators on the device
    applied: FloatPerVelocity  # sum of hand and coupling force
    error: FloatPerTool  # scratch
    acceleration: FloatPerTool  # scratch
    engaged: Annotated[Booleans, "1"]  # the unilateral coupler is on
    clock: SingleInteger  # steps done


# Measurement of the device: quantised sensors and delay.


@kernel
def measure(world, port):
    """Write the state of the device as the simulation reads it: quantised by the sensors, and
    delayed."""
    slots = len(port.delayed_q)
    now = port.clock[0] % slots
    # nothing older than the start
    arriving = (port.clock[0] + 1) % slots if port.clock[0] + 1 >= slots else 0
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
    """Write positions rounded to the sensors' resolution (0: exact), velocities from their
    difference over a step.

    The first velocity is exact. Sensors of quaternions and of (cos, sin) count whole steps in the
    joint's tangent.
    """
    first = port.clock[0] == 0
    m = port.mechanism
    difference(m, port.sensed_q, port.device_q, port.error)
    for b in range(m.bodies):
        i = m.q_start[b]
        k = m.v_start[b]
        vector = is_vector(m.kind[b])
        for j in range(own_count(m, b)):
            step = port.resolution[k + j]
            exact = step == 0.0
            moved = port.error[k + j]
            if vector:
                read = port.device_q[i + j] if exact else round(port.device_q[i + j] / step) * step
                moved = read - port.sensed_q[i + j]
                port.sensed_q[i + j] = read
            elif not exact:
                moved = round(moved / step) * step
            port.error[k + j] = moved
            velocity[k + j] = port.device_v[k + j] if first or exact else moved / world.dt
        if not vector:
            integrate_body(m, b, port.sensed_q, port.error, 1.0, port.sensed_q)


# The forces on the tool in one step: the hand's and the position channels' (paper VI).


@kernel
def couple(world, state, port):
    """Write the forces on the tool for this step: the hand's J_hᵀF_h and the position channels' PD.

    The hand acts on the tool and on the device, each at its own pose.
    """
    if not port.hand:
        return  # `applied` holds the zeros that it was made with
    port.hand_force[:] = port.device_hand_force[:] = 0.0
    pushing = False
    for k in range(len(port.wrench)):
        pushing = pushing or port.wrench[k] != 0.0
    if pushing:
        place_bodies(world, state)
        press(world.mechanism, state.body, port.hand_body, port, port.hand_force)
        if port.coupling != NO_COUPLING:
            forward_kinematics(port.mechanism, port.device_q, port.body)
            press(port.mechanism, port.body, port.device_body, port, port.device_hand_force)
    if port.coupling != NO_COUPLING:
        measure(world, port)
        coordinate(state, port)
    for k in range(len(port.applied)):
        port.applied[k] = port.hand_force[k] + port.coupling_force[k]
    if port.coupling == UNILATERAL and port.engaged[0]:
        # the hand reaches a coupled tool through the coupler only
        for k in range(port.v_start, port.v_stop):
            port.applied[k] = port.coupling_force[k]


@kernel
def press(mechanism, body, held, port, out):
    """Add J_hᵀF_h of the wrench at the held point to `out`."""
    torque = three(port.wrench, 3)
    point = placed(body, held, three(port.hand_point, 0))
    add_point_force(mechanism, body, held, point, three(port.wrench, 0), out)
    k = mechanism.last_dof[held]
    while k >= 0:
        if mechanism.dof_rotates[k]:
            out[mechanism.dof_leader[k]] += mechanism.dof_ratio[k] * dot(load(body.axis, k), torque)
        k = mechanism.dof_parent[k]


@kernel
def coordinate(state, port):
    """Write the PD force of the position channels on the tool; its opposite acts on the device."""
    port.coupling_force[:] = 0.0
    if port.coupling == UNILATERAL and not port.engaged[0]:
        return
    difference(port.mechanism, state.q[port.q_start : port.q_stop], port.measured_q, port.error)
    for i in range(len(port.error)):
        k = port.v_start + i
        rate = port.measured_v[i] - state.v[k]
        port.coupling_force[k] = port.stiffness[i] * port.error[i] + port.damping[i] * rate


# Rendering and device: F_env (26), the actuator force that renders it, and the device's motion
# (paper V-C, VI).


@kernel
def render(world, state, port):
    """Write F_env (26) of this step, and the actuator force that renders it."""
    for k in range(len(port.environment_force)):
        contact = state.penalty_force[k] + state.friction_force[k]
        port.environment_force[k] = contact + state.impulse[k] / world.dt
    if port.coupling != NO_COUPLING:
        command(port)


@kernel
def command(port):
    """Write the actuator force: F_env (four-channel only) minus the PD, clipped to the device's
    limits and delayed."""
    slots = len(port.delayed_force)
    now = port.clock[0] % slots
    for i in range(len(port.device_force)):
        k = port.v_start + i
        force = (
            port.environment_force[k] if port.coupling == FOUR_CHANNEL else 0.0
        ) - port.coupling_force[k]
        port.delayed_force[now, i] = min(max(force, -port.force_limit[i]), port.force_limit[i])
        port.device_force[i] = port.delayed_force[(port.clock[0] + 1) % slots, i]


@kernel
def move_device(world, state, port):
    """Integrate M ẍ = F_h + F_env,applied − PD − b ẋ by semi-implicit Euler; return False if the
    motion diverged.

    A free body as device keeps its momentum, as the tool does, where the world's integrator does.
    """
    a = port.acceleration
    for i in range(len(a)):
        a[i] = (
            port.device_hand_force[i]
            + port.device_force[i]
            - port.device_damping[i] * port.device_v[i]
        )
    finite = True
    if port.varying_inertia:
        forward_kinematics(port.mechanism, port.device_q, port.body)
        mass_matrix(port.mechanism, port.body, port.device_mass)
        finite = cholesky(port.device_mass, port.device_lower) == 0
        bias(port.mechanism, port.body, port.device_v, port.error)
        for i in range(len(a)):
            a[i] -= port.error[i]
    solve_mass(port.device_lower, a, a)
    for i in range(len(a)):
        port.device_v[i] += world.dt * a[i]
        finite = finite and abs(port.device_v[i]) < LARGEST_SPEED
    if world.conserving and port.free.kind[0] == RIGID:
        move_simple_trees(
            port.mechanism, port.free, port.trees, port.device_q, port.device_v, world.dt
        )
    else:
        integrate(port.mechanism, port.device_q, port.device_v, world.dt, port.device_q)
    port.clock[0] += 1
    if port.coupling == UNILATERAL and finite:
        engage(world, state, port)
    return finite


@kernel
def read_device(world, state, port, q, v):
    """Take a reading of a device that the hand moves; the coupler engages for every one but the
    first."""
    copy_into(port.device_q, q)
    copy_into(port.device_v, v)
    if port.clock[0] > 0 and port.coupling == UNILATERAL:
        engage(world, state, port)
    port.clock[0] += 1


@kernel
def engage(world, state, port):
    """Engage the coupler if the tool touches a body or would at the device's pose; else move the
    tool to the device."""
    port.engaged[0] = state.state_of_tree[port.tool_tree] != FREE or inside(world, state, port)
    if not port.engaged[0]:
        copy_into(state.q[port.q_start : port.q_stop], port.device_q)
        copy_into(state.v[port.v_start : port.v_stop], port.device_v)


@kernel
def inside(world, state, port):
    """Return whether the tool would penetrate a body at the device's pose; uses the scratch of the
    state."""
    copy_into(state.scratch_q, state.q)
    copy_into(state.scratch_q[port.q_start : port.q_stop], port.device_q)
    forward_kinematics(world.mechanism, state.scratch_q, state.body)
    count = detect(
        world.shapes,
        world.pairs,
        state.body,
        0.0,
        state.scratch_contacts,
    )
    touches = False
    for i in range(count):
        touches = touches or port.tool_tree in trees_of(world, state.scratch_contacts, i)
    return touches

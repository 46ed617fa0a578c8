"""Rendering and device: F_env (26), what the actuators give of it, and how the device moves (paper V-C, VI)."""

from __future__ import annotations

from iapb.compiled import copy_into, kernel
from iapb.contact.kernels.narrow_phase import detect
from iapb.contact.kernels.step import LARGEST_SPEED
from iapb.haptics.kernels.port import FOUR_CHANNEL, NO_COUPLING, UNILATERAL
from iapb.haptics.kernels.pulse import observe_work, shape_impulse
from iapb.mechanics.kernels import bias, forward_kinematics, integrate, mass_matrix
from iapb.mechanics.kernels.cholesky import cholesky, solve_mass
from iapb.run import FREE


@kernel
def drive_device(world, state, port):
    """Render F_env (26) and move the device. False: it left all bounds."""
    render(world, state, port)
    return port.coupling == NO_COUPLING or move_device(world, state, port)


@kernel
def render(world, state, port):
    """F_env (26) of this step, and what the actuators are to give of it."""
    for k in range(port.environment_force.shape[0]):
        contact = state.penalty_force[k] + state.friction_force[k]
        port.environment_force[k] = contact + state.impulse[k] / world.dt
    if port.coupling == NO_COUPLING:
        return
    if port.pulsed:
        shape_impulse(world, state, port)
    command(port)


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
def move_device(world, state, port):
    """M ẍ = F_h + F_env,applied − PD − b ẋ by semi-implicit Euler. False: it left all bounds."""
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
    if port.pulsed:
        observe_work(world, port)
    integrate(port.mechanism, port.device_q, port.device_v, world.dt, port.device_q)
    port.clock[0] += 1
    if port.coupling == UNILATERAL and finite:
        engage(world, state, port)
    return finite


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

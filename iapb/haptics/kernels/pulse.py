"""An impulse handed out over many steps, and the observer that keeps it from making energy."""

from __future__ import annotations

from iapb.compiled import kernel


@kernel
def shape_impulse(world, state, port):
    """Hand the step's impulse out by the waveform's weights, and give what is due now in its place.

    Passivity observer: the pulses may give the device no more energy than the tool's collisions took. Where they
    would, this step's share waits for the next step: no momentum is lost.
    """
    slots = port.pulse_weights.shape[0]
    now = port.clock[0] % slots
    power = hand_out(world, state, port, now)
    for line in range(state.impacts.logged[0]):
        if state.impacts.group[line] == state.island_of_tree[port.tool_tree]:
            port.pulse_balance[0] += state.impacts.energy_lost[line]
    hold = power > 0.0 and port.pulse_balance[0] < world.dt * power
    port.pulse_held[0] += hold
    for i in range(port.pulse_force.shape[0]):
        due = port.pulse_pending[now, i]
        port.pulse_pending[now, i] = 0.0
        if hold:
            port.pulse_pending[(now + 1) % slots, i] += due
            due = 0.0
        port.pulse_force[i] = due
        port.environment_force[port.v_start + i] += due - state.impulse[port.v_start + i] / world.dt


@kernel
def hand_out(world, state, port, now):
    """Add the step's impulse to what is pending; return the power [W] of what is due now on the moving device."""
    slots = port.pulse_weights.shape[0]
    power = 0.0
    for i in range(port.pulse_force.shape[0]):
        force = state.impulse[port.v_start + i] / world.dt
        if force != 0.0:
            for j in range(slots):
                port.pulse_pending[(now + j) % slots, i] += port.pulse_weights[j] * force
        power += port.pulse_pending[now, i] * port.device_v[i]
    return power


@kernel
def observe_work(world, port):
    """Take the work of the step's pulses from the balance: force times the mean velocity of the step."""
    for i in range(port.pulse_force.shape[0]):
        mean = port.device_v[i] - 0.5 * world.dt * port.acceleration[i]
        port.pulse_balance[0] -= world.dt * port.pulse_force[i] * mean

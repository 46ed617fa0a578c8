"""What the simulation knows of the device: through quantised sensors, and late."""

from __future__ import annotations

from iapb.compiled import copy_into, kernel


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

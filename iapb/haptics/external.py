"""A device that moves by itself in place of the compiled one: read, checked, told its force."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from iapb.compiled import Entry
from iapb.errors import ArgumentError, IapbError
from iapb.haptics.device import Device, SimulatedDevice
from iapb.haptics.kernels import NO_COUPLING, UNILATERAL, engage, observe_work


class DeviceLink:
    """Carries force and reading between a device and the port of a simulation.

    The device is late and coarse by itself: the port has neither delay nor sensors (`make_port` with ``external``).

    Parameters
    ----------
    device : Device
        Of the coordinates of the hand-held tool.
    world, state, port : the simulation's blocks.
    """

    def __init__(self, device: Device, world: Any, state: Any, port: Any) -> None:
        if port.coupling == NO_COUPLING:
            raise ArgumentError("device", device, "none without a coupling to it: the hand holds the tool itself")
        if not callable(getattr(device, "read", None)) or not callable(getattr(device, "apply", None)):
            raise ArgumentError("device", device, "an object with read() and apply(force), see iapb.haptics.device")
        self.device, self._world, self._state, self._port = device, world, state, port
        self._engage, self._observe = Entry(engage), Entry(observe_work)
        self._read()

    def send(self) -> None:
        """Let the actuators give ``port.device_force``; a simulated device feels the simulated hand, too."""
        if isinstance(self.device, SimulatedDevice):
            self.device.hand_force = self._port.device_hand_force.copy()
        self.device.apply(self._port.device_force.copy())

    def receive(self) -> None:
        """Read where the device is at the end of the step, and do what `move_device` does with it."""
        world, state, port = self._world, self._state, self._port
        before = port.device_v.copy()
        self._read()
        if port.pulsed:
            port.acceleration[:] = (port.device_v - before) / world.dt
            self._observe(world, port)
        port.clock[0] += 1
        if port.coupling == UNILATERAL:
            self._engage(world, state, port)

    def release(self) -> None:
        """Take the force away, so that no real device goes on pulling when nobody computes any more."""
        self.device.apply(np.zeros_like(self._port.device_force))

    def _read(self) -> None:
        reading = self.device.read()
        _put("q", reading.q, self._port.device_q)
        _put("v", reading.v, self._port.device_v)


def _put(name: str, values: ArrayLike, target: Any) -> None:
    read = np.asarray(values, np.float64)
    if read.shape != target.shape or not np.all(np.isfinite(read)):
        raise IapbError(f"the device read {name} = {values!r}: expected {len(target)} finite numbers")
    target[:] = read

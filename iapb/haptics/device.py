"""The haptic device: the protocol of any device, and a simulated device (paper section VI: pure
inertia).

Coordinates are those of the hand-held tool, to which the device is kinematically equal. The
compiled loop simulates its device in `iapb.haptics.rendering`; `SimulatedDevice` is the same
device, with a constant mass matrix, for loops and laws written in Python.
"""

from __future__ import annotations

from collections import deque
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from iapb.errors import ArgumentError
from iapb.haptics.rendering import NO_COUPLING, read_device
from iapb.mechanics.bodies import finite_array
from iapb.numerics.compiled import Entry
from iapb.numerics.linalg import cholesky, solve_mass
from iapb.numerics.schema import Floats


class DeviceReading(NamedTuple):
    """Position and velocity of the device as the simulation reads them (d coordinates)."""

    q: Floats  # (d,) [m, rad]
    v: Floats  # (d,) [m/s, rad/s]


class Device(Protocol):
    """A haptic device: it reports its position and velocity and applies a force for one step."""

    def read(self) -> DeviceReading:
        """Return the last measured position and velocity."""
        ...

    def apply(self, force: ArrayLike) -> None:
        """Apply the generalized force (d,) [N, N m] with the actuators for one step."""
        ...


class SimulatedDevice:
    """Inertia with damping, M ẍ = F_hand + F_actuator − b ẋ, by semi-implicit Euler, with delay,
    limits and sensors.

    Parameters
    ----------
    mass_matrix : (d, d)
        Symmetric positive definite [kg, kg m²].
    q, v : (d,)
        Initial position and velocity.
    dt : float [s]
        Step length > 0.
    damping : (d,)
        Physical damping b >= 0 [N s/m, N m s/rad].
    force_limit : (d,)
        The actuators clip each component to ±limit [N, N m].
    delay : int
        Delay [steps] of readings on their way to the simulation, and of forces on their way to the
        actuators.
    resolution : (d,)
        Resolution of the position sensors [m, rad], 0 = exact. Above 0, the velocity reading is the
        difference of two successive position readings over dt: it changes in steps of resolution /
        dt.

    Attributes
    ----------
    q, v : (d,)
        True position and velocity.
    hand_force : (d,)
        Force of the hand on the device [N, N m]; it may be set at any time.
    """

    def __init__(
        self,
        mass_matrix: ArrayLike,
        q: ArrayLike,
        v: ArrayLike = 0.0,
        *,
        dt: float,
        damping: ArrayLike = 0.0,
        force_limit: ArrayLike = np.inf,
        delay: int = 0,
        resolution: ArrayLike = 0.0,
    ) -> None:
        mass = np.array(mass_matrix, np.float64)
        self._lower = np.zeros_like(mass)
        if not mass.ndim or mass.shape != mass.shape[:1] * 2 or cholesky(mass, self._lower) != 0:
            raise ArgumentError(
                "mass_matrix", mass_matrix, "a symmetric positive definite matrix (d, d)"
            )
        size = len(mass)
        self.q = np.full(size, q)
        self.v = np.full(size, v)
        self.hand_force = np.zeros(size)
        self._damping, self._limit, self._resolution = (
            np.full(size, x) for x in (damping, force_limit, resolution)
        )
        self._dt = dt
        self._readings = deque(
            [DeviceReading(self._sensed(), self.v.copy())] * (delay + 1), delay + 1
        )
        self._forces = deque([np.zeros(size)] * delay)

    def read(self) -> DeviceReading:
        """Return position and velocity as the simulation reads them: quantised and `delay` steps
        old."""
        return self._readings[0]

    def apply(self, force: ArrayLike) -> None:
        """Advance one step under the hand and the actuators; `force` is clipped and acts `delay`
        steps later."""
        commanded = finite_array("force", force, self.q.shape)
        self._forces.append(np.clip(commanded, -self._limit, self._limit))
        total = self.hand_force + self._forces.popleft() - self._damping * self.v
        before = self._sensed()
        solve_mass(self._lower, total, total)
        self.v = self.v + self._dt * total
        self.q = self.q + self._dt * self.v
        sensed = self._sensed()
        velocity = np.where(self._resolution > 0.0, (sensed - before) / self._dt, self.v)
        self._readings.append(DeviceReading(sensed, velocity))

    def _sensed(self) -> Floats:
        step = self._resolution
        return np.where(
            step > 0.0, np.round(self.q / np.where(step > 0.0, step, 1.0)) * step, self.q
        )


class DeviceLink:
    """Transfers forces and readings between a device and the port of a simulation.

    Delay and sensors belong to the device; the port simulates neither (`make_port` with
    ``external``).

    Parameters
    ----------
    device : Device
        Its coordinates are those of the hand-held tool.
    world, state, port : the simulation's blocks.
    """

    def __init__(self, device: Device, world: Any, state: Any, port: Any) -> None:
        if port.coupling == NO_COUPLING:
            raise ArgumentError(
                "device", device, "None, or a coupling: without one the hand holds the tool"
            )
        if not callable(getattr(device, "read", None)) or not callable(
            getattr(device, "apply", None)
        ):
            raise ArgumentError(
                "device", device, "an object with read() and apply(force), see iapb.haptics.device"
            )
        self.device = device
        self._world = world
        self._state = state
        self._port = port
        self._take = Entry(read_device)
        self._read()

    def exchange(self) -> None:
        """Send ``port.device_force`` to the device, and take its reading.

        A `SimulatedDevice` also gets the force of the simulated hand.
        """
        port = self._port
        if isinstance(self.device, SimulatedDevice):
            self.device.hand_force = port.device_hand_force.copy()
        self.device.apply(port.device_force.copy())
        self._read()

    def release(self) -> None:
        """Set the force to zero, so that a real device does not keep its last force after the
        simulation ends."""
        self.device.apply(np.zeros_like(self._port.device_force))

    def _read(self) -> None:
        reading = self.device.read()
        port = self._port
        q = finite_array("the device read q", reading.q, port.device_q.shape)
        v = finite_array("the device read v", reading.v, port.device_v.shape)
        self._take(self._world, self._state, port, q, v)

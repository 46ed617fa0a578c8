"""A haptic device of your own in the loop: each step reads its position and drives its motors.

Here a made-up handle moves into the wall and back. In `read` and `apply`, call the driver of your
device instead.

Run it: python examples/real_device.py
"""

import math
import time

import numpy as np
from numpy.typing import ArrayLike

from iapb import find_scene, load_scene
from iapb.contact.laws import ImpulseAugmented
from iapb.haptics.coupling import FourChannel
from iapb.haptics.device import DeviceReading
from iapb.simulation import Simulation


class Handle:
    """One axis. A hand moves it 40 mm forth and back in half a second, whatever the motor does."""

    def __init__(self) -> None:
        self.switched_on = time.monotonic()
        self.force = 0.0  # [N] of the motor
        self.largest = 0.0

    def read(self) -> DeviceReading:
        """Return the measured position [m] and velocity [m/s] of the axis."""
        angle = 4.0 * math.pi * (time.monotonic() - self.switched_on)
        position = -0.03 + 0.02 * (1.0 - math.cos(angle))
        velocity = 0.02 * 4.0 * math.pi * math.sin(angle)
        return DeviceReading(np.array([position]), np.array([velocity]))

    def apply(self, force: ArrayLike) -> None:
        """Let the motor push with this force [N] until the next step."""
        self.force = float(np.asarray(force)[0])
        self.largest = max(self.largest, abs(self.force))


scene = load_scene(find_scene("wall_1d"))
device = Handle()
coupling = FourChannel(stiffness=(100.0,), damping=(70.0,))
law = ImpulseAugmented(rendering="saturate")  # no impulse beyond what the motor can
simulation = Simulation(scene, law, coupling, device)
device.switched_on = due = time.monotonic()
try:
    for _ in range(round(0.5 / simulation.system.dt)):
        simulation.step()
        due += simulation.system.dt
        time.sleep(max(0.0, due - time.monotonic()))
finally:
    simulation.link.release()  # else the motor keeps its last force
print(f"The wall pushed the tool back, and the motor the hand, with up to {device.largest:.3g} N.")
print(f"At the end the motor's force is {device.force:g} N.")

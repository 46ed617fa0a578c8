"""The compiled device's sensors: steps of the resolution, velocity from differences, nothing older than the start."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.contact.laws import Penalty
from iapb.haptics.coupling import FourChannel
from iapb.haptics.kernels import couple
from iapb.scene import find_scene, load_scene
from iapb.system import System

RESOLUTION = np.array([1e-3, 2e-3, 0.0])
COUPLING = FourChannel((100.0, 100.0, 0.5), (70.0, 70.0, 0.375))


def test_readings_are_whole_steps_and_velocities_their_differences() -> None:
    scene = load_scene(find_scene("peg_corner")).with_values({"device.position_resolution": RESOLUTION.tolist()})
    system = System(scene)
    world, state, port = system.world_under(Penalty()), system.make_state(), system.make_port(COUPLING)
    fine, rng = RESOLUTION > 0.0, np.random.default_rng(0)
    before = port.device_q.copy()
    for step in range(4):
        port.device_q[:] += rng.uniform(-5e-3, 5e-3, 3)
        port.device_v[:] = rng.normal(size=3)
        port.clock[0] = step  # `drive_device` counts the steps; here nothing moves but by hand
        couple(world, state, port)
        read, steps = port.measured_q, np.round(port.device_q[fine] / RESOLUTION[fine])
        assert read[fine] / RESOLUTION[fine] == pytest.approx(steps, abs=1e-9)
        assert np.all(read[~fine] == port.device_q[~fine])
        differences = (read - before) / world.dt
        expected = np.where(fine & (step > 0), differences, port.device_v)  # the first reading has none to differ from
        assert port.measured_v == pytest.approx(expected, abs=1e-9)
        before = read.copy()

"""The hand's port of whole device loops: the coupler's bound is sharp, and what lies beyond it leaks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from verification.stability.device_port import (
    HALF,
    PRESSES,
    SENSORS,
    DeviceLoop,
    MovedDevice,
    actuator_forces,
    hand_positions,
    leaked,
    needed_damping,
)

COUPLED = DeviceLoop("CBuc", 1000.0, 0.0)


def needed(loop: DeviceLoop, motion: str, share: float) -> float:
    x = hand_positions(loop, motion, share)
    return needed_damping(x, actuator_forces(loop, x), loop.dt) / loop.bound


def test_a_coupler_on_a_rigid_wall_needs_its_bound_and_no_more() -> None:
    assert 0.99 < needed(COUPLED, PRESSES, 1.0) <= 1.0 + 1e-12
    assert needed(replace(COUPLED, damping=50.0), PRESSES, 1.0) <= 1.0 + 1e-12


def test_the_coordination_is_felt_in_the_hand_too() -> None:
    loop = DeviceLoop("PB", 1000.0, 0.0)
    assert needed(loop, PRESSES, 1.0) > 10.0
    x = hand_positions(loop, PRESSES, 1.0)
    share = needed_damping(x, actuator_forces(loop, x), loop.dt) / loop.bound_with_coordination
    assert 0.95 < share < 1.05  # about the sum of the gains, and no bound: the tool moves as well


def test_the_needed_damping_is_the_least_without_a_leak() -> None:
    loop = replace(COUPLED, delay=1)
    x = hand_positions(loop, PRESSES, 0.05)
    forces = actuator_forces(loop, x)
    b = needed_damping(x, forces, loop.dt)
    size = b * float(np.sum(np.diff(x) ** 2)) / loop.dt
    assert leaked(x, forces, b, loop.dt) < 1e-12 * size and leaked(x, forces, 0.99 * b, loop.dt) > 1e-6 * size


def test_in_the_wall_the_coupler_pushes_by_its_gains() -> None:
    loop = replace(COUPLED, damping=20.0)
    x = np.concatenate([np.linspace(-loop.clearance, HALF, 40), np.full(5, HALF)])
    forces = actuator_forces(loop, x)
    assert forces[0] == 0.0  # before it touches
    assert forces[-1] == pytest.approx(-1000.0 * HALF, rel=1e-9)
    rate = (x[38] - x[37]) / loop.dt
    assert forces[38] == pytest.approx(-1000.0 * x[38] - 20.0 * rate, rel=1e-9)


def test_sensors_are_coarse_and_late() -> None:
    delay, resolution = SENSORS["late and coarse"]
    loop = replace(COUPLED, delay=delay, resolution=resolution)
    device = MovedDevice(np.array([0.0, 1.4e-5, 2.6e-5]), loop)
    assert device.read().q[0] == 0.0
    device.apply([1.0])
    assert device.read().q[0] == 0.0  # one step late
    device.apply([2.0])
    reading = device.read()
    assert reading.q[0] == pytest.approx(1e-5, rel=1e-12) and reading.v[0] == pytest.approx(1e-5 / loop.dt, rel=1e-12)
    assert device.held_forces(delay).tolist() == [0.0, 1.0]

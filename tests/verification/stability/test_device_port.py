"""The hand's port of whole device loops: the coupler's bound is sharp, and what lies beyond it leaks; what is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from verification.check import Study
from verification.finding import MIXED, NOT_TESTABLE, REFUTED, REPRODUCED
from verification.stability import device_port
from verification.stability.device_port import (
    CROSSES,
    HALF,
    PORT,
    PRESSES,
    SENSORS,
    DeviceLoop,
    MovedDevice,
    actuator_forces,
    coordinated,
    coupled,
    hand_positions,
    leaked,
    needed_damping,
)
from verification.stability.peg import PEG, peg

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


@pytest.fixture
def leaks(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, object]]:
    """Rows of made-up loops: damping needed, as a share of the bound."""
    monkeypatch.setitem(device_port.SPEEDS, "quick", (1.0,))
    found = []
    for world, sensors, kind, share in (
        ("CBuc", "ideal", PRESSES, 0.9), ("CBuc", "ideal", CROSSES, 2.0), ("CBuc", "late", PRESSES, 4.0),
        ("PB", "ideal", PRESSES, 70.0 / COUPLED.bound),
    ):
        monkeypatch.setattr(device_port, "needed_damping", lambda *_, b=share * COUPLED.bound: b)
        found.append(PORT.row(Study(), ((world, 1000.0, 0.0), sensors, kind)))
    return found


def test_a_pressing_hand_that_needs_more_than_the_bound_refutes_it(leaks) -> None:
    """A hand that crosses the surface needs more than the bound, so that energy comes out at it."""
    assert coupled(PORT.table_of(leaks)).verdict == MIXED
    assert "70 to 70 N s/m" in coordinated(PORT.table_of(leaks)).sentence
    leaks[0]["needed / bound"] = 1.001
    assert coupled(PORT.table_of(leaks)).verdict == REFUTED
    assert leaks[1]["leak at the bound [mJ]"] > 0.0 and 0.0 < leaks[1]["leak / energy exchanged"] < 1.0


@pytest.mark.parametrize(("times", "verdict"), [
    ((2.0, 1.0, 2.0, 2.0), REPRODUCED), ((None, 1.0, 1.0, 2.0), MIXED), ((1.0, 2.0, 1.0, None), REFUTED),
    ((None, None, None, None), NOT_TESTABLE),
])
def test_the_peg_rests_no_later_with_impulses(times, verdict) -> None:
    assert peg(PEG.table_of({"settles after [s]": time, "bounces": 1} for time in times)).verdict == verdict

"""The simulated device: pure inertia, limits, delay and sensors."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.errors import ArgumentError
from iapb.haptics.device import SimulatedDevice

DT = 1.0 / 512.0
MASS = np.array([[2.0, 0.0, 0.1], [0.0, 2.0, 0.0], [0.1, 0.0, 0.5]])
REST = np.zeros(3)

forces = st.lists(st.lists(st.floats(-20.0, 20.0), min_size=3, max_size=3), min_size=1, max_size=12)


@given(forces)
def test_momentum_changes_by_the_impulse_of_the_forces(forces):
    device = SimulatedDevice(MASS, REST, dt=DT)
    device.hand_force = np.array([0.3, -0.4, 0.1])
    for force in forces:
        device.apply(force)
    expected = DT * (np.sum(forces, axis=0) + len(forces) * device.hand_force)
    assert MASS @ device.v == pytest.approx(expected, abs=1e-12)
    assert np.array_equal(device.read().q, device.q) and np.array_equal(device.read().v, device.v)


@given(forces, st.integers(0, 5))
def test_delay_shifts_forces_and_readings_by_its_steps(forces, delay):
    late, prompt = SimulatedDevice(MASS, REST, dt=DT, delay=delay), SimulatedDevice(MASS, REST, dt=DT)
    history = [prompt.q]
    for force in forces:
        late.apply(force)
    for force in forces[: max(len(forces) - delay, 0)]:
        prompt.apply(force)
        history.append(prompt.q)
    assert late.q == pytest.approx(history[-1], abs=0.0)  # the device does what it was told `delay` steps ago
    assert late.read().q == pytest.approx(history[max(len(history) - 1 - delay, 0)], abs=0.0)


@given(forces)
def test_actuators_clip_and_the_hand_does_not(forces):
    limit = np.array([15.0, 15.0, 1.0])
    device, clipped = SimulatedDevice(MASS, REST, dt=DT, force_limit=limit), SimulatedDevice(MASS, REST, dt=DT)
    device.hand_force = clipped.hand_force = np.array([50.0, 0.0, 0.0])
    for force in forces:
        device.apply(force)
        clipped.apply(np.clip(force, -limit, limit))
    assert np.array_equal(device.q, clipped.q)


@given(st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3), st.floats(1e-6, 1e-2))
def test_a_reading_is_a_multiple_of_the_resolution_and_half_a_step_off_at_most(start, step):
    device = SimulatedDevice(MASS, start, [0.3, -0.2, 0.1], dt=DT, resolution=[step, step, 0.0])
    device.apply(REST)
    read = device.read()
    assert np.abs(read.q[:2] - device.q[:2]).max() <= 0.5 * step * (1.0 + 1e-9)
    assert read.q[:2] / step == pytest.approx(np.round(read.q[:2] / step), abs=1e-6)
    assert read.q[2] == device.q[2] and read.v[2] == device.v[2]
    assert np.abs(read.v[:2] - device.v[:2]).max() <= step / DT * (1.0 + 1e-9)  # it jumps by one step at most


def test_physical_damping_takes_energy():
    device = SimulatedDevice(MASS, REST, [1.0, -1.0, 2.0], dt=DT, damping=[5.0, 5.0, 0.5])
    energies = []
    for _ in range(50):
        energies.append(device.v @ MASS @ device.v)
        device.apply(REST)
    assert all(later < before for before, later in zip(energies, energies[1:], strict=False))


@pytest.mark.parametrize(
    ("argument", "settings"),
    [
        ("mass_matrix", {"mass_matrix": -MASS}),
        ("mass_matrix", {"mass_matrix": np.triu(MASS)}),
        ("q", {"q": [0.0, 0.0]}),
        ("dt", {"dt": 0.0}),
        ("delay", {"delay": -1}),
        ("damping", {"damping": [-1.0, 0.0, 0.0]}),
        ("force_limit", {"force_limit": [1.0]}),
    ],
)
def test_wrong_arguments_are_named(argument, settings):
    with pytest.raises(ArgumentError) as caught:
        SimulatedDevice(**{"mass_matrix": MASS, "q": REST, "dt": DT, **settings})
    assert caught.value.argument == argument

"""The device, simulated, compiled or real: pure inertia, limits, delay and sensors."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.contact.laws import ImpulseAugmented
from iapb.errors import ArgumentError, IapbError
from iapb.haptics.device import DeviceReading, SimulatedDevice
from iapb.recording import Recorder
from iapb.scene import find_scene, load_scene
from iapb.simulation import Simulation, simulate
from iapb.system import System, coupling_of

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
    late = SimulatedDevice(MASS, REST, dt=DT, delay=delay)
    prompt = SimulatedDevice(MASS, REST, dt=DT)
    history = [prompt.q]
    for force in forces:
        late.apply(force)
    for force in forces[: max(len(forces) - delay, 0)]:
        prompt.apply(force)
        history.append(prompt.q)
    assert late.q == pytest.approx(
        history[-1], abs=0.0
    )  # the device does what it was told `delay` steps ago
    assert late.read().q == pytest.approx(history[max(len(history) - 1 - delay, 0)], abs=0.0)


@given(forces)
def test_actuators_clip_and_the_hand_does_not(forces):
    limit = np.array([15.0, 15.0, 1.0])
    device = SimulatedDevice(MASS, REST, dt=DT, force_limit=limit)
    clipped = SimulatedDevice(MASS, REST, dt=DT)
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
    assert np.abs(read.v[:2] - device.v[:2]).max() <= step / DT * (
        1.0 + 1e-9
    )  # it jumps by one step at most


PEG = load_scene(find_scene("peg_corner")).with_values(
    {
        "bodies.peg.position": [0.0209, -0.0141, 0.08],
        "contact.friction": 0.1,
        "device.force_limit": [3, 3, 0.05],
        "device.damping": [0.5, 0.5, 0],
    }
)
STEPS = 350  # past the fourth collision
LAW = ImpulseAugmented(rendering="saturate")


def device_of(scene):
    """The device of a scene in Python: the same inertia, damping, delay, sensors and limits."""
    system = System(scene)
    device = scene.device
    q, v = system.start
    mass = system.device_mechanism().mass_matrix(q)
    return SimulatedDevice(
        mass,
        q,
        v,
        dt=system.dt,
        damping=device.damping,
        force_limit=device.force_limit,
        delay=device.delay,
        resolution=device.position_resolution or 0.0,
    )


def run_with(scene, coupling, device):
    simulation = Simulation(scene, LAW, coupling_of(scene, coupling), device)
    recorder = Recorder(simulation)
    while recorder.steps < STEPS:
        assert recorder.chunk(STEPS) is None
    return recorder.run("", "")


# Unilateral, the compiled device carries the free tool without delay and sensors: that a real one
# cannot.
CASES = [
    ("four-channel", {}),
    ("unilateral", {}),
    ("four-channel", {"device.delay": 2}),
    ("four-channel", {"device.position_resolution": [1e-5, 1e-5, 0]}),
]


@pytest.mark.parametrize(("coupling", "values"), CASES, ids=str)
def test_a_device_that_moves_by_itself_gives_the_run_of_the_compiled_one(coupling, values):
    scene = PEG.with_values(values)
    ours = simulate(scene, LAW, coupling_of(scene, coupling), steps=STEPS)
    theirs = run_with(scene, coupling, device_of(scene))
    late = values.get("device.delay", 0)
    assert len(ours.impacts.step) > 0 or coupling == "unilateral"
    for name in ("q", "v", "impulse", "coupling_force"):
        assert getattr(theirs, name) == pytest.approx(getattr(ours, name), abs=1e-9), name
    if not values:
        assert theirs.device_q == pytest.approx(ours.device_q, abs=1e-10)
        assert theirs.device_force == pytest.approx(ours.device_force, abs=1e-8)
    if late:  # what is recorded is what was read
        assert theirs.device_q[late:] == pytest.approx(ours.device_q[:-late], abs=1e-9)


class Reads:
    def __init__(self, q):
        self.q = q
        self.told = []

    def read(self):
        return DeviceReading(self.q, np.zeros(3))

    def apply(self, force):
        self.told.append(force)


@pytest.mark.parametrize("q", [[0.0, np.nan, 0.0], [0.0, 0.0], [[0.0, 0.0, 0.0]]])
def test_a_reading_that_is_no_position_stops_the_loop(q):
    device = Reads(np.array([0.03, -0.02, 0.0]))
    simulation = Simulation(PEG, LAW, coupling_of(PEG, "four-channel"), device)
    simulation.step()
    device.q = q
    with pytest.raises(IapbError, match="the device read q.* = .*: expected "):
        simulation.step()


@pytest.mark.parametrize("mass", [np.eye(3)[:, :2], np.ones(3), 1.0, -MASS])
def test_a_mass_matrix_of_another_shape_or_sign_is_refused(mass):
    with pytest.raises(ArgumentError, match="mass_matrix"):
        SimulatedDevice(mass, REST, dt=DT)


def test_a_device_needs_a_coupling_and_its_two_methods():
    with pytest.raises(ArgumentError, match="device = .*None, or a coupling"):
        Simulation(PEG, device=Reads(np.zeros(3)))
    with pytest.raises(ArgumentError, match="read.* and apply"):
        Simulation(PEG, LAW, coupling_of(PEG, "four-channel"), device=object())

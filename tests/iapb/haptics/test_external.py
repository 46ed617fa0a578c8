"""A device that moves by itself: the same run as with the compiled one, and what it reads is checked."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.contact.laws import ImpulseAugmented
from iapb.errors import ArgumentError, IapbError
from iapb.haptics.device import DeviceReading
from iapb.recorder import Recorder
from iapb.scene import find_scene, load_scene
from iapb.simulation import Simulation, simulate
from iapb.system import coupling_of
from reports.live.measure import simulated_device

PEG = load_scene(find_scene("peg_corner")).with_values({
    "bodies.peg.position": [0.0209, -0.0141, 0.08], "contact.friction": 0.1, "device.force_limit": [3, 3, 0.05],
    "device.damping": [0.5, 0.5, 0],
})
STEPS = 350  # past the fourth collision
LAW = ImpulseAugmented(rendering="saturate")


def run_with(scene, coupling, device):
    simulation = Simulation(scene, LAW, coupling_of(scene, coupling), device)
    recorder = Recorder(simulation)
    while recorder.steps < STEPS:
        assert recorder.chunk(STEPS) is None
    return recorder.run("", "")


# Unilateral, the compiled device carries the free tool without delay and sensors: that a real one cannot.
CASES = [("four-channel", {}), ("unilateral", {}), ("four-channel", {"device.delay": 2}),
         ("four-channel", {"device.position_resolution": [1e-5, 1e-5, 0]}),
         ("four-channel", {"device.waveform": "brake"})]


@pytest.mark.parametrize(("coupling", "values"), CASES, ids=str)
def test_a_device_that_moves_by_itself_gives_the_run_of_the_compiled_one(coupling, values):
    scene = PEG.with_values(values)
    ours = simulate(scene, LAW, coupling_of(scene, coupling), steps=STEPS)
    theirs = run_with(scene, coupling, simulated_device(scene))
    late = values.get("device.delay", 0)
    assert len(ours.impacts.step) > 0 or coupling == "unilateral"
    for name in ("q", "v", "impulse", "coupling_force"):
        assert getattr(theirs, name) == pytest.approx(getattr(ours, name), abs=1e-9), name
    if not values:
        assert theirs.device_q == pytest.approx(ours.device_q, abs=1e-10)
        assert theirs.device_force == pytest.approx(ours.device_force, abs=1e-8)
    if late:  # what is recorded is what was read
        assert theirs.device_q[late:] == pytest.approx(ours.device_q[:-late], abs=1e-9)


def test_a_weaker_device_is_noticed():
    """The comparison can fail."""
    weaker = simulated_device(PEG.with_values({"device.damping": [0.6, 0.5, 0]}))
    ours = simulate(PEG, LAW, coupling_of(PEG, "four-channel"), steps=STEPS)
    assert np.abs(run_with(PEG, "four-channel", weaker).q - ours.q).max() > 1e-6


class Reads:
    def __init__(self, q):
        self.q, self.told = q, []

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
    with pytest.raises(IapbError, match="the device read q = .*expected 3 finite numbers"):
        simulation.step()


def test_what_it_is_told_is_within_the_scenes_limits():
    device = Reads(np.array([0.5, -0.5, 1.0]))  # far off: the spring would pull hard
    simulation = Simulation(PEG, LAW, coupling_of(PEG, "four-channel"), device)
    for _ in range(5):
        simulation.step()
    assert np.all(np.abs(device.told) <= [3.0, 3.0, 0.05]) and np.any(np.abs(device.told) == 3.0)


def test_a_device_needs_a_coupling_and_a_tool_of_constant_inertia():
    with pytest.raises(ArgumentError, match="device = .*none without a coupling"):
        Simulation(PEG, device=Reads(np.zeros(3)))
    with pytest.raises(ArgumentError, match="read.* and apply"):
        Simulation(PEG, LAW, coupling_of(PEG, "four-channel"), device=object())
    for name in ("arm_pushing", "two_discs"):
        with pytest.raises(ArgumentError, match="scene"):
            simulated_device(load_scene(find_scene(name)))

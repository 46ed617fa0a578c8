"""Waveforms carry the impulse's momentum, whatever their shape, and give no more energy than the collision took."""

from __future__ import annotations

import numpy as np
import pytest

from iapb import find_scene, load_scene, simulate
from iapb.contact.laws import ImpulseAugmented, Penalty
from iapb.errors import ArgumentError, SceneError
from iapb.haptics.waveforms import MATERIALS, PULSE_SECONDS, WAVEFORMS, waveform_weights
from iapb.simulation import Simulation
from iapb.system import coupling_of

SCENE = load_scene(find_scene("peg_corner"))
SHAPED = [name for name in WAVEFORMS if name != "step"]


def shaped(name, **values):
    scene = SCENE.with_values({"device.waveform": name, "rate": 1000, **values})
    return scene, coupling_of(scene, "four-channel")


@pytest.mark.parametrize("name", WAVEFORMS)
@pytest.mark.parametrize("rate", [1000.0, 4000.0])
def test_weights_sum_to_one(name, rate):
    assert waveform_weights(name, 1.0 / rate).sum() == pytest.approx(1.0, abs=1e-14)


def test_a_brake_is_a_pulse_of_its_length_and_symmetric():
    weights = waveform_weights("brake", 1e-3)
    assert len(weights) == round(PULSE_SECONDS / 1e-3)
    np.testing.assert_allclose(weights, weights[::-1], rtol=1e-12)
    assert weights.min() > 0.0


@pytest.mark.parametrize("material", MATERIALS)
def test_a_material_rings_at_its_frequency_and_fades(material):
    dt = 1e-4
    ringing = waveform_weights(f"ring-{material}", dt)[1:]
    spectrum = np.abs(np.fft.rfft(ringing, 1 << 16))
    peak = np.fft.rfftfreq(1 << 16, dt)[spectrum.argmax()]
    assert peak == pytest.approx(MATERIALS[material].frequency, rel=0.25)
    assert abs(ringing[-1]) < 1e-2 * np.abs(ringing).max()
    assert ringing.sum() == pytest.approx(0.0, abs=1e-12)


def test_a_material_above_half_the_rate_is_refused():
    with pytest.raises(ArgumentError, match="300 Hz cannot be rendered at 512 Hz"):
        waveform_weights("ring-aluminium", 1.0 / 512.0)


def test_an_unknown_waveform_is_refused_where_it_stands():
    with pytest.raises(SceneError, match=r"device\.waveform"):
        SCENE.with_values({"device.waveform": "bell"})


@pytest.mark.parametrize("name", SHAPED)
def test_the_device_gets_exactly_the_momentum_of_the_collisions(name):
    scene, coupling = shaped(name)
    simulation = Simulation(scene, ImpulseAugmented(), coupling)
    given, computed = np.zeros(3), np.zeros(3)
    for _ in range(600):
        simulation.step()
        given += simulation.port.pulse_force * scene.step
        computed += simulation.state.impulse
    pending = simulation.port.pulse_pending.sum(axis=0) * scene.step
    assert np.abs(computed).max() > 0.1
    np.testing.assert_allclose(given + pending, computed, atol=1e-12)


@pytest.mark.parametrize("name", SHAPED)
def test_pulses_give_no_more_energy_than_collisions_took(name):
    scene, coupling = shaped(name)
    run = simulate(scene, ImpulseAugmented(), coupling)
    pulse = run.environment_force - run.penalty_force - run.friction_force
    mean = 0.5 * (run.device_v[1:] + run.device_v[:-1])
    work = np.cumsum(np.sum(pulse * mean, axis=1) * run.dt)
    lost = np.zeros(run.steps)
    np.add.at(lost, run.impacts.step, run.impacts.energy_lost)
    # what the observer cannot see before it lets a pulse go: the device's change of speed within the step
    slack = np.max(np.sum(np.abs(pulse * (run.device_v[1:] - mean)), axis=1) * run.dt)
    assert np.max(work - np.cumsum(lost)) <= slack + 1e-12


def test_the_observer_holds_back_what_would_give_energy_that_no_collision_took():
    scene, coupling = shaped("ring-wood")
    indebted, careless = (Simulation(scene, ImpulseAugmented(), coupling) for _ in range(2))
    indebted.port.pulse_balance[0], careless.port.pulse_balance[0] = -1.0, 1.0  # J; the collisions take millijoules
    for _ in range(600):
        careless.step()
        before = indebted.port.device_v.copy()
        indebted.step()
        assert indebted.port.pulse_force @ before <= 0.0
    assert indebted.port.pulse_held[0] > 0 == careless.port.pulse_held[0]


def test_a_penalty_has_nothing_to_shape():
    scene, coupling = shaped("brake")
    plain = SCENE.with_values({"rate": 1000})
    shaped_run, run = (simulate(s, Penalty(), coupling) for s in (scene, plain))
    np.testing.assert_array_equal(shaped_run.device_q, run.device_q)


def test_a_brake_asks_the_device_for_less_at_once():
    scene, coupling = shaped("brake")
    plain = SCENE.with_values({"rate": 1000})
    peaks = [np.abs(simulate(s, ImpulseAugmented(), coupling).device_force).max() for s in (scene, plain)]
    assert peaks[0] < 0.5 * peaks[1]

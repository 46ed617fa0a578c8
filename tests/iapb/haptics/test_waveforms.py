"""Waveforms carry the impulse's momentum, whatever their shape, and give no more energy than the collision took."""

from __future__ import annotations

import numpy as np
import pytest

from iapb import find_scene, load_scene, simulate
from iapb.contact.laws import ImpulseAugmented, Penalty
from iapb.errors import ArgumentError
from iapb.haptics.waveforms import PULSE_SECONDS, WAVEFORMS, waveform_weights
from iapb.simulation import Simulation
from iapb.system import coupling_of

PLAIN = load_scene(find_scene("peg_corner")).with_values({"rate": 1000})
BRAKE = PLAIN.with_values({"device.waveform": "brake"})
COUPLING = coupling_of(PLAIN, "four-channel")


@pytest.mark.parametrize("rate", [100.0, 1000.0, 4000.0])
def test_weights_sum_to_one_and_a_brake_is_a_symmetric_pulse_of_its_length(rate):
    for name in WAVEFORMS:
        assert waveform_weights(name, 1.0 / rate).sum() == pytest.approx(1.0, abs=1e-14)
    weights = waveform_weights("brake", 1.0 / rate)
    assert len(weights) == max(1, round(PULSE_SECONDS * rate)) and weights.min() > 0.0
    np.testing.assert_allclose(weights, weights[::-1], rtol=1e-12)
    with pytest.raises(ArgumentError, match="waveform = 'bell'"):
        waveform_weights("bell", 1.0 / rate)


def test_the_device_gets_exactly_the_momentum_of_the_collisions():
    simulation = Simulation(BRAKE, ImpulseAugmented(), COUPLING)
    given, computed = np.zeros(3), np.zeros(3)
    for _ in range(600):
        simulation.step()
        given += simulation.port.pulse_force * BRAKE.step
        computed += simulation.state.impulse
    pending = simulation.port.pulse_pending.sum(axis=0) * BRAKE.step
    assert np.abs(computed).max() > 0.1
    np.testing.assert_allclose(given + pending, computed, atol=1e-12)


def test_pulses_give_no_more_energy_than_collisions_took_and_ask_for_less_at_once():
    run = simulate(BRAKE, ImpulseAugmented(), COUPLING)
    pulse = run.environment_force - run.penalty_force - run.friction_force
    mean = 0.5 * (run.device_v[1:] + run.device_v[:-1])
    work = np.cumsum(np.sum(pulse * mean, axis=1) * run.dt)
    lost = np.zeros(run.steps)
    np.add.at(lost, run.impacts.step, run.impacts.energy_lost)
    # what the observer cannot see before it lets a pulse go: the device's change of speed within the step
    slack = np.max(np.sum(np.abs(pulse * (run.device_v[1:] - mean)), axis=1) * run.dt)
    assert np.max(work - np.cumsum(lost)) <= slack + 1e-12
    whole = simulate(PLAIN, ImpulseAugmented(), COUPLING)
    assert np.abs(run.device_force).max() < 0.5 * np.abs(whole.device_force).max()
    plain, shaped = (simulate(scene, Penalty(), COUPLING) for scene in (PLAIN, BRAKE))  # nothing to shape
    np.testing.assert_array_equal(shaped.device_q, plain.device_q)

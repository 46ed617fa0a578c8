"""Orders and energy of the compiled step, measured by halving it: smooth motion, and motion with everything on."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.contact.laws import ImpulseAugmented, Penalty
from iapb.mechanics.integrators import INTEGRATORS
from iapb.scene import find_scene, load_scene
from iapb.simulation import simulate
from iapb.system import coupling_of

PEG = load_scene(find_scene("peg_corner")).with_values({
    "bodies.peg.position": [0.0209, -0.0141, 0.08], "contact.friction": 0.1, "duration": 1.5,
    "contact.coherence_distance": 1e-3,
})
PENDULUM = load_scene(find_scene("double_pendulum")).with_values({"duration": 0.5})


def final_state(integrator, rate):
    run = simulate(PENDULUM.with_values({"rate": rate}), Penalty(integrator))
    return np.concatenate([run.q[-1], run.v[-1]]), run.energy["integration_residual"]


@pytest.mark.parametrize("integrator", INTEGRATORS.values(), ids=lambda each: each.name)
def test_the_compiled_step_has_the_declared_order_on_a_smooth_scene(integrator):
    truth, _ = final_state("runge_kutta_4", 8000)
    rates = (400, 800, 1600)
    errors = [np.linalg.norm(final_state(integrator.name, rate)[0] - truth) for rate in rates]
    measured = np.log2(np.divide(errors[:-1], errors[1:]))
    assert measured[-1] == pytest.approx(integrator.order, abs=0.25)


@pytest.mark.parametrize("integrator", INTEGRATORS.values(), ids=lambda each: each.name)
def test_the_energy_ledger_closes_to_the_order_of_the_integrator(integrator):
    largest = [np.abs(final_state(integrator.name, rate)[1]).max() for rate in (400, 800)]
    assert np.log2(largest[0] / largest[1]) >= integrator.order - 0.25
    assert largest[0] > 1e-13  # there is something to measure


@pytest.mark.parametrize("coupling", ["none", "four-channel"])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_with_contacts_the_ledger_closes_as_the_step_goes_to_zero(integrator, coupling):
    """Collisions, penalties, friction, hand and coupling: nothing is forgotten. Contacts leave order 1 at best."""
    residuals = []
    for rate in (1000, 8000):
        scene = PEG.with_values({"rate": rate})
        run = simulate(scene, ImpulseAugmented(integrator), coupling_of(scene, coupling))
        ledger = run.energy
        through = np.abs(ledger["hand_work"]).max() + np.abs(ledger["impact_loss"]).max()
        residuals.append(np.abs(ledger["integration_residual"]).max() / through)
    assert residuals[1] < residuals[0] / 4.0
    assert residuals[1] < 0.01

"""Couplings of Fig. 5 in the compiled step: action and reaction, dissipation, delay, following."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.contact.laws import Penalty
from iapb.errors import ArgumentError
from iapb.haptics.coupling import FourChannel, UnilateralCoupler
from iapb.scene import find_scene, load_scene
from iapb.simulation import Simulation

FOUR_CHANNEL = FourChannel((100.0, 100.0, 0.5), (70.0, 70.0, 0.375))  # Table I
UNILATERAL = UnilateralCoupler((1000.0, 1000.0, 2.5), (50.0, 50.0, 0.125))
# no wall within reach
FAR = load_scene(find_scene("peg_corner")).with_values({"bodies.peg.position": [1.0, -1.0, 0.08]})


def pair_energies(damping, steps):
    """Energy of tool, device and the spring between them [J], no hand, started 2 cm and 0.1 rad
    apart."""
    simulation = Simulation(FAR.with_values({"hand.force": [0, 0, 0]}), Penalty(), FOUR_CHANNEL)
    state = simulation.state
    port = simulation.port
    port.device_q[:] += [0.02, -0.01, 0.1]
    port.damping[:] *= damping
    energies = []
    for _ in range(steps):
        stretch = port.device_q - state.q
        mass = state.mass_matrix
        kinetic = state.v @ mass @ state.v + port.device_v @ mass @ port.device_v
        energies.append(
            0.5 * (kinetic + np.sum(np.multiply(FOUR_CHANNEL.stiffness, stretch * stretch)))
        )
        simulation.step()
    return np.array(energies)


def test_a_free_pair_loses_energy_in_every_step_until_it_moves_as_one():
    energies = pair_energies(1.0, 1000)
    assert np.all(np.diff(energies) < 0.0) and energies[-1] < 0.01 * energies[0]


@pytest.mark.parametrize("coupling", [FOUR_CHANNEL, UNILATERAL], ids=lambda c: c.name)
def test_in_free_motion_tool_and_device_go_together(coupling):
    simulation = Simulation(FAR, Penalty(), coupling)
    state = simulation.state
    port = simulation.port
    for _ in range(100):
        simulation.step()
    assert port.device_q == pytest.approx(state.q, abs=1e-12)
    assert np.all(np.sign(port.device_v[:2]) == [-1.0, 1.0])  # where the hand pushes


def test_gains_that_make_energy_or_do_not_fit_are_refused():
    with pytest.raises(ArgumentError, match="stiffness"):
        UnilateralCoupler((-1.0,), (1.0,))
    for gains in ((1.0,), (np.nan, 1.0), (np.inf, 1.0), (-1.0, 1.0)):
        with pytest.raises(ArgumentError, match="damping = .*one finite value >= 0"):
            FourChannel((1.0, 1.0), gains)

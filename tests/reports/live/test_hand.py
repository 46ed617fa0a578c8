"""The mouse's spring: towards the target, limited, and it brings the tool there."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.errors import ArgumentError
from iapb.scene import find_scene
from iapb.simulation import Simulation
from reports.live.viewer import SpringHand

FREE = {"bodies.peg.velocity": [0, 0, 0], "bodies.peg.position": [0.4, -0.4, 0.0], "hand.force": [0, 0, 0]}
TARGET = np.array([0.38, -0.43, 0.5])  # planar: its height does not count


def test_it_brings_a_free_tool_to_the_target_with_less_than_its_limit(peg):
    simulation = peg(**FREE)
    hand = SpringHand(simulation)
    gaps, forces = [], []
    assert hand.point() == pytest.approx([0.4, -0.4, 0.0])
    for _ in range(1500):
        simulation.port.wrench[:] = hand.wrench(TARGET)
        forces.append(simulation.port.wrench.copy())
        simulation.step()
        gaps.append(np.linalg.norm(TARGET[:2] - simulation.state.q[:2]))
    assert gaps[-1] < 0.02 * gaps[0] and max(gaps) <= gaps[0] + 1e-9
    assert np.linalg.norm(forces, axis=1).max() <= hand.limit * (1.0 + 1e-12)
    assert not np.any(np.array(forces)[:, 2:])


def test_it_lets_go_to_the_scenes_own_force(peg):
    simulation = peg()
    hand = SpringHand(simulation)
    own = simulation.port.wrench.copy()
    assert np.any(own) and np.any(hand.wrench(TARGET) != own)
    assert np.array_equal(hand.wrench(None), own)


def test_a_scene_without_a_hand_has_nothing_to_pull():
    with pytest.raises(ArgumentError, match="a scene with a hand"):
        SpringHand(Simulation(find_scene("two_discs")))

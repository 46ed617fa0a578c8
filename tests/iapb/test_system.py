"""From a scene to arrays: the tool, the device, the switches, and mistakes that only show here."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.contact.laws import ImpulseAugmented
from iapb.errors import ArgumentError
from iapb.haptics.coupling import FourChannel
from iapb.scene import find_scene, load_scene
from iapb.system import System, coupling_of

PEG = load_scene(find_scene("peg_corner"))
ARM = load_scene(find_scene("arm_pushing"))


@pytest.mark.parametrize("scene", [PEG, ARM], ids=lambda scene: scene.name)
def test_the_device_is_the_hand_held_tree_alone(scene):
    system = System(scene)
    device = system.device_mechanism()
    q = system.make_state().q
    tool = slice(*system.tool_dofs)
    coordinates = slice(*system.tool_coordinates)
    assert device.nv == tool.stop - tool.start
    assert device.mass_matrix(q[coordinates]) == pytest.approx(
        system.mechanism.mass_matrix(q)[tool, tool], abs=1e-15
    )
    port = system.make_port(coupling_of(scene, "four-channel"))
    assert np.array_equal(port.device_q, q[coordinates])


def test_limits_are_those_of_the_tools_coordinates_alone():
    limit = System(ARM).world_under(ImpulseAugmented(rendering="spread")).impulse_limit
    assert limit.tolist() == [5.0, 5.0, np.inf, np.inf, np.inf]


def test_a_device_needs_a_hand():
    with pytest.raises(ArgumentError, match="has no hand, so no device"):
        System(load_scene(find_scene("two_discs"))).make_port(FourChannel((1.0,), (1.0,)))

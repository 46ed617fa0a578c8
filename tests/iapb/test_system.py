"""From a scene to arrays: the tool, the device, the switches, and mistakes that only show here."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.contact.laws import ImpulseAugmented, Penalty
from iapb.errors import ArgumentError
from iapb.haptics.coupling import FourChannel, NoCoupling
from iapb.scene import find_scene, load_scene, scene_names
from iapb.system import System, coupling_of

PEG = load_scene(find_scene("peg_corner"))
ARM = load_scene(find_scene("arm_pushing"))


@pytest.mark.parametrize("name", scene_names())
def test_a_state_starts_where_the_scene_says(name):
    scene = load_scene(find_scene(name))
    system = System(scene)
    state = system.make_state()
    assert state.q.tolist() == [x for body in scene.bodies for x in body.position]
    assert state.v.tolist() == [x for body in scene.bodies for x in body.velocity]
    assert state.mass_matrix == pytest.approx(system.mechanism.mass_matrix(state.q), abs=0.0)
    assert np.tril(state.lower) @ np.tril(state.lower).T == pytest.approx(state.mass_matrix, rel=1e-14)
    assert system.dt == 1.0 / scene.rate


@pytest.mark.parametrize("scene", [PEG, ARM], ids=lambda scene: scene.name)
def test_the_device_is_the_hand_held_tree_alone(scene):
    system = System(scene)
    device, q = system.device_mechanism(), system.make_state().q
    tool, coordinates = slice(*system.tool_dofs), slice(*system.tool_coordinates)
    assert device.nv == tool.stop - tool.start
    assert device.mass_matrix(q[coordinates]) == pytest.approx(system.mechanism.mass_matrix(q)[tool, tool], abs=1e-15)
    port = system.make_port(coupling_of(scene, "four-channel"))
    assert np.array_equal(port.device_q, q[coordinates])


def test_the_tool_is_found_behind_other_bodies():
    """The hand may hold any tree: ranges follow the bodies, not the first place."""
    bodies = [body.model_dump() for body in ARM.bodies]
    turned = ARM.with_values({"bodies": [bodies[2], bodies[0], bodies[1]]})
    assert System(ARM).tool_dofs == (0, 2) and System(turned).tool_dofs == (3, 5)
    first, second = System(ARM).device_mechanism(), System(turned).device_mechanism()
    assert first.names == second.names
    assert first.mass_matrix([0.3, 0.4]) == pytest.approx(second.mass_matrix([0.3, 0.4]), abs=0.0)


def test_worlds_differ_by_what_a_law_sets_and_are_made_once():
    system = System(PEG)
    assert system.world_under(Penalty()) is system.world_under(Penalty())
    laws = [Penalty(), ImpulseAugmented(), ImpulseAugmented(rendering="scale"), ImpulseAugmented("midpoint")]
    assert len({id(system.world_under(law)) for law in laws}) == 4
    switches = [system.world_under(law).switches for law in laws]
    assert [each.impulses for each in switches] == [False, True, True, True]
    assert [each.impulse_limit for each in switches] == [False, False, True, False]
    assert np.all(np.isinf(system.world_under(laws[1]).impulse_limit))
    assert system.world_under(laws[2]).impulse_limit.tolist() == list(PEG.device.force_limit)


def test_limits_are_those_of_the_tools_coordinates_alone():
    limit = System(ARM).world_under(ImpulseAugmented(rendering="spread")).impulse_limit
    assert limit.tolist() == [5.0, 5.0, np.inf, np.inf, np.inf]


def test_couplings_come_from_the_scene_and_their_absence_is_said():
    assert coupling_of(PEG, "four-channel").settings["stiffness"] == [100.0, 100.0, 0.5]
    assert coupling_of(PEG, "none") == NoCoupling()
    with pytest.raises(ArgumentError, match="coupling = 'spring': expected one of none, four-channel, unilateral"):
        coupling_of(PEG, "spring")
    with pytest.raises(ArgumentError, match="two_discs gives no gains"):
        coupling_of(load_scene(find_scene("two_discs")), "unilateral")


def test_a_device_needs_a_hand():
    with pytest.raises(ArgumentError, match="has no hand, so no device"):
        System(load_scene(find_scene("two_discs"))).make_port(FourChannel((1.0,), (1.0,)))


def test_contacts_at_a_pose_are_those_within_the_margin() -> None:
    """A polygon of forty corners on a wall that it is all inside of, beside it, and above it."""
    corners = [[float(np.cos(t)), float(np.sin(t))] for t in 2.0 * np.pi * np.arange(40) / 40]
    peg = PEG.resolved()["bodies"][0]
    wheel = peg | {"shapes": [{"kind": "polygon", "vertices": corners}], "position": [0.0, 0.0, 0.1]}
    floor = {"name": "floor", "kind": "half_plane", "point": [0.0, 0.0], "normal": [0.0, 1.0]}
    system = System(PEG.with_values({"bodies": [wheel], "walls": [floor]}))
    inside, beside = system.contacts_at([0.0, -5.0, 0.1]), system.contacts_at([3.0, 0.5, 0.1])
    heights = -5.0 + np.sin(0.1 + 2.0 * np.pi * np.arange(40) / 40)
    assert np.sort(inside.gap) == pytest.approx(np.sort(heights), abs=1e-14)
    assert 0 < len(beside.gap) < 40 and np.all(beside.gap <= 0.0)
    assert len(system.contacts_at([0.0, 5.0, 0.1]).gap) == 0
    assert len(system.contacts_at([0.0, 5.0, 0.1], np.inf).gap) == 40
    with pytest.raises(ArgumentError, match="margin"):
        system.contacts_at([0.0, 5.0, 0.1], np.nan)

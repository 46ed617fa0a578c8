"""Effects: each can be switched by a scene alone, says why with the scene's values, and heeds the caller's choices."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.advice.effects import COUPLING_FIELDS, EFFECTS, Effect, decide_effects
from iapb.compiled import block
from iapb.contact.laws import ENGINE_LAWS, ImpulseAugmented, Penalty
from iapb.haptics.coupling import FourChannel, UnilateralCoupler
from iapb.scene import Scene, find_scene, load_scene, scene_names
from iapb.simulation import Simulation
from reference.time_stepping import RigidConstraints

PEG = load_scene(find_scene("peg_corner"))
ARM = load_scene(find_scene("arm_pushing"))
PENDULUM = load_scene(find_scene("double_pendulum"))
DISCS = load_scene(find_scene("two_discs"))
CHAIN = {
    "bodies": [
        {"name": name, "parent": parent, "joint": "revolute", "inertia": 1, "shapes": [{"kind": "circle", "radius": 1}]}
        for name, parent in (("one", "world"), ("two", "one"), ("three", "two"))
    ],
    "hand": None, "device": None, "couplings": {}, "contact.self_collisions": True,
}
ONE_LINK = {"bodies": [{"name": "upper", "joint": "revolute", "mass": 1, "center_of_mass": [0.25, 0]}]}
NO_SHAPES = {"bodies.peg.shapes": []}

SWITCHES: dict[str, tuple[Scene, dict[str, Any], dict[str, Any], str]] = {
    "gravity": (PENDULUM, {}, {"gravity": None}, "-9.81"),
    "varying_inertia": (PENDULUM, {}, ONE_LINK, "upper, lower"),
    "velocity_terms": (PENDULUM, {}, ONE_LINK, "upper, lower"),
    "hand_force": (PEG, {}, {"hand.force": [0, 0, 0]}, "[-0.32, 0.4, 0]"),
    "joint_damping": (PENDULUM, {"bodies.upper.joint_damping": 0.25}, {"bodies.upper.joint_damping": 0.0},
                      "upper [0.25]"),
    "joint_limits": (PENDULUM, {"bodies.lower.joint_limits": [-3, 3]}, {}, "lower [-3, 3] rad, m"),
    "wall_contacts": (PEG, {}, {"walls": []}, "2 pairs"),
    "body_contacts": (DISCS, {}, {"bodies.striker.shapes": []}, "1 pair"),
    "self_collisions": (PEG, CHAIN, {**CHAIN, "contact.self_collisions": False}, "1 pair"),
    "impulses": (PEG, {"contact.restitution": 0.25}, NO_SHAPES, "0.25"),
    "unequal_restitution": (PEG, {f"walls.{PEG.walls[0].name}.restitution": 0.75}, {"bodies.peg.restitution": 0.75},
                            "to 0.75"),
    "impact_friction": (PEG, {"contact.friction": 0.3}, {"contact.friction": 0}, "contact.friction = 0.3"),
    "penalty_stiffness": (PEG, {"contact.stiffness": 1234}, {"contact.stiffness": 0}, "1234 N/m"),
    "contact_damping": (PEG, {"contact.damping": 56}, {"contact.damping": 0}, "56 N s/m"),
    "friction": (PEG, {"contact.friction": 0.3}, {"contact.friction": 0}, "contact.friction = 0.3"),
    "clustering": (PEG, {"contact.cluster_distance": 0.002}, {"contact.cluster_distance": 0}, "0.002 m"),
    "coherence": (PEG, {"contact.coherence_distance": 0.003}, {"contact.coherence_distance": 0}, "0.003 m"),
    "coupling": (PEG, {}, {"couplings": {}}, "[100, 100, 0.5]"),
    "device_limits": (PEG, {}, {"device": None}, "[15, 15, 1]"),
    "delay": (PEG, {"device.delay": 4}, {"device.delay": 0}, "4 steps, 7.8125 ms"),
    "quantisation": (PEG, {"device.position_resolution": [1e-5, 1e-5, 0]}, {}, "[1e-05, 1e-05, 0]"),
    "device_damping": (PEG, {"device.damping": [0.5, 0.5, 0]}, {"device.damping": [0, 0, 0]}, "[0.5, 0.5, 0]"),
    "waveform": (PEG, {"device.waveform": "brake"}, {"device.waveform": "step"}, "device.waveform = brake"),
}


def effect(scene: Scene, name: str, *choices: Any) -> Effect:
    return next(found for found in decide_effects(scene, *choices) if found.name == name)


def test_every_effect_is_switched_below() -> None:
    assert [found.name for found in decide_effects(PEG)] == list(SWITCHES)
    assert len(EFFECTS) == len(SWITCHES)


@pytest.mark.parametrize("name", SWITCHES)
def test_a_scene_alone_switches_the_effect_and_the_reason_has_its_values(name: str) -> None:
    scene, on, off, values = SWITCHES[name]
    switched_on, switched_off = effect(scene.with_values(on), name), effect(scene.with_values(off), name)
    assert switched_on.active
    assert values in switched_on.reason
    assert not switched_off.active
    assert switched_off.reason != switched_on.reason
    assert switched_on.left_out


@pytest.mark.parametrize("law", [Penalty(), RigidConstraints()])
def test_laws_without_impulses_switch_them_off_and_are_named(law: Any) -> None:
    found = effect(PEG, "impulses", law)
    assert not found.active
    assert law.name in found.reason


def test_rigid_constraints_use_no_penalty_and_no_friction() -> None:
    rough = PEG.with_values({"contact.friction": 0.3})
    for name in ("penalty_stiffness", "contact_damping", "friction"):
        assert effect(rough, name, "penalty").active
        assert not effect(rough, name, RigidConstraints()).active


def test_friction_in_impacts_is_on_where_the_law_asks_and_a_contact_can_slip() -> None:
    rough = PEG.with_values({"contact.friction": 0.3})
    asking = "impulse-augmented penalty with impact friction"
    assert effect(rough, "impact_friction", asking).active
    assert not effect(rough, "impact_friction", "impulse-augmented penalty").active
    per_body = rough.with_values({"contact.self_collision_rows": "per_body"})
    assert "per_body" in effect(per_body, "impact_friction", asking).reason
    assert not effect(per_body, "impact_friction", asking).active


def test_a_law_of_the_callers_own_is_taken_to_use_all() -> None:
    assert decide_effects(PEG, "my law") == decide_effects(PEG)


@pytest.mark.parametrize("name", ["coupling", "device_limits", "delay", "quantisation", "device_damping"])
def test_without_a_coupling_no_device_takes_part(name: str) -> None:
    assert not effect(PEG, name, None, "none").active
    assert "coupling" in effect(PEG, name, None, "none").reason


def test_a_coupling_without_gains_is_off_and_says_which_are_missing() -> None:
    scene = PEG.with_values({"couplings.unilateral": None})
    assert effect(scene, "coupling", None, "four-channel").active
    found = effect(scene, "coupling", None, "unilateral")
    assert not found.active
    assert "couplings.unilateral" in found.reason


def test_full_rendering_ignores_the_limits() -> None:
    assert not effect(PEG, "device_limits", None, "four-channel", "full").active
    assert "scale" in effect(PEG, "device_limits", None, "four-channel", "scale").reason


def test_gravity_needs_mass() -> None:
    weightless = {f"bodies.{link}.mass": 0 for link in ("upper", "lower")}
    assert not effect(PENDULUM.with_values(weightless), "gravity").active


def test_gravity_needs_something_that_moves_along_it() -> None:
    slider = {"bodies": [{"name": "cart", "joint": "prismatic", "axis": [1, 0], "mass": 1}]}
    across = effect(PENDULUM.with_values(slider), "gravity")
    assert not across.active
    assert across.reason == "nothing moves along gravity = [0, -9.81] m/s2"
    both = slider["bodies"] + [{"name": "lift", "joint": "prismatic", "axis": [0, 1], "mass": 1}]
    assert effect(PENDULUM.with_values({"bodies": both}), "gravity").left_out == "lift would not fall or sag"


def test_a_coupling_with_gains_of_its_own_needs_none_of_the_scene() -> None:
    bare = PEG.with_values({"couplings": {}})
    assert not effect(bare, "coupling", None, "four-channel").active
    found = effect(bare, "coupling", None, FourChannel((5.0, 6.0, 7.0), (1.0, 1.0, 1.0)))
    assert found.active
    assert "[5, 6, 7]" in found.reason


def test_the_record_and_the_switches_are_one_decision() -> None:
    scene = PEG.with_values({"contact.friction": 0.3, "gravity": [0.0, 1.0], "contact.cluster_distance": 1e-4})
    for law in ENGINE_LAWS.values():
        simulation = Simulation(scene, law)
        on = {found.name for found in simulation.effects if found.active}
        for name in ("gravity", "varying_inertia", "velocity_terms", "impulses", "unequal_restitution",
                     "impact_friction", "clustering"):
            assert getattr(simulation.world.switches, name) == (name in on), (law, name)


@pytest.mark.parametrize("name", ["gravity", "velocity_terms", "clustering"])
def test_an_effect_that_is_off_would_change_no_bit(name: str) -> None:
    plain = PEG.with_values({"contact.cluster_distance": 0})
    off, on = Simulation(plain), Simulation(plain)
    assert not getattr(off.world.switches, name)
    switches = on.world.switches._content._replace(**{name: True})
    on.world = block(on.world._content._replace(switches=switches))
    for _ in range(300):
        off.step()
        on.step()
    assert off.state.contact_count[0] > 0
    assert (off.state.q == on.state.q).all()
    assert (off.state.v == on.state.v).all()


@pytest.mark.parametrize("name", scene_names())
def test_every_scene_gets_a_reason_for_every_effect(name: str) -> None:
    for found in decide_effects(load_scene(find_scene(name))):
        assert found.reason
        assert "None" not in found.reason


@given(
    st.sampled_from(["stiffness", "damping", "friction", "cluster_distance", "coherence_distance"]),
    st.floats(0.0, 1e6),
)
def test_a_number_of_the_contact_section_is_on_exactly_where_it_is_not_zero(field: str, value: float) -> None:
    names = {"stiffness": "penalty_stiffness", "damping": "contact_damping", "cluster_distance": "clustering",
             "coherence_distance": "coherence"}
    assert effect(PEG.with_values({f"contact.{field}": value}), names.get(field, field)).active == (
        value > 0.0
    )


def test_the_engines_laws_and_couplings_are_known_by_their_own_names() -> None:
    laws = (ImpulseAugmented(), ImpulseAugmented(friction_in_impacts=True), Penalty())
    for law in laws:
        assert decide_effects(PEG, law.name, None, "full") == decide_effects(PEG, law)
    assert {coupling.name for coupling in (FourChannel, UnilateralCoupler)} == set(COUPLING_FIELDS)

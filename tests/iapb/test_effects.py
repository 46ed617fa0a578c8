"""Effects: each can be switched by a scene alone, says why with the scene's values, and heeds the caller's choices."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.effects import EFFECTS, Effect, decide_effects
from iapb.scene import Scene, find_scene, load_scene, scene_names

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
}  # fmt: skip
ONE_LINK = {"bodies": [{"name": "upper", "joint": "revolute", "mass": 1, "center_of_mass": [0.25, 0]}]}
NO_SHAPES = {"bodies.peg.shapes": []}

SWITCHES: dict[str, tuple[Scene, dict[str, Any], dict[str, Any], str]] = {
    "gravity": (PENDULUM, {}, {"gravity": None}, "-9.81"),
    "varying_inertia": (PENDULUM, {}, ONE_LINK, "upper, lower"),
    "velocity_terms": (PENDULUM, {}, ONE_LINK, "upper, lower"),
    "hand_force": (PEG, {}, {"hand.force": [0, 0, 0]}, "[-0.32, 0.4, 0]"),
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
}  # fmt: skip


def effect(scene: Scene, name: str, *choices: str | None) -> Effect:
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


@pytest.mark.parametrize("law", ["penalty", "rigid constraints"])
def test_laws_without_impulses_switch_them_off_and_are_named(law: str) -> None:
    found = effect(PEG, "impulses", law)
    assert not found.active
    assert law in found.reason


def test_rigid_constraints_use_no_penalty_and_no_friction() -> None:
    rough = PEG.with_values({"contact.friction": 0.3})
    for name in ("penalty_stiffness", "contact_damping", "friction"):
        assert effect(rough, name, "penalty").active
        assert not effect(rough, name, "rigid constraints").active


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
             "coherence_distance": "coherence"}  # fmt: skip
    assert effect(PEG.with_values({f"contact.{field}": value}), names.get(field, field)).active == (
        value > 0.0
    )


def test_the_laws_that_are_known_go_by_their_own_names() -> None:
    from iapb.contact.laws import ImpulseAugmented, Penalty
    from iapb.effects.question import COUPLING_FIELDS, LAW_USES
    from iapb.haptics.coupling import FourChannel, UnilateralCoupler
    from reference.time_stepping import RigidConstraints

    laws = (ImpulseAugmented(), ImpulseAugmented(friction_in_impacts=True), Penalty(), RigidConstraints())
    assert {law.name for law in laws} == set(LAW_USES)
    assert {coupling.name for coupling in (FourChannel, UnilateralCoupler)} == set(COUPLING_FIELDS)

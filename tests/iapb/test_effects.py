"""Effects: each can be switched by a scene alone, says why with the scene's values, and heeds the
caller's choices."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from iapb.contact.laws import ImpulseAugmented, Penalty
from iapb.effects import COUPLING_FIELDS, EFFECTS, Effect, decide_effects
from iapb.haptics.coupling import FourChannel, UnilateralCoupler
from iapb.scene import Scene, find_scene, load_scene, scene_names
from reference.time_stepping import RigidConstraints

PEG = load_scene(find_scene("peg_corner"))
ARM = load_scene(find_scene("arm_pushing"))
PENDULUM = load_scene(find_scene("double_pendulum"))
DISCS = load_scene(find_scene("two_discs"))
CHAIN = {
    "bodies": [
        {
            "name": name,
            "parent": parent,
            "joint": "revolute",
            "inertia": 1,
            "origin": [3 * (parent != "world"), 0],
            "shapes": [{"kind": "circle", "radius": 1}],
        }
        for name, parent in (("one", "world"), ("two", "one"), ("three", "two"))
    ],
    "hand": None,
    "device": None,
    "couplings": {},
    "contact.self_collisions": True,
}
ONE_LINK = {
    "bodies": [{"name": "upper", "joint": "revolute", "mass": 1, "center_of_mass": [0.25, 0]}]
}
NO_SHAPES = {"bodies.peg.shapes": []}

SWITCHES: dict[str, tuple[Scene, dict[str, Any], dict[str, Any], str]] = {
    "gravity": (PENDULUM, {}, {"gravity": None}, "-9.81"),
    "varying_inertia": (PENDULUM, {}, ONE_LINK, "upper, lower"),
    "velocity_terms": (PENDULUM, {}, ONE_LINK, "upper, lower"),
    "hand_force": (PEG, {}, {"hand.force": [0, 0, 0]}, "[-0.32, 0.4, 0]"),
    "joint_damping": (
        PENDULUM,
        {"bodies.upper.joint_damping": 0.25},
        {"bodies.upper.joint_damping": 0.0},
        "upper [0.25]",
    ),
    "joint_friction": (
        PENDULUM,
        {"bodies.upper.joint_friction": 0.25},
        {"bodies.upper.joint_friction": 0.0},
        "upper [0.25] N, N m",
    ),
    "joint_limits": (PENDULUM, {"bodies.lower.joint_limits": [-3, 3]}, {}, "lower [-3, 3] rad, m"),
    "wall_contacts": (PEG, {}, {"walls": []}, "2 pairs"),
    "body_contacts": (DISCS, {}, {"bodies.striker.shapes": []}, "1 pair"),
    "self_collisions": (PEG, CHAIN, {**CHAIN, "contact.self_collisions": False}, "1 pair"),
    "impulses": (PEG, {"contact.restitution": 0.25}, NO_SHAPES, "0.25"),
    "unequal_restitution": (
        PEG,
        {f"walls.{PEG.walls[0].name}.restitution": 0.75},
        {"bodies.peg.restitution": 0.75},
        "to 0.75",
    ),
    "impact_friction": (
        PEG,
        {"contact.friction": 0.3},
        {"contact.friction": 0},
        "contact.friction = 0.3",
    ),
    "penalty_stiffness": (PEG, {"contact.stiffness": 1234}, {"contact.stiffness": 0}, "1234 N/m"),
    "contact_damping": (PEG, {"contact.damping": 56}, {"contact.damping": 0}, "56 N s/m"),
    "friction": (PEG, {"contact.friction": 0.3}, {"contact.friction": 0}, "contact.friction = 0.3"),
    "implicit_contact": (
        PEG,
        {"contact.forces": "implicit"},
        {"contact.forces": "paper"},
        "= implicit",
    ),
    "touch": (
        PEG,
        {"contact.forces": "implicit"},
        {"contact.forces": "implicit", "contact.impact_time": "step"},
        "= touch",
    ),
    "supports": (
        PEG,
        {"contact.forces": "implicit"},
        {"contact.forces": "implicit", **NO_SHAPES},
        "contacts",
    ),
    "clustering": (
        PEG,
        {"contact.cluster_distance": 0.002},
        {"contact.cluster_distance": 0},
        "0.002 m",
    ),
    "coherence": (
        PEG,
        {"contact.coherence_distance": 0.003},
        {"contact.coherence_distance": 0},
        "0.003 m",
    ),
    "coupling": (PEG, {}, {"couplings": {}}, "[100, 100, 0.5]"),
    "device_limits": (PEG, {}, {"device": None}, "[15, 15, 1]"),
    "delay": (PEG, {"device.delay": 4}, {"device.delay": 0}, "4 steps, 7.8125 ms"),
    "quantisation": (PEG, {"device.position_resolution": [1e-5, 1e-5, 0]}, {}, "[1e-05, 1e-05, 0]"),
    "device_damping": (
        PEG,
        {"device.damping": [0.5, 0.5, 0]},
        {"device.damping": [0, 0, 0]},
        "[0.5, 0.5, 0]",
    ),
}


def effect(scene: Scene, name: str, *choices: Any) -> Effect:
    return next(found for found in decide_effects(scene, *choices) if found.name == name)


def test_every_effect_is_switched_above() -> None:
    assert [found.name for found in decide_effects(PEG)] == [*EFFECTS] == list(SWITCHES)


@pytest.mark.parametrize("name", SWITCHES)
def test_a_scene_alone_switches_the_effect_and_the_reason_has_its_values(name: str) -> None:
    scene, on, off, values = SWITCHES[name]
    switched_on = effect(scene.with_values(on), name)
    switched_off = effect(scene.with_values(off), name)
    assert switched_on.active and not switched_off.active and switched_on.left_out
    assert values in switched_on.reason and switched_off.reason != switched_on.reason


RIGID = RigidConstraints()
RUBBING = "impulse-augmented penalty with impact friction"
ROUGH = PEG.with_values({"contact.friction": 0.3})
BARE = PEG.with_values({"couplings": {}})
PER_BODY = ROUGH.with_values({"contact.self_collision_rows": "per_body"})
GAINS = FourChannel((5.0, 6.0, 7.0), (1.0, 1.0, 1.0))
DRIFTING = SimpleNamespace(name="drifting")  # a law that says nothing of joints
JOINTED = PENDULUM.with_values(
    {"bodies.upper.joint_damping": 0.25, "bodies.lower.joint_limits": [-3, 3]}
)
SLIDER = [{"name": "cart", "joint": "prismatic", "axis": [1, 0], "mass": 1}]

# effect, scene, law, coupling and rendering, whether it is on, what the reason says, field that the
# law ignores
CHOSEN: list[tuple[str, Scene, tuple[Any, ...], bool, str, str]] = [
    ("impulses", PEG, (Penalty(),), False, "'penalty' does not use it", "restitution"),
    ("impulses", PEG, (RIGID,), False, f"'{RIGID.name}' does not use it", ""),
    *(
        (name, ROUGH, (law,), on, "contact." if on else RIGID.name, "" if on else field)
        for name, field in (
            ("penalty_stiffness", "stiffness"),
            ("contact_damping", "damping"),
            ("friction", "friction"),
        )
        for law, on in (("penalty", True), (RIGID, False))
    ),
    ("friction", PEG.with_values({"contact.friction": 0.0}), (RIGID,), False, RIGID.name, ""),
    *(
        (name, JOINTED, (DRIFTING,), False, "'drifting' does not use it", name)
        for name in ("joint_damping", "joint_limits")
    ),
    ("impact_friction", ROUGH, (RUBBING,), True, "0.3", ""),
    ("impact_friction", ROUGH, ("impulse-augmented penalty",), False, "does not use it", ""),
    ("impact_friction", PER_BODY, (RUBBING,), False, "per_body", ""),
    *(
        (name, PEG, (None, "none"), False, "no coupling", "")
        for name in ("coupling", "device_limits", "delay", "quantisation", "device_damping")
    ),
    (
        "coupling",
        PEG.with_values({"couplings.unilateral": None}),
        (None, "four-channel"),
        True,
        "four-channel",
        "",
    ),
    (
        "coupling",
        PEG.with_values({"couplings.unilateral": None}),
        (None, "unilateral"),
        False,
        "couplings.unilateral",
        "",
    ),
    ("coupling", BARE, (None, "four-channel"), False, "couplings.four_channel", ""),
    ("coupling", BARE, (None, GAINS), True, "[5, 6, 7]", ""),
    ("device_limits", PEG, (None, "four-channel", "full"), False, "'full'", ""),
    ("device_limits", PEG, (None, "four-channel", "scale"), True, "'scale'", ""),
    (
        "device_limits",
        PEG,
        (None, "none", "scale"),
        True,
        "[15, 15, 1]",
        "",
    ),  # the tool's impulse is scaled as well
    (
        "gravity",
        PENDULUM.with_values({f"bodies.{link}.mass": 0 for link in ("upper", "lower")}),
        (),
        False,
        "mass",
        "",
    ),
    (
        "gravity",
        PENDULUM.with_values({"bodies": SLIDER}),
        (),
        False,
        "nothing moves along gravity = [0, -9.81]",
        "",
    ),
]


@pytest.mark.parametrize(("name", "scene", "choices", "on", "reason", "ignores"), CHOSEN)
def test_the_choices_of_the_caller_switch_the_effect(
    name: str, scene: Scene, choices: tuple[Any, ...], on: bool, reason: str, ignores: str
) -> None:
    found = effect(scene, name, *choices)
    assert (found.active, found.ignores) == (on, ignores) and reason in found.reason


def test_laws_and_couplings_are_known_by_name_and_an_unknown_law_uses_all() -> None:
    assert decide_effects(PEG, "my law") == decide_effects(PEG)
    for law in (ImpulseAugmented(), ImpulseAugmented(friction_in_impacts=True), Penalty()):
        assert decide_effects(PEG, law.name, None, "full") == decide_effects(PEG, law)
    assert {coupling.name for coupling in (FourChannel, UnilateralCoupler)} == set(COUPLING_FIELDS)


@pytest.mark.parametrize("name", scene_names())
def test_every_scene_gets_a_reason_for_every_effect(name: str) -> None:
    assert all(
        found.reason and "None" not in found.reason
        for found in decide_effects(load_scene(find_scene(name)))
    )

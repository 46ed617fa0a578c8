"""Effects: each can be switched by a scene alone, says why with the scene's values, and heeds the
caller's choices."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from ruamel.yaml import YAML

from iapb.contact.laws import ImpulseAugmented, Penalty
from iapb.effects import EFFECTS, Effect
from iapb.haptics.coupling import FourChannel, NoCoupling
from iapb.scene import Scene, find_scene, load_scene, scene_names
from iapb.system import decide_effects
from reference.time_stepping import RigidConstraints

PEG = load_scene(find_scene("peg_corner"))
PENDULUM = load_scene(find_scene("double_pendulum"))
SWITCHES = YAML(typ="safe").load(Path(__file__).with_name("switches.yaml"))


def effect(scene: Scene, name: str, *choices: Any) -> Effect:
    return next(found for found in decide_effects(scene, *choices) if found.name == name)


def test_every_effect_is_switched_above() -> None:
    assert [found.name for found in decide_effects(PEG)] == [*EFFECTS] == list(SWITCHES)


@pytest.mark.parametrize("name", SWITCHES)
def test_a_scene_alone_switches_the_effect_and_the_reason_has_its_values(name: str) -> None:
    given = SWITCHES[name]
    scene = load_scene(find_scene(given["scene"]))
    switched_on = effect(scene.with_values(given["on"]), name)
    switched_off = effect(scene.with_values(given["off"]), name)
    assert switched_on.active and not switched_off.active and switched_on.left_out
    assert given["said"] in switched_on.reason and switched_off.reason != switched_on.reason


RIGID = RigidConstraints()
RUBBING = ImpulseAugmented(friction_in_impacts=True)
ROUGH = PEG.with_values({"contact.friction": 0.3})
BARE = PEG.with_values({"couplings": {}})
LIMITED = PEG.with_values({"device.force_limit": [1, 1, 1]})
SPREAD = ImpulseAugmented(rendering="spread")
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
    *(
        (name, ROUGH, (law,), on, "contact." if on else RIGID.name, "" if on else field)
        for name, field in (
            ("penalty_stiffness", "stiffness"),
            ("contact_damping", "damping"),
            ("friction", "friction"),
        )
        for law, on in ((Penalty(), True), (RIGID, False))
    ),
    *(
        (name, JOINTED, (DRIFTING,), False, "'drifting' does not use it", name)
        for name in ("joint_damping", "joint_limits")
    ),
    ("impact_friction", PER_BODY, (RUBBING,), False, "per_body", ""),
    *(
        (name, PEG, (None, NoCoupling()), False, "no coupling", "")
        for name in ("coupling", "device_limits", "delay", "quantisation", "device_damping")
    ),
    ("coupling", PEG, (None, GAINS), True, "four-channel", ""),
    ("coupling", BARE, (), False, "no gains under couplings", ""),
    ("device_limits", LIMITED, (SPREAD, NoCoupling()), True, "'spread'", ""),
    ("coupling", BARE, (None, GAINS), True, "[5, 6, 7]", ""),
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


@pytest.mark.parametrize("name", scene_names())
def test_every_scene_gets_a_reason_for_every_effect(name: str) -> None:
    assert all(
        found.reason and "None" not in found.reason
        for found in decide_effects(load_scene(find_scene(name)))
    )

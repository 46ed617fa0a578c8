"""Effects: each can be switched by a scene alone, says why with the scene's values, and heeds the
caller's choices."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from iapb.contact.laws import ImpulseAugmented, Penalty
from iapb.effects import EFFECTS, Effect
from iapb.haptics.coupling import FourChannel, NoCoupling
from iapb.scene import Scene, find_scene, load_scene, scene_names
from iapb.system import decide_effects
from reference.time_stepping import RigidConstraints
from tests.given import data_of

PEG = load_scene(find_scene("peg_corner"))
SWITCHES, CASES = (data_of(__file__, name) for name in ("switches.yaml", "chosen.yaml"))


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


LAWS: dict[str, Any] = {
    "penalty": Penalty(),
    "rigid": RigidConstraints(),
    "drifting": SimpleNamespace(name="drifting"),  # says nothing of joints
}
COUPLINGS = {"none": NoCoupling(), "gains": FourChannel((5.0, 6.0, 7.0), (1.0, 1.0, 1.0))}
CHOSEN = [(name, case) for case in CASES for name in case["effects"]]


@pytest.mark.parametrize(("name", "case"), CHOSEN)
def test_the_choices_of_the_caller_switch_the_effect(name: str, case: dict[str, Any]) -> None:
    scene = load_scene(find_scene(case.get("scene", "peg_corner")))
    law = case.get("law")
    chosen = ImpulseAugmented(**law) if isinstance(law, dict) else LAWS.get(law)
    coupling = COUPLINGS.get(case.get("coupling"))
    found = effect(scene.with_values(case.get("set", {})), name, chosen, coupling)
    assert (found.active, found.ignores) == (case.get("on", False), case.get("ignores", ""))
    assert case["said"] in found.reason


@pytest.mark.parametrize("name", scene_names())
def test_every_scene_gets_a_reason_for_every_effect(name: str) -> None:
    assert all(
        found.reason and "None" not in found.reason
        for found in decide_effects(load_scene(find_scene(name)))
    )

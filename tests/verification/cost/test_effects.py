"""What changes without an effect: nothing where it does nothing, what the law says where it does."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb import find_scene, load_scene
from iapb.scene import Scene, SpatialScene, scene_from_text, scene_names
from reference.worlds import find_world
from verification.clock import Times
from verification.cost.effects import NOTHING, SWITCHED, Loop, Variant, effects_of, saved


def _scene(name: str, duration: float) -> Scene:
    return load_scene(find_scene(name)).with_values({"duration": duration})


def _measured(scene: Scene) -> dict[str, dict[str, Any]]:
    """What was measured, by effect."""
    return {row["effect"]: row for row in effects_of(scene, rounds=1).records() if row["position"] is not None}


def test_without_walls_or_hand_the_peg_goes_elsewhere() -> None:
    found = _measured(_scene("peg_corner", 1.0))
    assert "friction" not in found and "gravity" not in found  # off in this scene
    # the hand accelerates the peg of 2 kg for a second; with walls it ends in the corner, 10 mm and 8 mm away
    free = 0.5 * np.hypot(0.32, 0.4) / 2.0
    assert found["wall_contacts"]["position"] == pytest.approx(1e3 * (free - np.hypot(0.01, 0.008)), abs=1.0)
    assert found["hand_force"]["energy"] == pytest.approx(100.0)
    assert found["clustering"]["position"] == 0.0
    assert found["impulses"]["position"] > 0.1


def test_without_velocity_terms_a_pendulum_swings_otherwise() -> None:
    found = _measured(_scene("double_pendulum", 0.5))
    assert found["velocity_terms"]["energy"] > 0.1
    assert found["gravity"]["position"] > 10.0


def test_what_the_rounds_do_not_agree_on_is_noise() -> None:
    assert saved(Times((0.7, 0.9, 0.9, 0.8, 1.3))) == pytest.approx(10.0)  # one round may be disturbed
    assert saved(Times((0.7, 0.9, 1.1, 1.2, 0.8))) is None and saved(Times((1.0,))) is None
    assert saved(Times((1.3, 1.2, 1.25))) == pytest.approx(-25.0)


@pytest.mark.parametrize("name", scene_names())
def test_an_effect_that_does_nothing_leaves_the_same_bits(name: str) -> None:
    """Every switch that the scene leaves off is turned on: one by one, and all at once.

    M is a constant of some scenes in space to rounding alone: turned to each pose it has other last bits.
    """
    scene, world = _scene(name, 0.3), find_world("IAPB")
    whole = Loop(scene, world, Variant())
    whole.sample()
    spatial = isinstance(scene, SpatialScene)
    idle = [switch for switch in SWITCHED if not getattr(whole.simulation.world.switches, switch)
            and not (spatial and switch == "varying_inertia")]
    assert {"joint_damping", "gravity", "clustering"} & {*idle}
    for switches in (*((switch,) for switch in idle), tuple(idle)):
        other = Loop(scene, world, Variant(switches=switches, on=True))
        other.sample()
        assert all(getattr(other.simulation.world.switches, switch) for switch in switches)
        assert whole.same_motion(other), switches


_SLIDER = """
name: slider
rate: 500
duration: 0.2
gravity: [0, -9.81]
bodies:
  - {{name: cart, joint: prismatic, axis: [1, 0], mass: 1.0, velocity: [{speed}],
     shapes: [{{kind: circle, radius: 0.05}}]}}
walls:
  - {{name: wall, kind: half_plane, point: [0.2, 0], normal: [-1, 0]}}
contact: {{friction: 0.5, stiffness: 1e3, damping: 1}}
"""


def test_a_wall_that_is_never_reached_changes_nothing_and_gravity_on_a_slider_is_off() -> None:
    """At 0.5 m/s the cart ends 50 mm before the wall; at 1 m/s it strikes it, and only friction has nothing to do."""
    short, far = (
        {row["effect"]: row for row in effects_of(scene_from_text(_SLIDER.format(speed=speed)), rounds=1).records()}
        for speed in (0.5, 1.0)
    )
    assert not short["gravity"]["active"] and "nothing moves along gravity" in short["gravity"]["reason"]
    for name in ("friction", "impulses", "penalty_stiffness", "contact_damping"):
        assert short[name]["active"] and short[name]["change"] == f"{NOTHING}: nothing touches"
    assert short["wall_contacts"]["change"] == f"{NOTHING}: no body touches a wall"
    assert far["friction"]["change"] == f"{NOTHING}: all states are the same to the last bit"
    for name in ("wall_contacts", "impulses"):
        assert not far[name]["change"].startswith(NOTHING) and far[name]["position"] > 0.0

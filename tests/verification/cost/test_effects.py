"""What changes without an effect: nothing where it does nothing, what the law says where it
does."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb import find_scene, load_scene, simulate
from iapb.scene import Scene, SpatialScene, scene_names
from reference.worlds import find_world
from verification.cost.effects import (
    SWITCHED,
    Loop,
    effects_of,
    numbers_of,
    step_of,
    steps_table,
)


def _scene(name: str, duration: float) -> Scene:
    return load_scene(find_scene(name)).with_values({"duration": duration})


def _measured(scene: Scene) -> dict[str, dict[str, Any]]:
    """What was measured, by effect."""
    return {
        row["effect"]: row for row in effects_of(scene).records() if row["position"] is not None
    }


def test_without_walls_or_hand_the_peg_goes_elsewhere() -> None:
    found = _measured(_scene("peg_corner", 1.0))
    assert "friction" not in found and "gravity" not in found  # off in this scene
    # the hand accelerates the peg of 2 kg for a second; with walls it ends in the corner, 10 mm and
    # 8 mm away
    free = 0.5 * np.hypot(0.32, 0.4) / 2.0
    assert found["wall_contacts"]["position"] == pytest.approx(
        1e3 * (free - np.hypot(0.01, 0.008)), abs=1.0
    )
    assert found["hand_force"]["energy"] == pytest.approx(100.0)
    assert found["clustering"]["position"] == 0.0
    assert found["impulses"]["position"] > 0.1


@pytest.mark.parametrize("name", scene_names())
def test_an_effect_that_does_nothing_leaves_the_same_bits(name: str) -> None:
    """Every switch that the scene leaves off is turned on, all at once, and on three scenes one by
    one.

    M is a constant of some scenes in space to rounding alone: turned to each pose it has other last
    bits.
    """
    scene = _scene(name, 0.3)
    world = find_world("IAPB")
    whole = Loop(scene, world)
    whole.sample()
    timed = whole.recording.joined("steps")["q"]
    assert np.array_equal(simulate(scene, world.law, world.coupling_in(scene)).q, timed)
    spatial = isinstance(scene, SpatialScene)
    idle = [
        switch
        for switch in SWITCHED
        if not getattr(whole.simulation.world.switches, switch)
        and not (spatial and switch == "varying_inertia")
    ]
    assert {"joint_damping", "gravity", "clustering"} & {*idle}
    alone = idle if name in ("peg_corner", "arm_obstacles", "peg_hole_space") else ()
    for switches in (*((switch,) for switch in alone), tuple(idle)):
        other = Loop(scene, world, switches=switches, on=True)
        other.sample()
        assert all(getattr(other.simulation.world.switches, switch) for switch in switches)
        assert whole.same_motion(other), switches


def test_the_time_saved_is_measured_on_one_motion_beside_its_noise() -> None:
    row = step_of(_scene("peg_corner", 0.2), rounds=3)
    assert row["saved, lower [%]"] <= row["saved [%]"] <= row["saved, upper [%]"]
    assert row["noise [%]"] >= 0.0 and row["clear"] == (row["saved, lower [%]"] > row["noise [%]"])
    assert row["apart with all on [mm]"] == 0.0
    numbers = numbers_of(steps_table([row]))
    assert (numbers["scenes"], numbers["effects_on"]) == (1, row["effects on"])
    assert numbers["alone"] and numbers["saved_median"] == pytest.approx(0.01 * row["saved [%]"])

"""What changes without an effect: nothing where it does nothing, what the law says where it does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from iapb import find_scene, load_scene
from iapb.effects import EFFECTS
from iapb.scene import Scene
from verification.cost.effect_cost import LEFT_OUT, EffectMeasure, in_words, measure_effects


def _scene(name: str, duration: float) -> Scene:
    return load_scene(find_scene(name)).with_values({"duration": duration})


def test_every_entry_names_an_effect() -> None:
    assert set(LEFT_OUT) <= {effect.__name__ for effect in EFFECTS}


def test_without_walls_or_hand_the_peg_goes_elsewhere() -> None:
    found = {one.effect: one for one in measure_effects(_scene("peg_corner", 1.0), pairs=1)}
    assert "friction" not in found and "gravity" not in found  # off in this scene
    # the hand accelerates the peg of 2 kg for a second; with walls it ends in the corner, 10 mm and 8 mm away
    free = 0.5 * np.hypot(0.32, 0.4) / 2.0
    assert found["wall_contacts"].position == pytest.approx(free - np.hypot(0.01, 0.008), abs=1e-3)
    assert found["hand_force"].energy == pytest.approx(1.0)
    assert found["clustering"].position == 0.0
    assert found["impulses"].position > 1e-4


def test_without_velocity_terms_a_pendulum_swings_otherwise() -> None:
    found = {one.effect: one for one in measure_effects(_scene("double_pendulum", 0.5), pairs=1)}
    assert found["velocity_terms"].energy > 1e-3
    assert found["gravity"].position > 1e-2


def test_words_carry_the_numbers() -> None:
    cost, change = in_words(EffectMeasure("friction", 2e-6, 1.5e-6, 3e-3, 1e-3, 0.5))
    assert "+25 %" in cost and "2.00 µs" in cost
    assert "3 mm" in change and "device 1 mm" in change and "50 %" in change
    assert in_words(EffectMeasure("a", np.nan, np.nan, np.nan, np.nan, np.nan, "no run")) == ("", "no run")


def test_a_hinged_rod_goes_elsewhere_though_its_hinge_stays(tmp_path: Path) -> None:
    """Without gravity it hangs in the air; with it a point r away from the hinge falls by ½ α t² r at first."""
    (tmp_path / "rod.yaml").write_text(
        "{name: rod, title: A hinged rod, rate: 1000, duration: 0.1, gravity: [0, -9.81], bodies: [{name: rod, "
        "joint: revolute, mass: 0.5, inertia: 1e-2, center_of_mass: [0.3, 0], "
        "shapes: [{kind: circle, radius: 0.02}]}]}"
    )
    found = {one.effect: one for one in measure_effects(load_scene(tmp_path / "rod.yaml"), pairs=1)}
    acceleration = 0.5 * 9.81 * 0.3 / (1e-2 + 0.5 * 0.3**2)
    farthest = 0.3 + np.sqrt(1e-2 / 0.5)  # the point a radius of gyration beyond the centre of mass
    assert found["gravity"].position == pytest.approx(0.5 * acceleration * 0.1**2 * farthest, rel=0.03)

"""Ordinary scenes are right in the default world, or their run is not to be trusted and says so."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from iapb.scene.model import scene_kind
from tests.ordinary.scenes import CASES, Motion
from tests.ordinary.table import mjcf, outcome_of

LAWS = {"IAPB": [*CASES], "PB": ["ball_rolls", "tower_5", "ratio_1e6", "arch", "peg_jams", "ladder_slips"],
        "ideal-friction": ["disc_rolls", "box_stays_on_slope", "bounce_50_percent", "ladder_stands"]}  # fmt: skip
TOO_FAST = ("fast_box_and_plate", "fast_ball_and_plate")  # through a plate within a step: the run must say so
MADE = 1e-4  # of the scene's energy: what the integration of a right run may make


@pytest.mark.parametrize(("world", "name"), [(world, name) for world, names in LAWS.items() for name in names])
def test_a_scene_is_right_or_its_run_says_that_it_is_not(world: str, name: str) -> None:
    outcome = outcome_of(CASES[name], world)
    expected = "flagged" if name in TOO_FAST else "right"
    assert outcome.verdict(CASES[name]) == expected, f"{outcome.error / CASES[name].tolerance:.3g} tolerances off"
    assert name in TOO_FAST or outcome.made < MADE


@pytest.mark.parametrize("name", ["spin_box_10", "ball_starts_to_roll", "disc_brakes_in_groove", "ladder_slips"])
def test_mujoco_agrees_with_the_truth(name: str) -> None:
    pytest.importorskip("mujoco")
    assert outcome_of(CASES[name], "MuJoCo").verdict(CASES[name]) == "right"


def test_a_wrong_motion_and_a_broken_one_are_seen() -> None:
    case = CASES["ball_rolls"]
    at_rest = Motion(np.linspace(0, 2, 3), np.zeros((3, 1, 3)), np.tile(np.eye(3), (3, 1, 1, 1)), np.zeros((3, 3)))
    assert case.error(at_rest) == pytest.approx(1.0)
    assert case.error(at_rest._replace(place=at_rest.place + np.nan)) == np.inf
    rolls = outcome_of(case, "IAPB")
    assert rolls.verdict(dataclasses.replace(case, tolerance=0.5 * rolls.error)) in ("wrong", "flagged")


@pytest.mark.parametrize("name", CASES)
def test_every_scene_translates(name: str) -> None:
    mujoco = pytest.importorskip("mujoco")
    scene = scene_kind(CASES[name].scene).model_validate(CASES[name].scene)
    model = mujoco.MjModel.from_xml_string(mjcf(scene))
    assert model.nbody == 1 + len(scene.bodies)
    assert float(model.body_mass.sum()) == pytest.approx(sum(body.mass for body in scene.bodies))

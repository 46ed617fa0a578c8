"""Ordinary scenes are right in the default world, or their run is not to be trusted and says so."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb.run import Run
from iapb.scene import Scene
from iapb.scene.mechanism import mechanism_of, start_of
from iapb.scene.model import scene_kind
from reference.worlds import run_world
from verification.ordinary.judge import motion_of
from verification.ordinary.scenes import CASES, Case, Motion
from verification.scenes.books import risen

LAWS = {
    "IAPB": [*CASES],
    "PB": ["ball_rolls", "tower_5", "ratio_1e6", "arch", "peg_jams", "ladder_slips"],
    "ideal": ["spin_plate_10", "slider_on_a_turning_arm", "box_meets_a_seam_exactly"],
    "ideal-friction": ["bounce_50_percent", "ladder_stands", "box_over_tiles_0_percent"],
}
SLOW = {
    "ideal": ["spin_off_centre_30", "heavy_top", "double_pendulum"],
    "ideal-friction": [
        "disc_over_tiles",
        "box_over_tiles_50_percent",
        "box_over_tiles_in_space",
        "box_pushed_over_a_seam",
    ],
}
MADE = 1e-4  # of the scene's energy: what the integration of a right run may make


def made_by(run: Run, scene: Scene) -> float:
    """Energy made, by that of the start, of lifting each body by its size, and of the hand's force
    over 0.1 m."""
    q, v = start_of(scene)
    made = np.max(risen(run), initial=0.0)
    moving = 0.5 * v @ mechanism_of(scene).mass_matrix(q) @ v
    weight = np.linalg.norm(scene.gravity or [0.0])
    lifted = sum(
        weight * body.mass * max(map(size_of, body.shapes), default=0.1) for body in scene.bodies
    )
    return float(
        made
        / (moving + lifted + 0.1 * (np.linalg.norm(scene.hand.force[:2]) if scene.hand else 0.0))
    )


def size_of(shape: Any) -> float:
    if shape.kind == "polygon":
        return float(np.ptp(np.array(shape.vertices), axis=0).max())
    return float(max(shape.size) if shape.kind == "box" else 2 * shape.radius)


def run_of(case: Case, world: str) -> tuple[Scene, Run]:
    scene = scene_kind(case.scene).model_validate(case.scene)
    return scene, run_world(scene, world, partial=True)


@pytest.mark.parametrize(
    ("world", "name"),
    [
        *((world, name) for world, names in LAWS.items() for name in names),
        *(
            pytest.param(world, name, marks=pytest.mark.thorough)
            for world, names in SLOW.items()
            for name in names
        ),
    ],
)
def test_a_scene_is_right_or_its_run_says_that_it_is_not(world: str, name: str) -> None:
    scene, run = run_of(CASES[name], world)
    assert run.complete and not run.distrust
    assert CASES[name].error(motion_of(run)) <= CASES[name].tolerance
    assert made_by(run, scene) < MADE


def test_a_wrong_motion_and_a_broken_one_are_seen() -> None:
    case = CASES["ball_rolls"]
    at_rest = Motion(np.linspace(0, 2, 3), np.zeros((3, 1, 3)), np.tile(np.eye(3), (3, 1, 1, 1)))
    assert case.error(at_rest) == pytest.approx(1.0)
    assert case.error(at_rest._replace(place=at_rest.place + np.nan)) == np.inf

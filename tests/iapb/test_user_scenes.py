"""No scene of a user's kind gains energy without a warning: a sample; `user_scenes.py 200` judges more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from user_scenes import gained, user_scene

from iapb.checks import check_scene
from iapb.scene import find_scene, load_scene
from iapb.simulation import simulate


@pytest.mark.parametrize("seed", range(1000, 1030))
def test_what_gains_energy_is_warned_of(seed: int) -> None:
    scene = user_scene(np.random.default_rng(seed))
    run = simulate(scene, steps=min(scene.steps, 400))
    assert check_scene(scene) or run.distrust or not run.complete or not gained(run)


def test_a_gain_is_seen() -> None:
    run = simulate(load_scene(find_scene("sliding_box")), steps=50)
    assert not gained(run)
    assert gained(replace(run, energy=run.energy | {"kinetic": run.energy["kinetic"] + np.linspace(0, 9, 51)}))

"""A hand leads the arm through its singular poses: finite, bounded, balanced; a hand that pumps is seen."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.scene import find_scene, load_scene
from verification.mechanics import operating as study


@pytest.fixture(scope="module")
def scene():
    return load_scene(find_scene(study.SCENE))


@pytest.mark.parametrize("path", study.PATHS)
@pytest.mark.parametrize("body", study.LENGTHS)
def test_any_link_is_led_through_the_singular_pose(scene, path, body):
    row = study.operate(scene, study.Grip(body, study.LENGTHS[body]), path, 2.0, 1000.0)
    assert study.holds(row), row
    assert row["steps near singular"] > 0 or path != "whirl"


def test_a_link_pulled_along_itself_stays(scene):
    row = study.operate(scene, study.Grip("upper_arm", 0.3), "stretch", 1.0, 1000.0)
    assert row["largest joint speed [rad/s]"] < 1e-12
    assert row["closest to singular [σ_min/σ_max]"] == 0.0 and study.holds(row)


def test_the_residual_falls_with_the_step(scene):
    grip = study.Grip("forearm", 0.25)
    slow, fast = (study.operate(scene, grip, "stretch", 2.0, rate)["residual [relative]"] for rate in (1000.0, 4000.0))
    assert abs(fast) < 0.4 * abs(slow)


def test_a_hand_that_pushes_with_the_motion_is_seen(scene, monkeypatch):
    monkeypatch.setattr(study, "DAMPING", -30.0)
    row = study.operate(scene, study.Grip("forearm", 0.25), "stretch", 2.0, 1000.0)
    assert not study.holds(row)


def test_a_fault_or_a_number_that_is_not_finite_fails():
    whole = {"residual [relative]": 0.0, "stored beyond what was put in [relative]": 0.0, "tolerance [relative]": 1.0}
    assert study.holds(whole)
    assert not study.holds(whole | {"largest joint speed [rad/s]": np.inf})
    assert not study.holds({})  # broken off

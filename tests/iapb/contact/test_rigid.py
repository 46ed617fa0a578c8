"""Contact without a given stiffness: what sticks on a moving body stays, a ledge is a wall, links of
one tree meet. What stands and what crosses seams: verification/ordinary."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from iapb.advice.distrust import UNACCOUNTED, distrust_of
from iapb.scene import Scene
from iapb.scene.reading import scene_from_values
from iapb.simulation import simulate
from tests.given import data_of

GIVEN = data_of(__file__, "rigid.yaml")


def scene_of(name: str, **values: Any) -> Scene:
    return scene_from_values(GIVEN[name] | values)


# What sticks


@pytest.mark.parametrize("rate", [250, 4000])
@pytest.mark.parametrize("name", ["turntable", "rocking plank"])
def test_what_sticks_on_a_moving_body_keeps_its_place(name: str, rate: int) -> None:
    """The way of the points in a step bends by ω² r Δt²/2; what may be left of it is ω Δt of this
    distance, once, not in every step."""
    run = simulate(scene_of(name, rate=rate), every=10)
    turn = Rotation.from_quat(run.pose[:, 0, 3:]).inv()
    place = turn.apply(run.pose[:, 1, :3] - run.pose[:, 0, :3])
    assert np.abs(place - place[0]).max() < 100.0 / rate**2 and run.distrust == ()


@pytest.mark.parametrize("name", ["rolls", "rolls in space"])
def test_a_ball_that_rolls_fast_keeps_its_speed(name: str) -> None:
    """It turns by 0.2 in a step: its points part by the arc of a cycloid, which is no slip. To the
    fifth order of this angle; as slip, the third order would drive it 2 mm."""
    run = simulate(scene_of(name))
    assert run.q[-1, 0] == pytest.approx(0.5 * 5.0, abs=1e-4)


def test_friction_that_only_turns_a_velocity_drives_nothing() -> None:
    """On a light table the work of friction, booked by the way of the velocity after it, is a share
    of the energy; what more it did is seen."""
    light = {"bodies.table.mass": 0.05, "bodies.table.inertia": [1e-4] * 3}
    run = simulate(scene_of("turntable", rate=250, duration=20.0).with_values(light))
    booked = run.energy["friction_work"]
    assert run.distrust == () and booked[-1] > UNACCOUNTED * run.energy["kinetic"][0]
    more = run.energy | {"friction_work": 1.5 * booked}
    assert "its energy is" in distrust_of(replace(run, energy=more))[0]


# Seams


def test_a_ledge_above_the_overlap_is_a_wall() -> None:
    run = simulate(scene_of("ledge"))
    assert run.q[-1, 0] < 0.3 - 0.05 + 1e-3


def test_a_body_on_a_moving_one_does_not_sink_into_the_floor() -> None:
    """Lifted out of its support it would not touch the floor, and yet no wall joins the two."""
    run = simulate(scene_of("leaning"))
    assert run.contacts.gap.min() > -5e-3


# Links of one tree


def test_a_finger_stops_at_the_other() -> None:
    run = simulate(scene_of("fingers"))
    assert (run.q[:, 2] - run.q[:, 1]).min() > 0.02 - 2.0 * np.abs(run.v).max() * run.dt
    through = simulate(scene_of("fingers", contact={"self_collisions": False}))
    assert through.q[-1, 2] - through.q[-1, 1] < 0.0

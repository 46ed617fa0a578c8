"""Contact without a given stiffness: what sticks on a moving body stays, a ledge is a wall, links of
one tree meet. What stands and what crosses seams: verification/ordinary."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from iapb.advice.distrust import UNACCOUNTED, distrust_of
from iapb.scene import Scene, scene_from_text
from iapb.simulation import simulate

Values = dict[str, Any]
G = 9.81
FLOOR = {"name": "floor", "kind": "half_plane", "point": [0, 0], "normal": [0, 1]}
DOWN = [0.0, 0.0, -G]


def made(bodies: list[Values], walls: list[Values] | None = None, **values: Any) -> Scene:
    """A scene of 1 kHz, in space if its gravity has three numbers."""
    space = {"dimensions": 3} if len(values.get("gravity", ())) == 3 else {}
    text = {"name": "made", "rate": 1000, "bodies": bodies, "walls": walls or []} | space | values
    return scene_from_text(json.dumps(text))


def box(name: str, x: float, y: float, **values: Any) -> Values:
    shape = {"kind": "box", "size": [0.1, 0.1]}
    given = {"name": name, "joint": "planar", "density": 100, "shapes": [shape]}
    return given | {"position": [x, y, 0]} | values


# What sticks


def coin(place: list[float], turn: list[float], velocity: list[float]) -> Values:
    mass = 0.01
    a = 0.02
    b = 0.004
    moments = [mass * (a**2 + b**2) / 12, mass * (a**2 + b**2) / 12, mass * a**2 / 6]
    shape = {"kind": "box", "size": [a, a, b]}
    given = {"name": "coin", "joint": "free_flyer", "mass": mass, "inertia": moments}
    return given | {"shapes": [shape], "position": [*place, *turn], "velocity": velocity}


def table(**values: Any) -> Values:
    shape = {"kind": "box", "size": [0.6, 0.6, 0.04]}
    given = {"name": "table", "mass": 50.0, "inertia": [1e3, 1e3, 1e3], "shapes": [shape]}
    return given | {"origin": [0, 0, -0.02]} | values


def turning(w: float) -> list[Values]:
    flat = coin([0.1, 0, 0.002], [0, 0, 0, 1], [0, 0.1 * w, 0, 0, 0, w])
    return [table(joint="revolute", axis=[0, 0, 1], velocity=[w]), flat]


def rocking(angle: float) -> list[Values]:
    """A plank that swings like a pendulum, with the coin beside its axis."""
    turn = Rotation.from_rotvec([angle, 0, 0])
    place = turn.apply([0.05, 0.1, 0.002]).tolist()
    swings = {"center_of_mass": [0, 0, -0.5], "inertia": [2.0, 2.0, 2.0], "origin": [0, 0, 0]}
    shape = {"kind": "box", "size": [0.6, 0.6, 0.04], "center": [0, 0, -0.02]}
    plank = table(joint="revolute", axis=[1, 0, 0], position=[angle], **swings)
    return [plank | {"shapes": [shape]}, coin(place, turn.as_quat().tolist(), [0.0] * 6)]


MOVING = {"turntable": turning(6.0), "rocking plank": rocking(0.4)}


@pytest.mark.parametrize("rate", [250, 4000])
@pytest.mark.parametrize("name", MOVING)
def test_what_sticks_on_a_moving_body_keeps_its_place(name: str, rate: int) -> None:
    """The way of the points in a step bends by ω² r Δt²/2; what may be left of it is ω Δt of this
    distance, once, not in every step."""
    values = {"gravity": DOWN, "duration": 5.0, "contact": {"friction": 0.8}}
    scene = made(MOVING[name], rate=rate, **values)
    run = simulate(scene, every=10)
    turn = Rotation.from_quat(run.pose[:, 0, 3:]).inv()
    place = turn.apply(run.pose[:, 1, :3] - run.pose[:, 0, :3])
    assert np.abs(place - place[0]).max() < 100.0 / rate**2 and run.distrust == ()


@pytest.mark.parametrize("space", [False, True])
def test_a_ball_that_rolls_fast_keeps_its_speed(space: bool) -> None:
    """It turns by 0.2 in a step: its points part by the arc of a cycloid, which is no slip. To the
    fifth order of this angle; as slip, the third order would drive it 2 mm."""
    radius = 0.1
    spin = 50.0
    speed = radius * spin
    place, turning = ([0, 0, radius], [0, 0, 0, spin, 0]) if space else ([0, radius, 0], [0, -spin])
    shape = {"kind": "sphere" if space else "circle", "radius": radius}
    ball = {"name": "ball", "mass": 1.0, "shapes": [shape], "velocity": [speed, *turning]}
    ball |= {"joint": "free_flyer", "inertia": [4e-3] * 3} if space else {"joint": "planar"}
    ball |= {"position": [*place, 0, 0, 0, 1]} if space else {"position": place, "inertia": 5e-3}
    floor = FLOOR | {"kind": "half_space", "point": [0, 0, 0], "normal": [0, 0, 1]}
    values = {"gravity": DOWN if space else [0, -G], "rate": 250, "contact": {"friction": 0.5}}
    run = simulate(made([ball], [floor if space else FLOOR], duration=0.5, **values))
    assert run.q[-1, 0] == pytest.approx(0.5 * speed, abs=1e-4)


def test_friction_that_only_turns_a_velocity_drives_nothing() -> None:
    """On a light table the work of friction, booked by the way of the velocity after it, is a share
    of the energy; what more it did is seen."""
    plate, flat = turning(6.0)
    light = plate | {"mass": 0.05, "inertia": [1e-4] * 3}
    values = {"gravity": DOWN, "duration": 20.0, "rate": 250, "contact": {"friction": 0.8}}
    run = simulate(made([light, flat], **values))
    booked = run.energy["friction_work"]
    assert run.distrust == () and booked[-1] > UNACCOUNTED * run.energy["kinetic"][0]
    more = run.energy | {"friction_work": 1.5 * booked}
    assert "its energy is" in distrust_of(replace(run, energy=more))[0]


# Seams


def test_a_ledge_above_the_overlap_is_a_wall() -> None:
    ledge = {"name": "ledge", "kind": "box", "size": [1, 0.1], "center": [0.8, -0.05 + 0.004]}
    shape = {"kind": "box", "size": [0.1, 0.05]}
    body = box("slid", 0.043, 0.075, velocity=[1.5, -1.0, 0], shapes=[shape])
    values: Values = {"gravity": [0, -G], "duration": 0.5}
    run = simulate(made([body], [FLOOR, ledge], **values))
    assert run.q[-1, 0] < 0.3 - 0.05 + 1e-3


def test_a_body_on_a_moving_one_does_not_sink_into_the_floor() -> None:
    """Lifted out of its support it would not touch the floor, and yet no wall joins the two."""
    wedge = box("wedge", 0.0, 0.05, velocity=[0.5, 0, 0])
    lean = box("lean", 0.1, 0.15, velocity=[0, -1.0, 0], position=[0.085, 0.17, 0.5])
    run = simulate(made([wedge, lean], [FLOOR], gravity=[0, -G], duration=1.0))
    assert run.contacts.gap.min() > -5e-3


# Links of one tree


def fingers(push: float, **values: Any) -> Scene:
    shape = {"kind": "box", "size": [0.02, 0.1]}
    slide = {"joint": "prismatic", "axis": [1, 0]}
    finger = slide | {"parent": "base", "mass": 0.1, "shapes": [shape]}
    bodies = [
        slide | {"name": "base", "mass": 1.0},
        finger | {"name": "l", "position": [-0.05]},
        finger | {"name": "r", "position": [0.05]},
    ]
    return made(bodies, hand={"body": "l", "force": [push, 0, 0]}, duration=1.0, **values)


def test_a_finger_stops_at_the_other() -> None:
    run = simulate(fingers(2.0))
    assert (run.q[:, 2] - run.q[:, 1]).min() > 0.02 - 2.0 * np.abs(run.v).max() * run.dt
    through = simulate(fingers(2.0, contact={"self_collisions": False}))
    assert through.q[-1, 2] - through.q[-1, 1] < 0.0

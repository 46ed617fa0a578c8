"""MuJoCo as a world keeps the laws of mechanics on our scenes; each beside a closed form or our own
worlds."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from iapb import simulate
from iapb.scene import scene_from_text
from iapb.scene.mechanism import mechanism_of
from iapb.scene.reading import scene_from_values
from reference.mujoco import LEAST_RESTITUTION, MuJoCo, damping_ratio_of, spring_restitution
from verification.ordinary.judge import motion_of
from verification.ordinary.scenes import CASES

pytest.importorskip("mujoco")

# name -> how far the error may be above the case's tolerance: MuJoCo's contact is soft
RIGHT = {
    "box_slides_and_stops": 1.0,
    "box_slides_down_slope": 1.0,
    "tower_5_in_space": 1.0,
    "double_pendulum": 1.0,
    "bounce_50_percent": 3.0,
    "hand_holds_arm": 1.0,
    "ladder_slips": 1.0,
}
BALL = scene_from_text("""name: ball
dimensions: 3
rate: 1000
duration: 0.5
gravity: [0, 0, -9.81]
bodies:
  - {name: ball, joint: free_flyer, mass: 0.3, inertia: [1e-4, 1e-4, 1e-4], shapes: [{kind: sphere, radius: 0.05}],
     position: [0, 0, 0.3, 0, 0, 0, 1]}
walls: [{name: floor, kind: half_space, point: [0, 0, 0], normal: [0, 0, 1]}]
contact: {restitution: 0.5}
""")


@pytest.mark.parametrize("name", RIGHT)
def test_ordinary_scenes_have_their_known_outcome(name: str) -> None:
    case = CASES[name]
    run = simulate(scene_from_values(case.scene), world="mujoco")
    assert run.complete and not run.effects
    assert case.error(motion_of(run)) <= RIGHT[name] * case.tolerance


@pytest.mark.parametrize("restitution", [0.5, 1.0])
def test_a_ball_bounces_with_the_share_of_its_speed(restitution: float) -> None:
    run = simulate(BALL.with_values({"contact.restitution": restitution}), world="mujoco")
    speed = run.v[:, 2]
    before = float(-speed.min())
    after = float(speed[np.argmin(speed) :].max())
    assert before == pytest.approx(math.sqrt(2 * 9.81 * 0.25), rel=0.01)
    assert after / before == pytest.approx(restitution, abs=0.04)


@pytest.mark.parametrize("restitution", [0.2, 0.9])
def test_the_damping_ratio_gives_the_restitution(restitution: float) -> None:
    ratio = damping_ratio_of(restitution)
    assert spring_restitution(ratio) == pytest.approx(restitution, rel=1e-9)
    # x'' = −x − 2 ζ x', while it pushes
    position = 0.0
    velocity = 1.0
    step = 1e-5
    while position >= 0.0 and position + 2.0 * ratio * velocity > 0.0:
        velocity -= step * (position + 2.0 * ratio * velocity)
        position += step * velocity
    assert -velocity == pytest.approx(restitution, rel=1e-3)


def test_free_bodies_and_joints_move_as_in_our_worlds() -> None:
    """A URDF arm with a free base: quaternions, body axes and the order of joints agree with
    ours."""
    case = CASES["floating_robot"]
    scene = scene_from_values(case.scene).with_values({"duration": 0.2})
    theirs = simulate(scene, world="mujoco")
    ours = simulate(scene)
    assert np.abs(theirs.q - ours.q).max() < 5e-3
    assert np.abs(theirs.v - ours.v).max() < 2e-2 * np.abs(ours.v).max()


def test_what_a_run_lacks_is_absent() -> None:
    run = simulate(BALL, world="mujoco", steps=20)
    assert (run.law, run.world, run.coupling) == ("MuJoCo", "mujoco", "none")
    assert not run.records_contacts and "contacts not recorded" in run.summary
    absent = (run.state, run.penalty_force, run.contacts.gap, run.impacts.step)
    assert not any(map(len, absent))
    assert run.q.shape == (21, 7) and np.isfinite(run.v).all()
    total = run.energy["kinetic"] + run.energy["potential"]
    assert total[:20] == pytest.approx(total[0], rel=1e-3)
    assert "penalty_force" not in run.to_xarray()


@pytest.mark.parametrize(
    ("values", "ignored"),
    [
        ({"contact": "paper"}, ["contact.forces"]),
        ({"contact.restitution": 0.9 * LEAST_RESTITUTION}, ["contact.restitution"]),
        (
            {
                "hand": {"body": "ball"},
                "device": {"delay": 1},
                "couplings": {"four_channel": {"stiffness": [1] * 6, "damping": [1] * 6}},
            },
            ["couplings", "device"],
        ),
        ({"hand": {"body": "ball"}}, []),
    ],
)
def test_what_it_ignores_is_named(values: dict[str, Any], ignored: list[str]) -> None:
    assert list(MuJoCo().ignored(BALL.with_values(values))) == ignored


def test_each_pair_has_its_own_friction_and_restitution() -> None:
    scene = CASES["ball_starts_to_roll"].scene
    walls = [scene["walls"][0] | {"friction": 0.4, "restitution": 0.5}]
    body = scene["bodies"][0] | {"friction": 0.9, "restitution": 0.3}
    model = MuJoCo().model(scene_from_values(scene | {"walls": walls, "bodies": [body]}))
    assert model.pair_friction[0, :2] == pytest.approx(math.sqrt(0.4 * 0.9))
    assert model.pair_solref[0] == pytest.approx(MuJoCo().solref(0.3, 1e-3))


def test_the_limits_of_a_hinge_are_in_radians() -> None:
    scene = scene_from_values(CASES["slider_on_a_turning_arm"].scene)
    model = MuJoCo().model(scene.with_values({"bodies.arm.joint_limits": [-1, 2]}))
    assert list(model.jnt_range[0]) == [-1, 2]


def test_an_unstable_simulation_ends_and_says_why() -> None:
    run = MuJoCo(impact_steps=1e-4).run(BALL.with_values({"contact.restitution": 1.0}))
    assert not run.complete and "unstable" in run.stopped
    assert 0 < run.steps < 500 and np.isfinite(run.q).all() and np.isfinite(run.v).all()


def test_an_interrupted_run_keeps_its_steps() -> None:
    def stop(done: int, total: int) -> None:
        raise KeyboardInterrupt

    run = MuJoCo().run(BALL.with_values({"duration": 1.0}), progress=stop)
    assert run.stopped == "interrupted" and 0 < run.steps < 1000


def test_inertia_has_its_axes() -> None:
    """A body alone, whose products of inertia are not zero, has our M."""
    mujoco = pytest.importorskip("mujoco")
    scene = BALL.with_values({"bodies.ball.inertia": [1, 2, 2.5, 0.1, 0.2, 0.3]})
    model = MuJoCo().model(scene)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mass = np.zeros((6, 6))
    mujoco.mj_fullM(model, data, mass)
    assert mass[3:, 3:] == pytest.approx(mechanism_of(scene).bodies[0].inertia)

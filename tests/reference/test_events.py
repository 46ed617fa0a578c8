"""Event-driven truths by hand and by energy; time stepping, rigid worlds and the engine against
them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb.errors import ArgumentError, SolverError
from iapb.scene import find_scene, load_scene
from reference.scene_events import scene_truth
from reference.worlds import run_world
from tests.reference.scenes import G, scene_of

DROP = scene_of("dropped ball")


def test_a_dropped_ball_is_the_ball_of_the_exact_events() -> None:
    """Arcs in closed form, against an integrator with root finding."""
    truth = scene_truth(DROP, 0.5)
    time = np.linspace(0.0, 0.5, 51)
    fall = np.sqrt(2.0 * 0.2 / G)
    hits = fall * np.array([1.0, 2.2])  # e = 0.6
    assert truth.events == pytest.approx(hits, abs=1e-9)
    q, _ = truth.state(time)
    begun = [time - hits[0], time - hits[1]]
    height = np.select(
        [time < hits[0], time < hits[1]],
        [0.2 - 0.5 * G * time**2, (0.6 * G * fall - 0.5 * G * begun[0]) * begun[0]],
        (0.36 * G * fall - 0.5 * G * begun[1]) * begun[1],
    )
    assert q[:, 2] - 0.04 == pytest.approx(height, abs=1e-9)
    assert q[:, 0] == pytest.approx(0.3 * time, abs=1e-9)
    assert np.linalg.norm(q[:, 3:], axis=1) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("restitution", [0.0, 0.4])
def test_an_arm_strikes_its_one_contact_with_the_speed_that_its_energy_says(
    restitution: float,
) -> None:
    """½ I ω² = m g l sin(angle) at sin(angle) = 0.2/0.4; then −e ω, or rest with the gap held
    closed."""
    truth = scene_truth(scene_of("arm", contact={"restitution": restitution}), 0.3)
    inertia = 0.03 + 2.0 * 0.2**2
    angle = np.arcsin(0.5)
    speed = np.sqrt(2.0 * 2.0 * G * 0.2 * np.sin(angle) / inertia)
    struck = truth.events[0]
    before = truth.segments[0][2](struck)
    after = truth.segments[1][2](struck)
    assert before == pytest.approx([angle, speed], rel=1e-9)
    assert after == pytest.approx([angle, -restitution * speed], rel=1e-9, abs=1e-9)
    if restitution == 0.0:
        q, v = truth.state(np.linspace(struck, 0.3, 20))
        assert q == pytest.approx(angle, abs=1e-9) and np.abs(v).max() <= 1e-9


def test_bounces_that_accumulate_end_in_a_lasting_contact() -> None:
    """A ball from 5 cm, e = 0.5: it rests after 3 sqrt(2 h/g), infinitely many bounces later, and
    then slides on."""
    truth = scene_truth(scene_of("bouncing"), 1.0)
    rests = 3.0 * np.sqrt(2.0 * 0.05 / G)
    falls = rests / 3.0 * (1.0 + 2.0 * (1.0 - 0.5 ** np.arange(len(truth.events))))
    assert truth.events == pytest.approx(falls, abs=2.0 * truth.bound.instant)
    assert truth.events[-1] == pytest.approx(
        rests, abs=6e-4
    )  # 2 v/g/(1 - e) of bounces below 1e-7 m
    q, v = truth.state(np.linspace(rests, 1.0, 9))
    assert q[:, 1] == pytest.approx(0.04, abs=truth.bound.position) and q[-1, 0] == pytest.approx(
        0.3, abs=1e-9
    )
    assert np.abs(v[:, 1]).max() <= truth.bound.velocity


def test_the_bound_holds_all_the_bounces_that_are_neglected() -> None:
    low = scene_of(
        "bouncing",
        bodies__ball__position=[0, 0.04, 0],
        bodies__ball__velocity=[0, -1e-3, 0],
    )
    height = (0.5e-3) ** 2 / (2.0 * G)  # of the first one
    assert scene_truth(low, 0.05).bound.position >= 2.0 * height / (1.0 - 0.25)


@pytest.mark.parametrize(
    ("given", "error", "says"),
    [
        (
            (lambda: DROP.with_values({"hand": {"body": "ball"}}), 0.1, True),
            ArgumentError,
            "a scene without quaternions",
        ),
        (
            (lambda: load_scene(find_scene("box_stack")), 0.1),
            SolverError,
            "box_stack: .* contacts overlap",
        ),
        (
            (lambda: scene_of("bouncing", contact__restitution=0.97), 6.0, False, 20),
            SolverError,
            "impacts accumulate, 20 before",
        ),
    ],
)
def test_refusals(given: Any, error: type[Exception], says: str) -> None:
    make, *options = given
    with pytest.raises(error, match=says):
        scene_truth(make(), *options)


def test_a_device_like_its_tool_goes_with_it_where_velocities_make_forces() -> None:
    gains = {"four_channel": {"stiffness": [10, 10], "damping": [1, 1]}}
    arm = scene_of(
        "limited arm",
        gravity=[0, 0],
        device={},
        hand={"body": "lower"},
        couplings=gains,
        bodies__upper__joint_damping=0,
        bodies__lower__position=[-0.3],
    )
    tool_and_device = scene_truth(arm, 0.2, coupled=True).segments[0][2](0.1)
    assert tool_and_device[:4] == pytest.approx(tool_and_device[4:], abs=1e-8)


@pytest.mark.parametrize("world", ["IAPB", "ideal"])
def test_damped_and_limited_joints_converge_to_the_event_driven_truth(world: str) -> None:
    truth = scene_truth(scene_of("limited arm"), 0.6)
    errors = []
    assert len(truth.events) >= 2  # both joints meet a limit
    for rate in (1000.0, 4000.0):
        scene = scene_of(
            "limited arm",
            rate=rate,
            contact__forces="paper",
            contact__stiffness=5e4 * rate / 1000.0,
        )
        run = run_world(scene, world)
        errors.append(float(np.abs(run.q - truth.state(run.time)[0]).max()))
    assert errors[1] < 0.5 * errors[0] < (0.005 if world == "ideal" else 0.05)  # springs sag, too

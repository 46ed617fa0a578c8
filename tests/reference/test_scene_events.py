"""The event-driven truth of scenes, in the plane and in space, against what is known by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb.errors import ArgumentError, SolverError
from iapb.scene import find_scene, load_scene, scene_from_text
from iapb.system import System
from reference.event_driven import LinearSystem, event_driven
from reference.rigid_body import model_of
from reference.scene_events import scene_truth

G = 9.81
DROP = """
name: drop
dimensions: 3
rate: 1000
duration: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: ball, joint: free_flyer, mass: 0.5, inertia: [2e-4, 2e-4, 2e-4], shapes: [{kind: sphere, radius: 0.04}],
     position: [0, 0, 0.24, 0, 0, 0, 1], velocity: [0.3, 0, 0, 2, 3, 1]}
walls: [{name: floor, kind: half_space, point: [0, 0, 0], normal: [0, 0, 1]}]
contact: {restitution: 0.6, friction: 0, stiffness: 1e4, damping: 0, friction_velocity: 1e-2}
"""
PENDULUM = """
name: pendulum
dimensions: 3
rate: 1000
duration: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: arm, joint: revolute, axis: [0, 1, 0], mass: 2, inertia: [1e-3, 0.03, 0.03], center_of_mass: [0.2, 0, 0],
     shapes: [{kind: sphere, radius: 0.05, center: [0.4, 0, 0]}]}
walls: [{name: wall, kind: half_space, point: [0, 0, -0.25], normal: [0, 0, 1]}]
contact: {restitution: %g, friction: 0, stiffness: 1e4, damping: 0, friction_velocity: 1e-2}
"""


def test_a_dropped_ball_is_the_ball_of_the_exact_events() -> None:
    """Two truths that share no code between events: arcs in closed form, and an integrator with root finding."""
    exact = event_driven(LinearSystem([[0.5]], [-0.5 * G], [[1.0]], [0.0], 0.6), [0.2], [0.0], 0.5)
    truth = scene_truth(scene_from_text(DROP), 0.5)
    time = np.linspace(0.0, 0.5, 51)
    assert truth.events == pytest.approx(exact.event_time[1:], abs=1e-9)
    q, _ = truth.state(time)
    assert q[:, 2] - 0.04 == pytest.approx(exact.state(time)[0][:, 0], abs=1e-9)
    assert q[:, 0] == pytest.approx(0.3 * time, abs=1e-9)
    assert np.linalg.norm(q[:, 3:], axis=1) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("restitution", [0.0, 0.4])
def test_an_arm_strikes_its_one_contact_with_the_speed_that_its_energy_says(restitution: float) -> None:
    """½ I ω² = m g l sin(angle) at sin(angle) = 0.2/0.4; then −e ω, or rest with the gap held closed."""
    truth = scene_truth(scene_from_text(PENDULUM % restitution), 0.3)
    inertia, angle = 0.03 + 2.0 * 0.2**2, np.arcsin(0.5)
    speed = np.sqrt(2.0 * 2.0 * G * 0.2 * np.sin(angle) / inertia)
    struck = truth.events[0]
    before, after = truth.segments[0][2](struck), truth.segments[1][2](struck)
    assert before == pytest.approx([angle, speed], rel=1e-9)
    assert after == pytest.approx([angle, -restitution * speed], rel=1e-9, abs=1e-9)
    if restitution == 0.0:
        q, v = truth.state(np.linspace(struck, 0.3, 20))
        assert q == pytest.approx(angle, abs=1e-9) and np.abs(v).max() <= 1e-9


BOUNCING = """
name: bouncing
rate: 1000
duration: 1
gravity: [0, -9.81]
bodies:
  - {name: ball, joint: planar, mass: 0.5, inertia: 2e-4, shapes: [{kind: circle, radius: 0.04}],
     position: [0, 0.09, 0], velocity: [0.3, 0, 0]}
walls: [{name: floor, kind: half_plane, point: [0, 0], normal: [0, 1]}]
contact: {restitution: %g, friction: 0, stiffness: 1e4, damping: 0, friction_velocity: 1e-2}
"""


def test_bounces_that_accumulate_end_in_a_lasting_contact() -> None:
    """A ball from 5 cm, e = 0.5: it rests after 3 sqrt(2 h/g), infinitely many bounces later, and then slides on."""
    truth = scene_truth(scene_from_text(BOUNCING % 0.5), 1.0)
    rests = 3.0 * np.sqrt(2.0 * 0.05 / G)
    falls = rests / 3.0 * (1.0 + 2.0 * (1.0 - 0.5 ** np.arange(len(truth.events))))
    assert truth.events == pytest.approx(falls, abs=2.0 * truth.bound.instant)
    assert truth.events[-1] == pytest.approx(rests, abs=6e-4)  # 2 v/g/(1 - e) of bounces below 1e-7 m
    q, v = truth.state(np.linspace(rests, 1.0, 9))
    assert q[:, 1] == pytest.approx(0.04, abs=truth.bound.position) and q[-1, 0] == pytest.approx(0.3, abs=1e-9)
    assert np.abs(v[:, 1]).max() <= truth.bound.velocity


def test_a_tumbling_body_keeps_energy_and_angular_momentum() -> None:
    scene = load_scene(find_scene("tumbling_body"))
    q, v = scene_truth(scene, 0.5).state(np.linspace(0.0, 0.5, 6))
    inertia, mechanism = np.diag([1e-3, 2e-3, 2.8e-3]), System(scene).mechanism
    axes = [mechanism.placements(model_of(mechanism).normalize(x))[0][0] for x in q]
    momentum = [turn @ inertia @ w[3:] for turn, w in zip(axes, v, strict=True)]
    assert np.ptp(momentum, axis=0) == pytest.approx(0.0, abs=1e-9 * 2e-3 * 6.0 * 10.0)
    energy = [w[3:] @ inertia @ w[3:] for w in v]
    assert energy == pytest.approx([energy[0]] * len(energy), rel=1e-9)


@pytest.mark.parametrize(("given", "error", "says"), [
    ((lambda: scene_from_text(DROP + "hand: {body: ball}\n"), 0.1, True), ArgumentError, "a scene without quaternions"),
    ((lambda: load_scene(find_scene("box_stack")), 0.1), SolverError, "box_stack: .* contacts overlap"),
    ((lambda: scene_from_text(BOUNCING % 0.97), 6.0, False, 20), SolverError, "impacts accumulate, 20 before"),
])  # fmt: skip
def test_refusals(given: Any, error: type[Exception], says: str) -> None:
    make, *options = given
    with pytest.raises(error, match=says):
        scene_truth(make(), *options)

"""Dry friction of joints: Coulomb's law, implicit, booked as dissipation, with contact and without."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.scene import Scene, scene_from_text
from iapb.simulation import simulate

G = 9.81
SLIDE = """name: slide
rate: 1000
duration: 1
gravity: [0, -9.81]
contact: {contact}
bodies:
  - {{name: a, joint: prismatic, axis: [0, 1], mass: 2, velocity: [{v}], joint_friction: {friction}}}
"""
ARM = """name: arm
dimensions: 3
rate: 2000
duration: 1.5
gravity: [0, 0, -9.81]
bodies:
  - {name: a, joint: revolute, axis: [0, 1, 0], mass: 1, center_of_mass: [0.3, 0, 0], inertia: [0.01, 0.02, 0.03],
     joint_friction: 0.8, joint_damping: 0.1}
  - {name: b, parent: a, joint: revolute, axis: [0, 1, 0], origin: [0.6, 0, 0], mass: 1, center_of_mass: [0.3, 0, 0],
     inertia: [0.01, 0.02, 0.03], joint_friction: 0.5, joint_limits: [-0.4, 0.4]}
"""


def slide(friction: float, v: float = 0.0, contact: str = "{}") -> Scene:
    return scene_from_text(SLIDE.format(friction=friction, v=v, contact=contact))


@pytest.mark.parametrize("share", [0.2, 0.9, 0.999])
@pytest.mark.parametrize("contact", ["{}", "paper"])
def test_a_weight_above_the_friction_slides_with_what_is_left(share: float, contact: str) -> None:
    run = simulate(slide(share * 2.0 * G, contact=contact))
    assert run.v[-1, 0] == pytest.approx(-(1.0 - share) * G, rel=1e-9)
    assert run.q[-1, 0] == pytest.approx(-0.5 * (1.0 - share) * G, rel=2.0 * run.dt)


@pytest.mark.parametrize("share", [1.0, 1.001, 50.0])
def test_a_weight_below_the_friction_stays(share: float) -> None:
    run = simulate(slide(share * 2.0 * G))
    assert np.abs(run.v).max() <= 1.1e-10 and np.abs(run.q).max() <= 1.1e-10
    np.testing.assert_allclose(run.friction_force[-1], 2.0 * G, rtol=1e-9)


@pytest.mark.parametrize("friction", [30.0, 100.0])
def test_a_thrown_slide_stops_after_its_way_and_stays(friction: float) -> None:
    """Way v²/2a; a step moves with the velocity at its end, half a step of v less."""
    run = simulate(slide(friction, v=3.0))
    way = 9.0 / (2.0 * (G + friction / 2.0))
    assert run.q[-1, 0] == pytest.approx(way - 0.5 * 3.0 * run.dt, abs=20.0 * run.dt**2)
    assert np.abs(run.v[-200:]).max() < 1e-9


def test_every_step_dissipates_and_the_books_balance() -> None:
    """Two dry joints, one damped, one at its limits; each friction force is at most its limit."""
    run = simulate(scene_from_text(ARM))
    assert np.diff(run.energy["friction_work"], prepend=0.0).max() <= 0.0
    assert run.energy["friction_work"][-1] < -1.0
    assert np.abs(run.friction_force[:, 1]).max() <= 0.5 * (1.0 + 1e-9)
    assert not run.distrust and run.contacts.gap.size
    total = run.energy["kinetic"] + run.energy["potential"]
    assert abs(run.energy["integration_residual"][-1]) < 0.02 * (total[0] - total[-1])


def test_friction_of_contacts_and_of_joints_are_solved_together() -> None:
    """A hand drags a block on a slide over a floor: joint and floor share the load."""
    text = """name: drag
rate: 1000
duration: 0.5
gravity: [0, -9.81]
bodies:
  - {{name: x, joint: prismatic, axis: [1, 0], mass: 1, joint_friction: 2}}
  - {{name: y, parent: x, joint: prismatic, axis: [0, 1], mass: 1, shapes: [{{kind: box, size: [0.1, 0.1]}}]}}
walls: [{{name: floor, kind: half_plane, point: [0, -0.05], normal: [0, 1]}}]
contact: {{friction: 0.3}}
hand: {{body: x, force: [{force}, 0, 0]}}
"""
    holds = 2.0 + 0.3 * G
    still = simulate(scene_from_text(text.format(force=0.99 * holds)))
    assert abs(still.q[-1, 0]) < 1e-9
    moving = simulate(scene_from_text(text.format(force=holds + 1.0)))
    assert moving.v[-1, 0] == pytest.approx(0.5 * 1.0 / 2.0, rel=0.02)


def test_friction_of_a_follower_is_that_of_its_leader_times_the_multiplier() -> None:
    """1.25 kg move along y and 0.25 kg with twice the rate along x, against 1 N + 2 × 1 N."""
    text = SLIDE.format(friction=1.0, v=0.0, contact="{}").replace("mass: 2", "mass: 1")
    text += (
        "  - {name: b, parent: a, joint: prismatic, axis: [1, 0], mass: 0.25, joint_friction: 1, "
        "joint_mimic: {body: a, multiplier: -2}}\n"
    )
    run = simulate(scene_from_text(text))
    assert run.v[-1, 0] == pytest.approx(-(1.25 * G - 3.0) / (1.25 + 0.25 * 4.0), rel=1e-9)

"""Rigid worlds and event-driven truth: friction by body, damping and limits of joints, a hand's force over time."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.advice.certificate import certify
from iapb.errors import ArgumentError
from iapb.scene import Scene, find_scene, load_scene, scene_from_text
from iapb.simulation import simulate
from reference.scene_events import scene_truth
from reference.worlds import run_world

ARM = """
name: arm
rate: 2000
duration: 0.6
gravity: [0, -9.81]
bodies:
  - {name: upper, joint: revolute, mass: 1.0, inertia: 0.01, center_of_mass: [0.2, 0], joint_limits: [-0.5, 1.0],
     joint_damping: 0.3}
  - {name: lower, parent: upper, joint: revolute, origin: [0.4, 0], mass: 0.5, inertia: 0.005,
     center_of_mass: [0.15, 0], joint_limits: [-0.6, 0.4], velocity: [3.0]}
contact: {stiffness: 2e5, damping: 60, restitution: 0.0}
"""


def arm(**values: object) -> Scene:
    return scene_from_text(ARM).with_values(values)


@pytest.mark.parametrize("world", ["IAPB", "ideal"])
def test_damped_and_limited_joints_converge_to_the_event_driven_truth(world: str) -> None:
    truth, errors = scene_truth(arm(), 0.6), []
    assert len(truth.events) >= 2  # both joints meet a limit
    for rate in (1000.0, 4000.0):
        stiffness = {"contact.forces": "paper", "contact.stiffness": 5e4 * rate / 1000.0}
        run = run_world(arm(rate=rate, **stiffness), world)
        errors.append(float(np.abs(run.q - truth.state(run.time)[0]).max()))
    assert errors[1] < 0.5 * errors[0] < (0.005 if world == "ideal" else 0.05)  # springs sag, too


@pytest.mark.parametrize("damping", [1.0, 100.0, 900.0])
def test_a_blow_comes_before_damping_and_gains_nothing(damping: float) -> None:
    """m = 1 kg, e = 1: v⁺ = −v⁻ of the step's start, and damping divides it by 1 + dt D in the same step."""
    run = run_world(scene_from_text(f"""
name: slider
rate: 1000
duration: 0.005
bodies:
  - {{name: a, joint: prismatic, axis: [1, 0], mass: 1, inertia: 0.01, joint_damping: {damping},
     joint_limits: [-9, 0.1], velocity: [1000]}}
contact: {{restitution: 1}}
"""), "ideal")
    (step,), impacts = run.impacts.step, run.impacts
    came = 1000.0 / (1.0 + 1e-3 * damping) ** step
    assert impacts.v_minus[0] == run.v[step] == pytest.approx([came], rel=1e-12)
    assert impacts.v_plus[0] == pytest.approx([-came], rel=1e-12)
    assert run.v[step + 1] == pytest.approx([-came / (1.0 + 1e-3 * damping)], rel=1e-12)
    assert certify(run).gains == 0 and np.abs(run.energy["impact_loss"]).max() <= 1e-12 * came**2
    assert (np.diff(run.energy["friction_work"]) < 0.0).all()


def test_blows_of_damped_joints_gain_nothing_and_a_huge_damping_holds_them() -> None:
    damped = {"bodies.upper.joint_damping": 900.0, "bodies.lower.joint_damping": 5.0, "contact.restitution": 1.0}
    run = run_world(arm(gravity=None, **damped, duration=0.05, **{"bodies.lower.velocity": [300.0]}), "ideal")
    lost = np.diff(run.energy["impact_loss"], prepend=0.0)[run.impacts.step]
    assert len(lost) and (lost >= -1e-9).all() and (np.diff(run.energy["kinetic"]) <= 1e-9).all()
    held = run_world(arm(**{"bodies.upper.joint_damping": 1e9, "bodies.lower.joint_damping": 1e9}), "ideal-friction")
    assert np.abs(held.q).max() < 2e-3 and (np.diff(held.energy["friction_work"]) <= 0.0).all()


def test_every_world_takes_the_hands_force_over_time() -> None:
    table = [[0.0, 0.0, 0.0, 0.0], [0.2, 0.2, 0.1, 0.0]]
    scene = load_scene(find_scene("peg_corner")).with_values(
        {"duration": 0.2, "hand.force": [0, 0, 0], "hand.force_table": table})
    engine, rigid = simulate(scene), run_world(scene, "ideal")
    assert np.array_equal(simulate(scene, world="IAPB").hand_force, rigid.hand_force)
    assert rigid.hand_force[-1, 0] == pytest.approx(0.2 * (len(rigid.time) - 2) * scene.step / 0.2)
    assert engine.hand_force[-1, 0] == rigid.hand_force[-1, 0]
    with pytest.raises(ArgumentError, match="does not change over time"):
        scene_truth(scene, 0.2)

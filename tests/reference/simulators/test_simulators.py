"""Adapters keep the laws of their scenes; an engine that is absent says how to install it."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest

from iapb.errors import MissingDependencyError
from reference.simulators import FIXED_SCENES, SIMULATORS, find_simulator, fixed_scene
from reference.simulators.simulator import damping_for, spring_restitution, viscous_dissipation_for
from reference.simulators.trajectory import Trajectory, deepest_overlap

ROUNDING = 1e-10  # of some hundred steps, and the 1e-14 by which Pinocchio's Delassus matrix is damped


def engine(name):
    """The adapter, or a skip that says why."""
    simulator = find_simulator(name)
    try:
        simulator.version()
    except MissingDependencyError as error:
        pytest.skip(str(error))
    return simulator


def run(name, scene, step=None, duration=None):
    simulator = engine(name)
    settings = simulator.settings(scene, step)
    return simulator.run(scene, settings, settings.step, duration or scene.duration)


@pytest.mark.parametrize("name", FIXED_SCENES)
def test_truth_of_every_impact_scene_keeps_its_energy(name):
    scene = fixed_scene(name)
    if scene.rests:
        return
    start, end = (np.array([b.velocity for b in scene.bodies]), np.array(scene.final_velocities))
    before, after = (scene.masses @ (v**2).sum(axis=1) for v in (start, end))
    assert after == pytest.approx(scene.restitution**2 * before, rel=1e-14)
    if not scene.obstacles:
        np.testing.assert_allclose(scene.masses @ end, scene.masses @ start, atol=1e-15)


@pytest.mark.parametrize("name", ["iapb", "rigid", "pinocchio", "siconos"])
def test_impacts_conserve_energy_and_momentum_in_the_cradle(name):
    scene = fixed_scene("elastic_cradle")
    motion = run(name, scene)
    energy, momentum = motion.kinetic_energy(scene), np.einsum("b,nbi->ni", scene.masses, motion.velocity)
    np.testing.assert_allclose(energy, energy[0], rtol=ROUNDING)
    np.testing.assert_allclose(momentum, np.broadcast_to(momentum[0], momentum.shape), atol=ROUNDING)
    np.testing.assert_allclose(motion.velocity[-1], scene.final_velocities, atol=ROUNDING)


@pytest.mark.parametrize("name", ["mujoco", "drake", "bullet"])
def test_stand_ins_for_restitution_hand_the_velocity_on(name):
    scene = fixed_scene("elastic_cradle")
    np.testing.assert_allclose(run(name, scene).velocity[-1], scene.final_velocities, atol=1e-2)


@pytest.mark.parametrize("name", SIMULATORS)
def test_box_stays_at_rest(name):
    scene = fixed_scene("resting_box")
    motion = run(name, scene, step=1e-3, duration=0.2)
    assert np.abs(motion.position - motion.position[0]).max() < 1e-3


@pytest.mark.parametrize("name", ["rigid", "pinocchio"])
def test_sixteen_corners_land_as_four(name):
    ends = [run(name, fixed_scene(scene)).velocity[-1] for scene in ("box_on_four_corners", "box_on_sixteen_corners")]
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-10)


def test_overlap_is_measured_alike_for_balls_and_boxes():
    scene = fixed_scene("resting_box")
    still = run("rigid", scene, duration=2e-3)
    sunk = replace(still, position=still.position - [0.0, 0.0, 1e-4])
    assert deepest_overlap(scene, still) == pytest.approx(0.0, abs=1e-15)
    assert deepest_overlap(scene, sunk) == pytest.approx(1e-4, rel=1e-9)
    balls = fixed_scene("bernoulli")
    place = np.array([[body.position for body in balls.bodies]])
    near = place - [[[0.0, 2e-3, 0.0], [0.0, 2e-3, 0.0], [0.0, 0.0, 0.0]]]  # upper ball 2 mm into the lower one
    turn = np.broadcast_to([0.0, 0.0, 0.0, 1.0], (1, 3, 4))
    motion = Trajectory(np.zeros(1), near, turn, np.zeros((1, 3, 3)), np.zeros((1, 3, 3)))
    assert deepest_overlap(balls, motion) == pytest.approx(2e-3, rel=1e-9)


@pytest.mark.parametrize("restitution", [0.2, 0.5, 0.9])
def test_damping_gives_the_restitution_asked_for(restitution):
    stiffness = 1e4
    ratio = damping_for(restitution, stiffness) / (2.0 * np.sqrt(stiffness))
    assert spring_restitution(ratio) == pytest.approx(restitution, rel=1e-9)
    x, v, d, h = 0.0, 1.0, viscous_dissipation_for(restitution, 1.0), 1e-6
    while x >= 0.0 and 1.0 + d * v > 0.0:  # Hunt and Crossley's contact, stepped finely
        v -= h * stiffness * x * (1.0 + d * v)
        x += h * v
    assert -v == pytest.approx(restitution, rel=1e-2)


@pytest.mark.parametrize(("name", "module"), [("mujoco", "mujoco"), ("bullet", "pybullet"), ("drake", "pydrake.all")])
def test_missing_engine_says_how_to_install_it(monkeypatch, name, module):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(MissingDependencyError, match=r"\[peers\]"):
        find_simulator(name).version()

"""The scenes raced against MuJoCo are the same scenes: masses, contacts, forces; and they rest while they are timed."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.errors import MissingDependencyError
from iapb.scene import scene_from_text
from iapb.system import System
from verification.cost import against_mujoco
from verification.cost.against_mujoco import OwnLoop, fastest_of_theirs, race_mujoco
from verification.cost.resting_scenes import RestingScene, resting_scenes
from verification.finding import titled

SCENES = {scene.name: scene for scene in resting_scenes()}


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_masses_are_the_same(scene: RestingScene) -> None:
    mujoco = pytest.importorskip("mujoco")
    system = System(scene_from_text(scene.text, scene.file))
    for make in scene.models.values():
        model = make("Newton")
        data = mujoco.MjData(model)
        if scene.pose:
            data.qpos[:] = scene.pose
        mujoco.mj_forward(model, data)
        theirs = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, theirs) if mujoco.__version__ >= "4" else mujoco.mj_fullM(model, theirs, data.qM)
        np.testing.assert_allclose(theirs, system.make_state().mass_matrix, rtol=1e-9, atol=1e-12)
        assert model.opt.timestep == system.dt


@pytest.mark.parametrize("name", ["peg in the corner", "free box on a plane"])
def test_our_scene_rests_and_carries_the_load(name: str) -> None:
    loop = OwnLoop(SCENES[name], 64)
    loop.sample()
    assert loop.contacts == 4.0
    assert loop.moved < 1e-12
    simulation = loop.simulation
    load = simulation.port.applied - (0.0 if name.startswith("peg") else np.array([0, 0, 9.81, 0, 0, 0]))
    np.testing.assert_allclose(simulation.state.penalty_force, -load, atol=1e-9)


def test_a_race_states_contacts_of_both_and_keeps_every_solver() -> None:
    pytest.importorskip("mujoco")
    races = race_mujoco([SCENES["peg in the corner"]], rounds=3, steps=32)
    assert {(race["MuJoCo's form"], race["MuJoCo's contacts"]) for race in races.records()} == {
        ("box", 8.0), ("four corner balls", 4.0)}  # fmt: skip
    assert set(races.column("MuJoCo's solver")) == set(against_mujoco.SOLVERS)
    assert set(races.column("iapb's contacts")) == {4.0} and max(races.column("MuJoCo's drift")) < 1e-6


def test_the_fastest_solver_counts() -> None:
    keys = ("scene", "MuJoCo's form", "MuJoCo's solver", "MuJoCo's step")
    races = titled(keys, [("a", "box", "slow", 9.0), ("a", "box", "fast", 3.0), ("a", "box", "middle", 5.0)])
    assert [race["MuJoCo's solver"] for race in fastest_of_theirs(races)] == ["fast"]


def test_without_mujoco_the_race_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "mujoco", None)
    with pytest.raises(MissingDependencyError, match="mujoco"):
        race_mujoco([])

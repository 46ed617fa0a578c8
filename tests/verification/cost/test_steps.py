"""The scenes raced against MuJoCo are the same scenes: masses, contacts, forces; and they rest while they are timed."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.scene import scene_from_text
from iapb.system import System
from verification.check import Study
from verification.cost import robots, steps
from verification.cost.growth import power_law
from verification.cost.resting import RestingScene, resting_scenes
from verification.cost.steps import OwnLoop
from verification.finding import NOT_COMPUTED
from verification.table import titled

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
    races = list(steps.race(Study(), "peg in the corner", 32))
    assert {(row["MuJoCo's form"], row["MuJoCo's contacts"]) for row in races} == {
        ("box", 8.0), ("four corner balls", 4.0)}  # fmt: skip
    assert {row["MuJoCo's solver"] for row in races} == set(steps.SOLVERS)
    assert {row["iapb's contacts"] for row in races} == {4.0} and max(row["MuJoCo's drift"] for row in races) < 1e-6


def test_the_fastest_solver_counts() -> None:
    keys = ("scene", "MuJoCo's form", "MuJoCo's solver", "MuJoCo's step")
    races = titled(keys, [("a", "box", "slow", 9.0), ("a", "box", "fast", 3.0), ("a", "box", "middle", 5.0)])
    assert [race["MuJoCo's solver"] for race in steps.fastest_of_theirs(races)] == ["fast"]


def test_without_mujoco_the_race_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(steps, "find_spec", lambda name: None)
    [part] = steps.RACES.sentences(steps.RACES.table(Study()))
    assert part.verdict == NOT_COMPUTED and "MuJoCo is not installed" in part.sentence


def test_pairs_tested_grow_linearly_where_all_pairs_grow_quadratically() -> None:
    """All pairs give 2 in the limit; the density of the field, and with it the neighbours of a disc, changes a little.
    """
    costs = steps.BODIES.table(Study(), (20, 50, 100, 200))
    assert power_law(costs.column("bodies"), costs.column("pairs tested")) < 1.2
    assert power_law(costs.column("bodies"), costs.column("pairs of shapes")) > 1.9


def test_robots_are_timed_in_both_forms(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pinocchio")
    monkeypatch.setattr(robots, "STATES", 3)
    monkeypatch.setattr(robots, "ROUNDS", {"quick": 2})
    table = robots.ROBOTS.table(Study(), list(robots.FILES)[:1])
    assert table.column("form") == [robots.ONE, robots.ONE, robots.MANY, robots.MANY]
    assert min(table.column("ours")) > 0.0 and min(table.column("Pinocchio")) > 0.0

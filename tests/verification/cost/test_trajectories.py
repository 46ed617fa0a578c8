"""Whole motions: the truth has no error, a faulty motion has its own, failures and time-outs stay
on record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from iapb.run import Run
from iapb.scene import Scene
from iapb.simulation import simulate
from reference.scene_events import scene_truth
from verification.cost import trajectories as study

NAME = "bouncing_ball"
SCENE = study.scene_of(NAME)
LENGTH = study.TRAJECTORY_SCENES[NAME]


@pytest.fixture(scope="module")
def judge() -> study.Judge:
    return study.Judge(SCENE, LENGTH)


@pytest.fixture(scope="module")
def true_run(judge: study.Judge) -> Run:
    """Return a run of the right length with the states of the truth."""
    run = simulate(SCENE)
    q, v = judge.truth.state(run.time)
    return replace(run, q=q, v=v)


def test_the_truth_ends_as_the_parabolas_do(judge: study.Judge, true_run: Run) -> None:
    np.testing.assert_allclose(true_run.v[-1, :3], [0.0, 0.0, -0.1452010665010186], atol=1e-9)
    errors, note = judge.errors(true_run)
    assert note == study.BELOW
    assert errors["position"] == judge.bound < 1e-6  # what the truth is worth, and no better
    assert errors["energy made"] < 1e-6


def test_a_motion_that_is_off_is_off_by_as_much(judge: study.Judge, true_run: Run) -> None:
    shifted = replace(true_run, q=true_run.q + [0.0, 0.03, 0.0, 0.0, 0.0, 0.0, 0.0])
    errors, note = judge.errors(shifted)
    assert errors["position"] == pytest.approx(0.03 / LENGTH)
    assert note == ""
    errors, _ = judge.errors(replace(true_run, v=1.1 * true_run.v))
    assert errors["energy made"] > 0.1


def test_a_turn_about_the_center_is_an_error_of_the_point_beside_it(
    judge: study.Judge, true_run: Run
) -> None:
    half_turn = np.array([0.0, 0.0, 1.0, 0.0])  # about z
    turned = replace(
        true_run,
        q=np.concatenate([true_run.q[:, :3], np.tile(half_turn, (len(true_run.q), 1))], axis=1),
    )
    assert judge.errors(turned)[0]["position"] == pytest.approx(
        1.0
    )  # a length, from half of it to minus half of it


def test_failures_and_time_outs_are_records(judge: study.Judge, true_run: Run) -> None:
    def world(scene: Scene) -> tuple[Run, float]:
        if scene.step > 1e-3:
            raise ValueError("too coarse")
        return true_run, 0.3 * 1e-3 / scene.step

    runs = study.over_steps(SCENE, world, judge, (1e-4, 1e-3, 1e-2), longest=1.0)
    assert [run["step [ms]"] for run in runs] == [10.0, 1.0, 0.1]
    assert [run["outcome"] for run in runs] == [study.FAILED, study.OK, study.TIMED_OUT]
    assert "too coarse" in runs[0]["note"]
    assert runs[0]["position"] is None
    assert runs[2]["time [ms/s]"] == pytest.approx(3000.0 / SCENE.duration)
    assert "3 s" in runs[2]["note"]


@pytest.mark.parametrize("name", study.TRAJECTORY_SCENES)
def test_no_impact_is_at_a_multiple_of_a_step(name: str) -> None:
    """Such a run is exact by chance, and its world seems better than it is.

    A step that misses an impact by a share r of itself has r times the usual error of the instant:
    half a hundredth is the least that is let through, on the peg at the finest step; a scene that
    is not shifted has 1e-13.
    """
    scene = study.scene_of(name)
    instants = np.array(scene_truth(scene, scene.duration).events)
    assert len(instants)
    for step in {step for steps in study.STEPS.values() for step in steps}:
        count = instants / step
        assert np.abs(count - np.rint(count)).min() > 0.005, step

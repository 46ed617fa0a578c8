"""Whole motions: the truth has no error, a faulty motion has its own, failures and time-outs stay on record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reference.simulators import FixedScene, Trajectory
from verification.cost import trajectories
from verification.cost.trajectories import FAILED, OK, TIMED_OUT, _Judge, _over_steps, bouncing_ball

SCENE = bouncing_ball()


@pytest.fixture(scope="module")
def judge() -> _Judge:
    return _Judge(SCENE)


def _true_motion(judge: _Judge) -> Trajectory:
    return judge._at(np.linspace(0.0, SCENE.duration, 200))


def test_the_truth_ends_as_the_parabolas_do(judge: _Judge) -> None:
    np.testing.assert_allclose(_true_motion(judge).velocity[-1], SCENE.final_velocities, atol=1e-9)
    assert max(np.abs(judge.errors(_true_motion(judge)))) < 1e-12


def test_a_motion_that_is_off_is_off_by_as_much(judge: _Judge) -> None:
    true = _true_motion(judge)
    shifted = replace(true, position=true.position + [0.0, 0.03, 0.0])
    assert judge.errors(shifted)[0] == pytest.approx(0.03 / SCENE.length)
    slow = replace(true, velocity=0.9 * true.velocity)
    _, velocity, energy = judge.errors(slow)
    assert 0.0 < velocity < 0.1 and energy < 0.0


def test_failures_and_time_outs_are_records(judge: _Judge) -> None:
    def way(scene: FixedScene, step: float, duration: float) -> tuple[Trajectory, float]:
        if step > 1e-3:
            raise ValueError("too coarse")
        return _true_motion(judge), 0.3 * 1e-3 / step

    runs = _over_steps(SCENE, "made up", way, judge, (1e-4, 1e-3, 1e-2), longest=1.0)
    assert [(run.step, run.status) for run in runs] == [(1e-2, FAILED), (1e-3, OK), (1e-4, TIMED_OUT)]
    assert "too coarse" in runs[0].note and np.isnan(runs[0].position)
    assert runs[2].seconds == pytest.approx(3.0) and "3 s" in runs[2].note


def test_impulses_meet_the_truth_better_with_every_step(judge: _Judge) -> None:
    way = trajectories.methods()["IAPB, midpoint"]
    errors = [judge.errors(way(SCENE, step, SCENE.duration)[0])[0] for step in (8e-3, 1e-3, 1e-4)]
    assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2]

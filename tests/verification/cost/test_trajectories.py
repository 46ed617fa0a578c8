"""Whole motions: the truth has no error, a faulty motion has its own, failures and time-outs stay on record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reference.simulators import FixedScene, Trajectory
from verification.cost import trajectories as study

SCENE = study.bouncing_ball()


@pytest.fixture(scope="module")
def judge() -> study.Judge:
    return study.Judge(SCENE)


def _true_motion(judge: study.Judge) -> Trajectory:
    return judge._at(np.linspace(0.0, SCENE.duration, 200))


def test_the_truth_ends_as_the_parabolas_do(judge: study.Judge) -> None:
    np.testing.assert_allclose(_true_motion(judge).velocity[-1], SCENE.final_velocities, atol=1e-9)
    errors, note = judge.errors(_true_motion(judge))
    assert note == f"position, energy {study.BELOW}"
    assert {name: errors[name] for name in judge.bounds} == judge.bounds  # what the truth is worth, and no better
    assert 0.0 < max(judge.bounds.values()) < 1e-6


def test_a_motion_that_is_off_is_off_by_as_much(judge: study.Judge) -> None:
    true = _true_motion(judge)
    shifted = replace(true, position=true.position + [0.0, 0.03, 0.0])
    errors, note = judge.errors(shifted)
    assert errors["position"] == pytest.approx(0.03 / SCENE.length) and note == f"energy {study.BELOW}"
    slow = replace(true, velocity=0.9 * true.velocity)
    errors, _ = judge.errors(slow)
    assert errors["signed energy"] == -errors["energy"] < 0.0


def test_stiffened_walls_bounce_with_the_restitution_of_the_scene() -> None:
    """An impact of eight steps resolves the bounce to 4 %: at a fixed stiffness without damping, e would be 1."""
    motion, *_ = study.methods()[study.STIFFENED](SCENE, 1e-4, 0.2)
    rise, fall = motion.velocity[:, 0, 2].max(), -motion.velocity[:, 0, 2].min()
    assert rise / fall == pytest.approx(SCENE.restitution, rel=0.04)


def test_failures_and_time_outs_are_records(judge: study.Judge) -> None:
    def way(scene: FixedScene, step: float, duration: float) -> tuple[Trajectory, float, float]:
        if step > 1e-3:
            raise ValueError("too coarse")
        return _true_motion(judge), 0.3 * 1e-3 / step, 0.0

    runs = study.over_steps(SCENE, way, judge, (1e-4, 1e-3, 1e-2), longest=1.0)
    assert [run["step [ms]"] for run in runs] == [10.0, 1.0, 0.1]
    assert [run["outcome"] for run in runs] == [study.FAILED, study.OK, study.TIMED_OUT]
    assert "too coarse" in runs[0]["note"] and runs[0]["position"] is None
    assert runs[2]["time [ms/s]"] == pytest.approx(3000.0 / SCENE.duration) and "3 s" in runs[2]["note"]


def test_impulses_meet_the_truth_better_with_every_step(judge: study.Judge) -> None:
    way = study.methods()["IAPB, midpoint"]
    errors = [judge.errors(way(SCENE, step, SCENE.duration)[0])[0]["position"] for step in (8e-3, 1e-3, 1e-4)]
    assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2]


@pytest.mark.parametrize("name", study.TRAJECTORY_SCENES)
def test_no_impact_is_at_a_multiple_of_a_step(name: str) -> None:
    """Such a run is exact by chance, and its method seems better than it is.

    A step that misses an impact by a share r of itself has r times the usual error of the instant: half a hundredth is
    the least that is let through, on the peg at the finest step; a scene that is not shifted has 1e-13.
    """
    instants = np.array(study.Judge(study.TRAJECTORY_SCENES[name]()).truth.events)
    assert len(instants)
    for step in {step for steps in study.STEPS.values() for step in steps}:
        count = instants / step
        assert np.abs(count - np.rint(count)).min() > 0.005, step

"""The rigid world against event-driven truth, and a law that does not converge."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from iapb.errors import SolverError
from iapb.scene import find_scene, load_scene
from iapb.system import System
from reference.scene_events import COMPUTATIONS, SceneTruth, scene_truth
from reference.time_stepping import RigidConstraints
from verification.check import Study
from verification.complementarity import convergence as study

BY_SCENE = {case.scene: case for case in study.CASES}
EVENTS = {
    "peg_corner": 3,
    "bernoulli_balls": 1,
    "arm_pushing": 1,
    "box_dropped_in_space": 2,
    "arm_meets_a_wall_in_space": 1,
}


@cache
def truth_of(scene: str) -> SceneTruth:
    """The truth of a case, computed once for all tests."""
    return scene_truth(study.scene_of(scene), BY_SCENE[scene].duration, BY_SCENE[scene].coupled)


@pytest.mark.parametrize("scene", EVENTS)
def test_the_rigid_world_converges_at_first_order(
    scene: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(study, "scene_truth", lambda *_: truth_of(scene))
    table = study.CONVERGENCE.table(Study(), [BY_SCENE[scene]])
    coarse, fine = table.records()
    assert fine["events"] == EVENTS[scene] and table.holds == (None, True)
    assert (
        fine["order, positions"] > 0.6
        and fine["order, velocities"] > 0.6
        and coarse["step"] > 3.9 * fine["step"]
    )


@dataclass(frozen=True)
class _Halved(RigidConstraints):
    """A rigid world whose contact impulses are halved: a planted fault."""

    def advance(self, system: Any, state: Any, applied_force: Any, dt: float) -> Any:
        before = state.v.copy()
        result = super().advance(system, state, applied_force, dt)
        return result._replace(v=0.5 * (before + result.v))


@pytest.mark.parametrize("case", study.QUICK)
def test_a_truth_does_not_depend_on_rounding(case: study.TruthCase) -> None:
    """Starts that differ by 1e-14 to 1e-12 have the same events and stay within the bound that the
    truth states.

    With the contacts' forces taken one by one, these starts gave bernoulli_balls 1, 6 or more than
    60 events.
    """
    scene = study.scene_of(case.scene)
    truth = truth_of(case.scene)
    start = System(scene).make_state()
    time = np.linspace(0.0, case.duration, 101)
    rng = np.random.default_rng(0)
    size = 10.0 ** rng.uniform(-14.0, -12.0)
    near = tuple(x * (1.0 + size * rng.uniform(-1.0, 1.0, x.shape)) for x in (start.q, start.v))
    other = scene_truth(
        scene, case.duration, case.coupled, start=near, computations=COMPUTATIONS[:1]
    )
    assert len(other.events) == len(truth.events)
    assert other.events == pytest.approx(truth.events, abs=truth.bound.instant)
    assert np.abs(other.state(time)[0] - truth.state(time)[0]).max() <= truth.bound.position


def test_a_truth_that_is_not_known_well_enough_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    found = scene_truth(load_scene(find_scene("two_discs")), 0.2)
    vague = replace(found, bound=found.bound._replace(position=1e-4))
    monkeypatch.setattr(study, "scene_truth", lambda *_: vague)
    with pytest.raises(SolverError, match="its error is 1.0e-04"):
        study.converge(BY_SCENE["two_discs"])


def test_a_wrong_law_does_not_converge() -> None:
    assert not study.converge(study.TruthCase("peg_corner", 0.36, True), law=_Halved())[1]["holds"]

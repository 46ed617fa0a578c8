"""Laws along whole trajectories: random scenes keep them, each planted fault breaks its law."""

from __future__ import annotations

import numpy as np
import pytest

from verification.laws.planted import PLANTED_TRAJECTORY_FAULTS, residual_with_fault
from verification.laws.scenes import SceneCase, draw_scene, draw_spatial_scene
from verification.laws.trajectories import TRAJECTORY_LAWS, judge_run

STEPS = 200


@pytest.fixture(
    scope="module", params=[draw_scene, draw_spatial_scene], ids=["in the plane", "in space"]
)
def drawn(request: pytest.FixtureRequest) -> list[SceneCase]:
    rng = np.random.default_rng(7)
    return [request.param(rng, STEPS) for _ in range(60)]


def test_random_trajectories_keep_every_law(drawn: list[SceneCase]) -> None:
    applied = set()
    for case in drawn[:20]:
        for law, residual in judge_run(case.simulate()):
            applied.add(law)
            assert residual.passed, (case, residual)
    assert applied >= set(TRAJECTORY_LAWS) - {"device_limits"}


@pytest.mark.parametrize("law", TRAJECTORY_LAWS)
def test_the_planted_fault_breaks_its_law(law: str, drawn: list[SceneCase]) -> None:
    assert set(PLANTED_TRAJECTORY_FAULTS) == set(TRAJECTORY_LAWS)
    residual = residual_with_fault(law, drawn)
    assert residual is not None and not residual.passed


def test_a_run_of_another_law_is_asked_only_what_holds_for_it() -> None:
    from iapb import find_scene, load_scene
    from reference.worlds import run_world

    run = run_world(load_scene(find_scene("peg_corner")), "CBuc", steps=50)
    assert {law for law, _ in judge_run(run)} <= {"finite", "impact_energy", "impulse_momentum"}

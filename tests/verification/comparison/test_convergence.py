"""The rigid world against event-driven truth, and a law that does not converge."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest

from iapb.scene import scene_names
from reference.time_stepping import RigidConstraints
from verification.comparison.convergence import CASES, WITHOUT_TRUTH, TruthCase, converge
from verification.comparison.truth_scenes import TRUTH_SCENES

BY_SCENE = {case.scene: case for case in CASES}
QUICK = (
    "two_link_arm_a", "peg_corner", "peg_hole", "bernoulli_balls", "arm_pushing", "ball_dropped_in_space",
    "box_dropped_in_space", "cradle_in_space", "arm_meets_a_wall_in_space",
)  # fmt: skip


@pytest.mark.parametrize("scene", QUICK)
def test_the_rigid_world_converges_at_first_order(scene: str) -> None:
    found = converge(BY_SCENE[scene])
    assert found.events > 0 and found.first_order
    assert found.position_order > 0.6 and found.velocity_order > 0.6


@dataclass(frozen=True)
class _Halved(RigidConstraints):
    """A rigid world whose contact impulses are halved: a planted fault."""

    def advance(self, system: Any, state: Any, applied_force: Any, dt: float) -> Any:
        before = state.v.copy()
        result = super().advance(system, state, applied_force, dt)
        return result._replace(v=0.5 * (before + result.v))


def test_a_wrong_law_does_not_converge() -> None:
    assert not converge(TruthCase("peg_corner", 0.36, True, ""), law=_Halved()).first_order


def test_every_scene_of_the_project_has_a_truth_or_a_reason() -> None:
    assert (set(BY_SCENE) | set(WITHOUT_TRUTH)) - set(TRUTH_SCENES) == set(scene_names())
    assert set(TRUTH_SCENES) <= set(BY_SCENE)
    assert not set(BY_SCENE) & set(WITHOUT_TRUTH)

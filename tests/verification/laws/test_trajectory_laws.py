"""Laws along whole trajectories: random scenes keep them, each planted fault breaks its law."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from iapb.mechanics.mechanism import Mechanism
from iapb.run import Run
from verification.laws.planted import PLANTED_TRAJECTORY_FAULTS, residual_with_fault
from verification.laws.scenes import SceneCase, draw_scene, draw_spatial_scene
from verification.laws.trajectories import TRAJECTORY_LAWS, Trajectory, judge_run

STEPS = 200
TOO_FAR = 1.001


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


@pytest.fixture
def runs() -> list[Run]:
    rng = np.random.default_rng(3)
    return [draw_scene(rng, 60).simulate() for _ in range(20)]


def test_a_kernel_that_moves_too_far_breaks_kinematics(
    runs: list[Run], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The fault is in the run and in the mechanism that the law knows."""
    integrate = Mechanism.integrate
    monkeypatch.setattr(
        Mechanism, "integrate", lambda self, q, v, dt: integrate(self, q, v, TOO_FAR * dt)
    )
    moved = [replace(run, q=run.q[0] + TOO_FAR * (run.q - run.q[0])) for run in runs]
    found = [TRAJECTORY_LAWS["kinematics"].check(Trajectory(run)) for run in moved]
    applied = [residual for residual in found if residual is not None]
    assert len(applied) > 10 and not any(residual.passed for residual in applied)


def test_a_kernel_with_too_long_displacements_breaks_the_ledger(
    runs: list[Run], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The engine computes the work of the forces by the kernel, too."""
    displacements = Mechanism.displacements
    monkeypatch.setattr(
        Mechanism,
        "displacements",
        lambda self, qs, straight=False: TOO_FAR * displacements(self, qs, straight),
    )
    of_varying_mass = 0
    for run in runs:
        trajectory = Trajectory(run)
        residual = TRAJECTORY_LAWS["ledger"].check(trajectory)
        works = [values for name, values in run.energy.items() if name.endswith("_work")]
        if residual is not None and np.max(np.abs(works)) > 1e-6:
            assert not residual.passed
            of_varying_mass += not trajectory.system.mechanism.has_constant_mass_matrix
    assert of_varying_mass

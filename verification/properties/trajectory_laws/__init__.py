"""Laws of a whole trajectory by name: each is a function of a run's arrays, so a stored run can be judged as well.

A law returns a LawResidual, or None where it does not apply. To add one: write the file, add a line to TRAJECTORY_LAWS,
and a fault to `planted_trajectory`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from iapb.run import Run
from verification.properties.case import LawResidual
from verification.properties.trajectory_laws.device_limits import device_keeps_its_limits
from verification.properties.trajectory_laws.finite import state_stays_finite
from verification.properties.trajectory_laws.friction import friction_stays_in_its_cone
from verification.properties.trajectory_laws.impact_energy import impacts_take_energy
from verification.properties.trajectory_laws.impulse_momentum import impulses_explain_impacts
from verification.properties.trajectory_laws.kinematics import velocity_moves_configuration
from verification.properties.trajectory_laws.ledger import ledger_closes
from verification.properties.trajectory_laws.motion import forces_explain_motion
from verification.properties.trajectory_laws.penalty import contacts_push_by_the_penalty
from verification.properties.trajectory_laws.trajectory import Trajectory


class TrajectoryLaw(NamedTuple):
    """A law, in words and as a check."""

    statement: str
    check: Callable[[Trajectory], LawResidual | None]


TRAJECTORY_LAWS: dict[str, TrajectoryLaw] = {
    "finite": TrajectoryLaw("the state stays finite, or the run ends and says why", state_stays_finite),
    "impact_energy": TrajectoryLaw("no impact raises kinetic energy", impacts_take_energy),
    "impulse_momentum": TrajectoryLaw("M(v⁺ − v⁻) is the recorded impulse", impulses_explain_impacts),
    "motion": TrajectoryLaw("recorded forces explain the motion (1)", forces_explain_motion),
    "kinematics": TrajectoryLaw("q moves by the new velocity", velocity_moves_configuration),
    "ledger": TrajectoryLaw("the energy ledger closes", ledger_closes),
    "penalty": TrajectoryLaw("resting contacts push by (5)", contacts_push_by_the_penalty),
    "friction": TrajectoryLaw("friction stays in its cone (6)", friction_stays_in_its_cone),
    "device_limits": TrajectoryLaw("the device keeps its force limits", device_keeps_its_limits),
}


def judge_run(run: Run) -> Iterator[tuple[str, LawResidual]]:
    """Yield the residual of every law that applies to a run; the rest of a run that is not finite is not judged."""
    trajectory = Trajectory(run)
    for name, law in TRAJECTORY_LAWS.items():
        residual = law.check(trajectory)
        if residual is not None:
            yield name, residual
            if name == "finite" and not residual.passed:
                return

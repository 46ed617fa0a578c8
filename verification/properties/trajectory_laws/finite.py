"""The state stays finite, or the run ends and says why."""

from __future__ import annotations

import numpy as np

from verification.properties.case import LawResidual
from verification.properties.trajectory_laws.trajectory import Trajectory

_ARRAYS = ("time", "q", "v", "device_q", "device_v", "hand_force", "coupling_force", "penalty_force",
           "friction_force", "impulse", "environment_force", "device_force")  # fmt: skip


def state_stays_finite(trajectory: Trajectory) -> LawResidual:
    """Arrays with an entry that is not finite, plus one where an incomplete run gives no reason; 0 are allowed."""
    run = trajectory.run
    wrong = sum(not np.all(np.isfinite(getattr(run, name))) for name in _ARRAYS)
    wrong += sum(not np.all(np.isfinite(values)) for values in run.energy.values())
    return LawResidual("finite", float(wrong + (not run.complete and not run.stopped)), 0.0)

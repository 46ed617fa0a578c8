"""The device applies no more force than it can, whatever contact, coupling and rendering ask for."""

from __future__ import annotations

import numpy as np

from verification.properties.case import LawResidual
from verification.properties.trajectory_laws.trajectory import Trajectory


def device_keeps_its_limits(trajectory: Trajectory) -> LawResidual | None:
    """Largest |device force| over its limit; applies where impulses are fitted to the limits at all."""
    run = trajectory.run
    limit = (run.scene_resolved.get("device") or {}).get("force_limit")
    if limit is None or not run.device_force.size or run.law_settings.get("rendering", "full") == "full":
        return None
    return LawResidual("device_limits", float(np.max(np.abs(run.device_force) / np.array(limit))), 1.0)

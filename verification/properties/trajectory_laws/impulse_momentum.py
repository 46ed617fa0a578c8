"""(8): what an impact changes is what its impulse says, M (v⁺ − v⁻) = Jᵀp, and it starts from the state recorded."""

from __future__ import annotations

import numpy as np

from verification.properties.case import LawResidual
from verification.properties.trajectory_laws.trajectory import EPS, Trajectory, norm


def impulses_explain_impacts(trajectory: Trajectory) -> LawResidual | None:
    """Largest of |M (v⁺ − v⁻) − impulse|∞ over d ε ‖M‖ |v|, and of the impulses of a step against their sum."""
    impacts, run = trajectory.run.impacts, trajectory.run
    if not len(impacts.step):
        return None
    masses = trajectory.masses[impacts.step]
    change = np.einsum("kij,kj->ki", masses, impacts.v_plus - impacts.v_minus)
    size = norm(masses.reshape(len(masses), -1)) * norm(np.hstack([impacts.v_minus, impacts.v_plus]))
    apart = norm(change - impacts.impulse) / np.maximum(size, np.finfo(float).tiny)
    total = np.zeros_like(run.impulse)
    np.add.at(total, impacts.step, impacts.impulse)
    lost = norm(total - run.impulse) / max(float(np.max(np.abs(run.impulse))), np.finfo(float).tiny)
    worst = max(float(np.max(apart)), float(np.max(lost)))
    # Solving with M, scaled to a unit diagonal, loses ε κ of that matrix: measured, not assumed.
    return LawResidual("impulse_momentum", worst, 10.0 * impacts.v_plus.shape[1] * EPS * _scaled_condition(masses))


def _scaled_condition(masses: np.ndarray) -> float:
    scale = 1.0 / np.sqrt(np.einsum("kii->ki", masses))
    return float(np.max(np.linalg.cond(masses * scale[:, :, None] * scale[:, None, :])))

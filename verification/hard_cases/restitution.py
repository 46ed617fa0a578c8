"""How well the collisions of a run met restitution, from its record alone."""

from __future__ import annotations

import math

import numpy as np

from iapb.run import Run


def restitution_residual(run: Run) -> float:
    """Return the largest |P·v⁺ + e P·v⁻| / P·(v⁺ − v⁻) of all collisions; NaN where there is none to judge.

    P = Jᵀp is a collision's generalized impulse, so P·v sums the normal velocities with the impulses as weights, and
    P·(v⁺ − v⁻) = |Δu|² > 0. Where every row meets J v⁺ = −e J v⁻ the residual is zero. A rigid
    world's blow closes the gap and carries the step's forces as well: its first impulse alone is no collision, and NaN
    is returned.
    """
    if run.law == "rigid constraints":
        return math.nan
    e = float(run.scene_resolved["contact"]["restitution"])
    before, after = (np.einsum("kd,kd->k", run.impacts.impulse, v) for v in (run.impacts.v_minus, run.impacts.v_plus))
    struck = after - before > 0.0
    if not struck.any():
        return math.nan
    return float(np.max(np.abs(after + e * before)[struck] / (after - before)[struck]))

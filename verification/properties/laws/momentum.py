"""Momentum: a translation of all bodies changes no contact velocity, so its momentum is conserved, in every frame.

Energy alone does not see the paper's per-body rows (13)-(14); this does.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from verification.properties.bounds import Bounds
from verification.properties.case import ImpactCase, LawResidual, Resolver, outcome


def momentum_is_conserved(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Largest of |zᵀM(v⁺ − v⁻)| / (|z|_M |u|) and of the distance of f(v + z) from f(v) + z over translations z."""
    if case.translations is None or case.speed == 0.0 or not case.is_separated:
        return None
    v_plus, worst = outcome(resolver, case), 0.0
    for z in case.translations:
        size = float(np.linalg.norm(case.lower.T @ z))
        change = abs(float(z @ case.mass_matrix @ (v_plus - case.velocity))) / (size * case.speed)
        ride = z * (case.speed / size)
        moved = outcome(resolver, replace(case, velocity=case.velocity + ride))
        worst = max(worst, change, case.distance(moved, v_plus + ride))
    return LawResidual("momentum", worst, bounds.comparison(case))

"""(9): the generalized impulse M(v⁺ − v⁻) is Jᵀp for some p. v⁺ = −e v⁻ keeps energy and restitution, not this."""

from __future__ import annotations

import numpy as np

from verification.properties.bounds import Bounds
from verification.properties.case import ImpactCase, LawResidual, Resolver, own_outcome


def impulse_comes_from_the_contacts(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Part of Δu outside the row space of A, relative to |u|."""
    if not case.is_separated or case.speed == 0.0:
        return None
    change = case.lower.T @ (own_outcome(resolver, case) - case.velocity)
    outside = change - case.row_space.T @ (case.row_space @ change)
    return LawResidual("impulse_range", float(np.linalg.norm(outside)) / case.speed, bounds.comparison(case))

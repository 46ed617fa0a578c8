"""C06 for units: q' = S⁻¹q turns M, J, v into S M S, J S, S⁻¹v and must turn v⁺ into S⁻¹v⁺."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from verification.properties.bounds import Bounds
from verification.properties.case import ImpactCase, LawResidual, Resolver, outcome, own_outcome

_FACTORS = np.array([1.0, 30.0, 0.02, 5.0, 0.7])  # mild: the laws' bounds grow with κ(S M S)


def units_do_not_matter(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Distance of v⁺ from S v'⁺."""
    if not case.is_separated:
        return None
    s = np.resize(_FACTORS, case.coordinates)
    other = replace(
        case,
        mass_matrix=s[:, None] * case.mass_matrix * s,
        contact_jacobian=case.contact_jacobian * s,
        velocity=case.velocity / s,
        translations=None,
    )
    tolerance = max(bounds.comparison(case), bounds.comparison(other))
    distance = case.distance(own_outcome(resolver, case), s * outcome(resolver, other))
    return LawResidual("units", distance, tolerance)

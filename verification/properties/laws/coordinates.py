"""C06: any other coordinates q' = T⁻¹q give the same motion, v'⁺ = T⁻¹v⁺."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from verification.properties.bounds import Bounds
from verification.properties.case import ImpactCase, LawResidual, Resolver, outcome, own_outcome


def coordinates_do_not_matter(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Distance of v⁺ from T v'⁺ with T = 1 + a cyclic shift / 2, of condition at most 3."""
    if not case.is_separated:
        return None
    d = case.coordinates
    T = np.eye(d) + 0.5 * np.roll(np.eye(d), 1, axis=1)
    mass = T.T @ case.mass_matrix @ T
    other = replace(
        case,
        mass_matrix=0.5 * (mass + mass.T),
        contact_jacobian=case.contact_jacobian @ T,
        velocity=np.linalg.solve(T, case.velocity),
        translations=None,
    )
    if not other.is_separated:
        return None
    tolerance = max(bounds.comparison(case), bounds.comparison(other))
    distance = case.distance(own_outcome(resolver, case), T @ outcome(resolver, other))
    return LawResidual("coordinates", distance, tolerance)

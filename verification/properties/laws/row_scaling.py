"""A row times a positive number is the same contact in other units: by powers of two bit for bit, else to ε/σ."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from verification.properties.bounds import Bounds
from verification.properties.case import ImpactCase, LawResidual, Resolver, outcome, own_outcome

_POWERS = np.array([0, 7, -5, 12, -11, 3])
_FACTORS = np.array([3.0, 0.1, 7e2, 1.0, 1.3e-3])


def row_scale_does_not_matter(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Distance of the outcomes; infinite where a power of two changed a bit and that was promised."""
    if not case.is_separated or case.contacts == 0:
        return None
    plain = own_outcome(resolver, case)
    powers = np.ldexp(1.0, np.resize(_POWERS, case.contacts))
    by_powers = outcome(resolver, _scaled(case, powers))
    by_factors = outcome(resolver, _scaled(case, np.resize(_FACTORS, case.contacts)))
    worst = max(case.distance(plain, by_powers), case.distance(plain, by_factors))
    if bounds.bitwise_scaling and not np.array_equal(plain, by_powers):
        worst = np.inf
    return LawResidual("row_scaling", worst, bounds.comparison(case))


def _scaled(case: ImpactCase, factor: np.ndarray) -> ImpactCase:
    return replace(case, contact_jacobian=case.contact_jacobian * factor[:, None])

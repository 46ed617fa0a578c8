"""C03, (25) and (33): redundant rows give the velocity that any maximal independent subset gives."""

from __future__ import annotations

from dataclasses import replace

from verification.properties.bounds import Bounds
from verification.properties.case import ImpactCase, LawResidual, Resolver, outcome, own_outcome


def redundant_equals_reduced(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Distance of the outcomes with all rows and with independent ones."""
    rank = len(case.row_space)
    if not case.is_separated or rank == 0 or rank == case.contacts:
        return None
    from scipy.linalg import qr

    chosen = qr(case.unit_rows.T, mode="r", pivoting=True)[1][:rank]
    reduced = replace(case, contact_jacobian=case.contact_jacobian[sorted(chosen)])
    tolerance = max(bounds.comparison(case), bounds.comparison(reduced))
    distance = case.distance(own_outcome(resolver, case), outcome(resolver, reduced))
    return LawResidual("redundancy", distance, tolerance)

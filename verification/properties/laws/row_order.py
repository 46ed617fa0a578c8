"""The order in which contacts are listed carries no meaning."""

from __future__ import annotations

from dataclasses import replace

from verification.properties.bounds import Bounds
from verification.properties.case import ImpactCase, LawResidual, Resolver, outcome, own_outcome


def row_order_does_not_matter(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Distance of the outcomes with the rows as given and reversed."""
    if not case.is_separated or case.contacts < 2:
        return None
    reversed_rows = replace(case, contact_jacobian=case.contact_jacobian[::-1].copy())
    distance = case.distance(own_outcome(resolver, case), outcome(resolver, reversed_rows))
    return LawResidual("row_order", distance, bounds.comparison(case))

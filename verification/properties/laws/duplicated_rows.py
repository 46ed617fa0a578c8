"""A contact that is reported twice is one contact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from verification.properties.bounds import Bounds
from verification.properties.case import ImpactCase, LawResidual, Resolver, outcome, own_outcome


def duplicated_rows_change_nothing(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Distance of the outcomes without and with copies of the first rows."""
    if not case.is_separated or case.contacts == 0:
        return None
    copies = case.contact_jacobian[: (case.contacts + 1) // 2]
    doubled = replace(case, contact_jacobian=np.vstack([case.contact_jacobian, copies, copies[:1]]))
    if not doubled.is_separated:
        return None
    distance = case.distance(own_outcome(resolver, case), outcome(resolver, doubled))
    return LawResidual("duplicated_rows", distance, bounds.comparison(case))

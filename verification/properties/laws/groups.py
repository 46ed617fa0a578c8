"""Two groups of bodies that share no contact, resolved together or apart, move the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from verification.properties.bounds import Bounds
from verification.properties.case import Floats, ImpactCase, LawResidual, Resolver, outcome, own_outcome


def groups_do_not_interact(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Distance of the outcomes of the group and its mirror image resolved together and apart."""
    if not case.is_separated or case.speed == 0.0:
        return None
    d = case.coordinates
    together = replace(
        case,
        mass_matrix=_blocks(case.mass_matrix, case.mass_matrix),
        contact_jacobian=_blocks(case.contact_jacobian, -case.contact_jacobian[::-1]),
        velocity=np.concatenate([case.velocity, -2.0 * case.velocity]),
        translations=None,
    )
    both, alone = outcome(resolver, together), own_outcome(resolver, case)
    mirrored = outcome(
        resolver, replace(case, contact_jacobian=-case.contact_jacobian[::-1].copy(), velocity=-2.0 * case.velocity)
    )
    distance = max(case.distance(both[:d], alone), case.distance(both[d:], mirrored))
    return LawResidual("groups", distance, 2.0 * bounds.comparison(together))


def _blocks(one: Floats, other: Floats) -> Floats:
    (m, n), (k, l) = one.shape, other.shape
    joined = np.zeros((m + k, n + l))
    joined[:m, :n], joined[m:, n:] = one, other
    return joined

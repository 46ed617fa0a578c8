"""Momentum: a translation of all bodies changes no contact velocity, so its momentum is conserved, in every frame.

Energy alone does not see the paper's per-body rows (13)-(14); this does.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from verification.properties.bounds import Bounds
from verification.properties.case import ImpactCase, LawResidual, Resolver, outcome, own_outcome


def momentum_is_conserved(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Largest of |zᵀM(v⁺ − v⁻)| / (|z|_M |u|) and of the distance of f(v + z) from f(v) + z over translations z."""
    found = _change_and_ride(case, resolver)
    return None if found is None else LawResidual("momentum", max(found), bounds.comparison(case))


def momentum_is_conserved_unequal(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """The same, each over its tolerance, for restitutions that differ.

    There the sign of a contact's velocity matters, and a contact that grazes within the restitution's tolerance may be
    taken for approaching in one frame and for leaving in another. And an impulse |Δu| ≤ √g |u| moves less energy than
    the gain g that rounding excuses: the clamp that keeps passivity may cut it in one frame (of speed 2|u| at most) and
    leave it in another. The momentum itself has no such excuse.
    """
    found = _change_and_ride(case, resolver)
    if found is None:
        return None
    tolerance = bounds.comparison(case)
    of_the_ride = max(tolerance, bounds.restitution, 2.0 * float(np.sqrt(bounds.energy_gain(case))))
    return LawResidual("momentum", max(found[0] / tolerance, found[1] / of_the_ride), 1.0)


def _change_and_ride(case: ImpactCase, resolver: Resolver) -> tuple[float, float] | None:
    """Largest change of momentum, and largest distance of f(v + z) from f(v) + z."""
    if case.translations is None or case.speed == 0.0 or not case.is_separated:
        return None
    v_plus, changed, apart = own_outcome(resolver, case), 0.0, 0.0
    for z in case.translations:
        size = float(np.linalg.norm(case.lower.T @ z))
        change = abs(float(z @ case.mass_matrix @ (v_plus - case.velocity))) / (size * case.speed)
        ride = z * (case.speed / size)
        moved = outcome(resolver, replace(case, velocity=case.velocity + ride))
        changed, apart = max(changed, change), max(apart, case.distance(moved, v_plus + ride))
    return changed, apart

"""C09: e = −1 is no impulse at all."""

from __future__ import annotations

from dataclasses import replace

from verification.properties.bounds import EPS, Bounds
from verification.properties.case import ImpactCase, LawResidual, Resolver, outcome


def minus_one_is_no_impulse(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual:
    """Distance of v⁺ from v⁻; returning from whitened coordinates may round by ε √κ(M)."""
    v_plus = outcome(resolver, replace(case, restitution=-1.0))
    tolerance = 100.0 * case.coordinates * EPS * float(case.condition**0.5)
    return LawResidual("no_impulse", case.distance(v_plus, case.velocity), tolerance)

"""C04: an elastic impact (e = 1) conserves kinetic energy."""

from __future__ import annotations

from dataclasses import replace

from verification.properties.bounds import Bounds
from verification.properties.case import ImpactCase, LawResidual, Resolver, outcome
from verification.properties.laws.kinetic_energy import relative_gain


def elastic_conserves(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual:
    """|KE⁺ − KE⁻| / KE⁻ of the case with e = 1."""
    elastic = replace(case, restitution=1.0)
    # A loss may also be the clamp's, which gives back Cholesky's error: d ε κ(M), whatever the gain's bound.
    tolerance = max(bounds.energy_gain(case), bounds.comparison(case))
    return LawResidual("elastic", abs(relative_gain(elastic, outcome(resolver, elastic))), tolerance)

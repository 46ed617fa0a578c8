"""A resolver reads its arguments and writes its result elsewhere: the caller goes on using M, J and v⁻."""

from __future__ import annotations

from verification.properties.bounds import Bounds
from verification.properties.case import ImpactCase, LawResidual, Resolver, own_answer


def arguments_are_left_alone(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual:
    """Number of arguments that the call has changed; none is allowed."""
    return LawResidual("arguments", float(own_answer(resolver, case).changed), 0.0)

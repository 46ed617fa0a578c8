"""A resolver reads its arguments and writes its result elsewhere: the caller goes on using M, J and v⁻."""

from __future__ import annotations

import numpy as np

from verification.properties.bounds import Bounds
from verification.properties.case import ImpactCase, LawResidual, Resolver, ResolverFault


def arguments_are_left_alone(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual:
    """Number of arguments that the call has changed; none is allowed."""
    own = (case.mass_matrix, case.contact_jacobian, case.velocity, case.given_restitution())
    given = tuple(np.copy(argument) if isinstance(argument, np.ndarray) else argument for argument in own)
    try:
        resolver(*given)
    except Exception as error:  # anybody's resolver: whatever it raises is the finding
        raise ResolverFault(f"raised {type(error).__name__}: {error}") from error
    changed = sum(not np.array_equal(one, other) for one, other in zip(own, given, strict=True))
    return LawResidual("arguments", float(changed), 0.0)

"""A resolver is a function: the same impact gives the same bits, whatever was resolved in between."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from verification.properties.bounds import Bounds
from verification.properties.case import ImpactCase, LawResidual, Resolver, outcome, own_outcome


def same_input_same_output(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual:
    """0 where the bits agree, else 1, against a tolerance of 0."""
    first = own_outcome(resolver, case)
    outcome(resolver, replace(case, contact_jacobian=case.contact_jacobian[::-1] + 0.5, velocity=-case.velocity))
    again = outcome(resolver, case)
    return LawResidual("repeatability", 0.0 if np.array_equal(first, again) else 1.0, 0.0)

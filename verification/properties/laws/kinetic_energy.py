"""Theorems 1 and 2: kinetic energy never rises, for every e in [−1, 1]."""

from __future__ import annotations

import numpy as np

from reference.energy_gain import bulk_energy_gain
from verification.properties.bounds import Bounds
from verification.properties.case import Floats, ImpactCase, LawResidual, Resolver, own_outcome


def relative_gain(case: ImpactCase, v_plus: Floats) -> float:
    """Return (KE⁺ − KE⁻)/KE⁻ of the given numbers in double-double; infinite where motion appears from rest."""
    if not case.velocity.any():
        return np.inf if v_plus.any() else 0.0
    gain, bound = bulk_energy_gain(case.mass_matrix, case.velocity, v_plus)
    return float(gain[0]) if np.isfinite(bound[0]) else np.inf


def kinetic_energy_never_rises(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual:
    """Relative gain against what rounding excuses."""
    return LawResidual("kinetic_energy", relative_gain(case, own_outcome(resolver, case)), bounds.energy_gain(case))

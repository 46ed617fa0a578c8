"""(15): J v⁺ = −e J v⁻ on every row, dependent rows included."""

from __future__ import annotations

import numpy as np

from verification.properties.bounds import Bounds
from verification.properties.case import Floats, ImpactCase, LawResidual, Resolver, own_outcome


def restitution_residual(case: ImpactCase, v_plus: Floats) -> float:
    """Return max |Jᵢv⁺ + e Jᵢv⁻| / (‖Aᵢ‖ |u|); zero rows cannot fail, and rest must stay rest."""
    unmet = np.abs(case.contact_jacobian @ v_plus + case.restitution * (case.contact_jacobian @ case.velocity))
    scale = np.linalg.norm(case.rows, axis=1) * case.speed
    relative = np.divide(unmet, scale, out=np.where(unmet > 0.0, np.inf, 0.0), where=scale > 0.0)
    return float(np.max(relative, initial=0.0))


def restitution_is_met(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual:
    """Largest relative residual of Newton's law."""
    return LawResidual("restitution", restitution_residual(case, own_outcome(resolver, case)), bounds.restitution)

"""DAQP: dual active set on the velocity form  min ½|x|²  subject to  A x + b >= 0.

x = Aᵀp is the change of velocity in kinetic coordinates and p the multipliers. The Hessian is the identity
whatever the rank of W, so redundant contacts do no harm.
Source: Arnström, Bemporad, Axehill, IEEE Transactions on Automatic Control 67 (2022).
"""

from __future__ import annotations

import numpy as np

from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solvers.answer import Answer

_LOWER_BOUND = 0  # daqp's `sense` of an ordinary inequality
_ACCURACY = 1e-13  # of unit rows and unit velocities: a few hundred roundings
_INFINITE = 1e30  # daqp's own mark of an absent bound


def solve(problem: ImpactProblem) -> Answer:
    """Return the impulse as the multipliers of the velocity form."""
    import daqp

    rows = np.ascontiguousarray(problem.factor)
    n, d = rows.shape
    length = np.linalg.norm(rows, axis=1)
    unit = np.where(length > 0.0, length, 1.0)  # unit rows: daqp's tolerances are absolute
    scale = float(np.abs(problem.offset / unit).max(initial=0.0)) or 1.0
    upper, lower = np.full(n, _INFINITE), -problem.offset / unit / scale
    sense = np.full(n, _LOWER_BOUND, dtype=np.int32)
    unit_rows = np.ascontiguousarray(rows / unit[:, None])
    _, _, flag, detail = daqp.solve(
        np.eye(d), np.zeros(d), unit_rows, upper, lower, sense, primal_tol=_ACCURACY, dual_tol=_ACCURACY
    )
    if flag < 1:
        return Answer(None, f"daqp exit flag {flag}")
    return Answer(-np.asarray(detail["lam"]) * scale / unit, f"daqp exit flag {flag}")

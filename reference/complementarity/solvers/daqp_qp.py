"""DAQP: dual active set on the velocity form  min ½|x|²  subject to  A x + b >= 0.

Here x = Aᵀp is the change of velocity in kinetic coordinates, and p are the multipliers. The Hessian is the identity
for any rank of W, so redundant contacts are no problem.
Source: Arnström, Bemporad, Axehill, IEEE Transactions on Automatic Control 67 (2022).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iapb.errors import SolverError
from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Answer

Floats = NDArray[np.float64]

_INEQUALITY, _EQUALITY = 0, 5  # daqp's `sense` of a row
_ACCURACY = 1e-13  # for unit rows and unit velocities: a few hundred roundings
_INFINITE = 1e30  # daqp's value for an absent bound


def solve(problem: ImpactProblem) -> Answer:
    """Return the impulse as the multipliers of the velocity form."""
    try:
        return Answer(multipliers(problem.factor, problem.offset, problem.two_sided), "daqp: optimal")
    except SolverError as error:
        if str(error).startswith("refused"):
            raise
        return Answer(None, str(error))


def multipliers(rows: Floats, offset: Floats, bilateral: NDArray[np.bool_] | None = None) -> Floats:
    """Return p (n,) of  0 <= p ⟂ A Aᵀ p + b >= 0  for A (n, d) and b (n,); `bilateral` rows are equalities.

    Raises
    ------
    SolverError
        daqp ends without a solution (exit flag below 1; -1 means infeasible).
    """
    import daqp

    n, d = rows.shape
    length = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    unit = np.where(length > 0.0, length, 1.0)  # unit rows, unit velocities: daqp's tolerances are absolute
    scale = float(np.abs(offset / unit).max(initial=0.0)) or 1.0
    upper, lower = np.full(n, _INFINITE), -offset / unit / scale
    sense = np.full(n, _INEQUALITY, dtype=np.int32)
    if bilateral is not None:
        upper[bilateral], sense[bilateral] = lower[bilateral], _EQUALITY
    unit_rows = np.ascontiguousarray(rows / unit[:, None])
    _, _, flag, detail = daqp.solve(
        np.eye(d), np.zeros(d), unit_rows, upper, lower, sense, primal_tol=_ACCURACY, dual_tol=_ACCURACY
    )
    if flag < 1:
        raise SolverError(f"daqp: exit flag {flag}" + (", infeasible" if flag == -1 else ""))
    return -np.asarray(detail["lam"]) * scale / unit

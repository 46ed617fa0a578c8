"""cvxpy: the impulse form  min ½|Aᵀp|² + bᵀp  subject to  p >= 0,  by Clarabel, OSQP or SCS.

The objective uses the factor A, not a quadratic form of W, because redundant contacts make W rank deficient. If all
contacts have the same e, then b = (1 + e) A u and the objective is ½|Aᵀp + (1 + e) u|² up to a constant.
Source: Moreau's least-squares form of plastic impacts; Anitescu and Potra, Nonlinear Dynamics 14 (1997).
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Answer, velocity_scale

# Requested accuracy for a problem scaled to unit W and b; the defaults are 1e-4 to 1e-6. Below 1e-11, Clarabel drifts
# along the unbounded set of impulses of opposed contacts (p to 6e9, residual up to 4e-6).
_OPTIONS: dict[str, dict[str, Any]] = {
    "CLARABEL": {"tol_gap_abs": 1e-11, "tol_gap_rel": 1e-11, "tol_feas": 1e-11},
    "OSQP": {"eps_abs": 1e-9, "eps_rel": 1e-9, "max_iter": 20_000, "polishing": True, "time_limit": 10.0},
    "SCS": {"eps_abs": 1e-9, "eps_rel": 1e-9, "max_iters": 20_000},
}


def solve(problem: ImpactProblem, backend: str) -> Answer:
    """Return the impulse of the convex program solved by `backend`."""
    import cvxpy as cp

    rows = problem.factor
    root, speed = float(np.linalg.norm(rows, axis=1).max(initial=0.0)) or 1.0, velocity_scale(problem)
    p, one_sided = cp.Variable(problem.size), np.flatnonzero(~problem.two_sided)
    energy = 0.5 * cp.sum_squares((rows.T / root) @ p) + (problem.offset / speed) @ p
    program = cp.Problem(cp.Minimize(energy), [p[one_sided] >= 0.0] if len(one_sided) else [])
    try:
        with warnings.catch_warnings():  # "may be inaccurate": the status says so too, and residuals are recomputed
            warnings.simplefilter("ignore", UserWarning)
            program.solve(solver=backend, **_OPTIONS[backend])
    except cp.error.SolverError as error:
        return Answer(None, f"{backend}: {error}")
    if p.value is None:
        return Answer(None, f"{backend}: {program.status}")
    return Answer(np.asarray(p.value) * speed / root**2, f"{backend}: {program.status}")

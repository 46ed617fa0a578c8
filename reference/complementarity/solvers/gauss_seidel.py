"""Projected Gauss-Seidel: sweep p_i <- max(0, p_i - w_i / W_ii) until a sweep changes nothing.

Converges for symmetric positive semidefinite W with positive diagonal when a solution exists; slowly for
stacks and nearly dependent contacts.
Source: Cottle, Pang, Stone (1992), section 5.3 (projected SOR with factor 1).
"""

from __future__ import annotations

import numba
import numpy as np

from iapb.errors import SolverError
from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import velocity_scale
from reference.complementarity.solvers.answer import Answer

_SWEEPS = 20_000
_WORK = 1e9  # multiplications, about two seconds: fewer sweeps for larger problems, never fewer than _LEAST_SWEEPS
_LEAST_SWEEPS = 500
_STILL = 1e-14  # a sweep that moves no contact velocity by more than this share of the scale is the last one


@numba.njit(cache=True, fastmath=False)
def _sweep_until_still(w, b, bilateral, p, sweeps, still):  # type: ignore[no-untyped-def]
    """Sweep in place; return the number of sweeps done, or -1 where the limit came first."""
    n = len(b)
    for sweep in range(sweeps):
        largest = 0.0
        for i in range(n):
            if w[i, i] <= 0.0:
                continue
            velocity = b[i]
            for j in range(n):
                velocity += w[i, j] * p[j]
            moved = -velocity / w[i, i]
            if not bilateral[i]:
                moved = max(-p[i], moved)
            p[i] += moved
            largest = max(largest, abs(moved) * w[i, i])
        if largest <= still:
            return sweep + 1
    return -1


def solve(problem: ImpactProblem) -> Answer:
    """Return the impulse after the last sweep, converged or not: the residuals tell."""
    if (np.diag(problem.delassus) < 0.0).any():
        raise SolverError("refused: W has a negative diagonal entry")
    p = np.zeros(problem.size)
    still = _STILL * velocity_scale(problem)
    sweeps = max(_LEAST_SWEEPS, min(_SWEEPS, int(_WORK / problem.size**2)))
    done = _sweep_until_still(
        np.ascontiguousarray(problem.delassus), problem.offset, problem.two_sided, p, sweeps, still
    )
    return Answer(p, f"still after {done} sweeps" if done >= 0 else f"not still after {sweeps} sweeps")

"""Projected Gauss-Seidel: sweep p_i <- max(0, p_i - w_i / W_ii) until a sweep changes nothing.

It converges for symmetric positive semidefinite W with positive diagonal if a solution exists, but slowly for stacks
and nearly dependent contacts.
Source: Cottle, Pang, Stone (1992), section 5.3 (projected SOR with factor 1).
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from iapb.errors import SolverError
from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Answer, velocity_scale

Floats = NDArray[np.float64]

_SWEEPS = 20_000
_WORK = 1e9  # multiplications, about 2 s: larger problems get fewer sweeps, but at least _LEAST_SWEEPS
_LEAST_SWEEPS = 500
_STILL = 1e-14  # stop after a sweep that changes no contact velocity by more than this share of the scale


@numba.njit(cache=True, fastmath=False)
def _sweep_until_still(w, b, bilateral, p, sweeps, still):  # type: ignore[no-untyped-def]
    """Sweep in place; return the number of sweeps done, or -1 if the limit is reached."""
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
    """Return the impulse after the last sweep; its residuals show whether it converged."""
    if (np.diag(problem.delassus) < 0.0).any():
        raise SolverError("refused: W has a negative diagonal entry")
    p, done = _projected(problem.delassus, problem.offset, problem.two_sided, velocity_scale(problem))
    return Answer(p, f"converged after {done} sweeps" if done >= 0 else "not converged after the last sweep")


def multipliers(rows: Floats, offset: Floats) -> Floats:
    """Return p (n,) of  0 <= p ⟂ A Aᵀ p + b >= 0  for A (n, d) and b (n,), after the last sweep."""
    scale = float(np.abs(offset).max(initial=0.0)) or 1.0
    return _projected(rows @ rows.T, offset, np.zeros(len(offset), np.bool_), scale)[0]


def _projected(w: Floats, b: Floats, bilateral: NDArray[np.bool_], scale: float) -> tuple[Floats, int]:
    """Return p (n,) after the last sweep, and the number of sweeps, or -1 if the limit is reached."""
    p = np.zeros(len(b))
    sweeps = max(_LEAST_SWEEPS, min(_SWEEPS, int(_WORK / max(1, len(b)) ** 2)))
    return p, _sweep_until_still(np.ascontiguousarray(w), b, bilateral, p, sweeps, _STILL * scale)

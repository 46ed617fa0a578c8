"""cvxpy with Clarabel: friction as a second-order cone program, Coulomb's law by a fixed point on it.

The relaxed law is  min ½|Aᵀp|² + bᵀp  over Coulomb's cones. Coulomb's own law is that program with mu |u_T|
added to the normal part of b, which depends on the solution: repeat until it stops changing (it need not).
Source: Anitescu and Tasora, Comput. Optim. Appl. 47 (2010); Acary, Cadoux, Lemaréchal, Malick, ZAMM 91 (2011).
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Answer, velocity_scale

Floats = NDArray[np.float64]

_ACCURACY = 1e-12  # asked of the interior point at unit W and b; the natural map gets its root near the apex
_ROUNDS = 50  # of the fixed point
_STILL = 1e-9  # change of the shift, relative to the velocity scale, at which the fixed point has arrived


def solve(problem: ImpactProblem) -> Answer:
    """Return the impulse of the relaxed problem, or of Coulomb's law where `problem.relaxed` is False."""
    rows, speed = problem.factor, velocity_scale(problem)
    program, p, offset = _program(problem, rows)
    root = float(np.linalg.norm(rows, axis=1).max(initial=0.0)) or 1.0
    shift = np.zeros(problem.contacts)
    for done in range(1, _ROUNDS + 1):
        scaled = problem.offset / speed
        scaled[:: problem.contact_size] += shift
        offset.value = scaled
        with warnings.catch_warnings():  # "may be inaccurate": the status says so too, and residuals judge
            warnings.simplefilter("ignore", UserWarning)
            program.solve(solver="CLARABEL", tol_gap_abs=_ACCURACY, tol_gap_rel=_ACCURACY, tol_feas=_ACCURACY)
        if p.value is None:
            return Answer(None, f"CLARABEL: {program.status} in round {done}")
        impulse = np.asarray(p.value) * speed / root**2
        if problem.relaxed:
            return Answer(impulse, f"CLARABEL: {program.status}")
        before, shift = shift, _shift(problem, impulse) / speed
        if np.abs(shift - before).max(initial=0.0) <= _STILL:
            return Answer(impulse, f"fixed point after {done} programs")
    return Answer(impulse, f"fixed point not reached in {_ROUNDS} programs")


def _program(problem: ImpactProblem, rows: Floats) -> tuple[Any, Any, Any]:
    """The scaled program with its variable and its offset, which is a parameter so that rounds are cheap."""
    import cvxpy as cp

    size, mu = problem.contact_size, problem.friction_or_zero
    root = float(np.linalg.norm(rows, axis=1).max(initial=0.0)) or 1.0
    p, offset = cp.Variable(problem.size), cp.Parameter(problem.size)
    cones = [
        cp.SOC(mu[k] * p[k * size], p[k * size + 1 : (k + 1) * size]) if mu[k] > 0.0 else p[k * size] >= 0.0
        for k in range(problem.contacts)
    ]
    still = [p[k * size + 1 : (k + 1) * size] == 0.0 for k in np.flatnonzero(mu == 0.0)]
    objective = cp.Minimize(0.5 * cp.sum_squares((rows.T / root) @ p) + offset @ p)
    return cp.Problem(objective, cones + still), p, offset


def _shift(problem: ImpactProblem, impulse: Floats) -> Floats:
    """mu |u_T| per contact (k,) [m/s]."""
    u = problem.contact_velocity(impulse).reshape(-1, problem.contact_size)
    return problem.friction_or_zero * np.linalg.norm(u[:, 1:], axis=1)

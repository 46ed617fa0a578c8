"""cvxpy with Clarabel: relaxed friction as a second-order cone program, Coulomb's law by fixed-point iteration.

The relaxed law is  min ½|Aᵀp|² + bᵀp  over Coulomb's cones. Coulomb's law is that program with mu |u_T| added to the
normal part of b. This shift depends on the solution, so the program is solved repeatedly until the shift is constant
(convergence is not guaranteed). The impulses of joints are free.
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

_ACCURACY = 1e-12  # requested at unit W and b; near the apex the natural map reaches its square root
_ROUNDS = 50  # most fixed-point iterations
_STILL = 1e-9  # change of the shift, relative to the velocity scale, at which the iteration stops


def solve(problem: ImpactProblem) -> Answer:
    """Return the impulse of the relaxed problem, or of Coulomb's law if `problem.relaxed` is False."""
    rows, speed = problem.factor, velocity_scale(problem)
    program, p, offset = _program(problem, rows)
    root = float(np.linalg.norm(rows, axis=1).max(initial=0.0)) or 1.0
    shift = np.zeros(problem.contacts)
    for done in range(1, _ROUNDS + 1):
        scaled = problem.offset / speed
        scaled[:: problem.contact_size] += shift
        offset.value = scaled
        with warnings.catch_warnings():  # "may be inaccurate": the status says so too, and residuals are recomputed
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
    """Return the scaled program, its variable, and its offset, a parameter so that repeated solves are cheap."""
    import cvxpy as cp

    root = float(np.linalg.norm(rows, axis=1).max(initial=0.0)) or 1.0
    p, offset = cp.Variable(problem.size), cp.Parameter(problem.size)
    blocks = cp.reshape(p, (problem.contact_size, problem.contacts), order="F")
    contacts = ~problem.two_sided
    rough = np.flatnonzero(contacts & (problem.friction_or_zero > 0.0))
    smooth = np.flatnonzero(contacts & (problem.friction_or_zero == 0.0))
    cones: list[Any] = []
    if len(rough):
        cones.append(cp.SOC(cp.multiply(problem.friction_or_zero[rough], blocks[0, rough]), blocks[1:, rough]))
    if len(smooth):
        cones += [blocks[0, smooth] >= 0.0, blocks[1:, smooth] == 0.0]
    objective = cp.Minimize(0.5 * cp.sum_squares((rows.T / root) @ p) + offset @ p)
    return cp.Problem(objective, cones), p, offset


def _shift(problem: ImpactProblem, impulse: Floats) -> Floats:
    """Return mu |u_T| per contact (k,) [m/s]."""
    u = problem.contact_velocity(impulse).reshape(-1, problem.contact_size)
    return np.where(problem.two_sided, 0.0, problem.friction_or_zero * np.linalg.norm(u[:, 1:], axis=1))

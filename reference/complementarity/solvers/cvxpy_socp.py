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

from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Answer, velocity_scale

_ACCURACY = 1e-12  # requested at unit W and b; near the apex the natural map reaches its square root
_ROUNDS = 50  # most fixed-point iterations
_STILL = 1e-9  # change of the shift, relative to the velocity scale, at which the iteration stops


def solve(problem: ImpactProblem) -> Answer:
    """Return the impulse of the relaxed problem, or of Coulomb's law if `problem.relaxed` is False."""
    import cvxpy as cp

    rows, speed, mu = problem.factor, velocity_scale(problem), problem.friction_or_zero
    root = float(np.linalg.norm(rows, axis=1).max(initial=0.0)) or 1.0
    p, offset = cp.Variable(problem.size), cp.Parameter(problem.size)  # a parameter makes repeated solves cheap
    blocks = cp.reshape(p, (problem.contact_size, problem.contacts), order="F")
    rough, smooth = (np.flatnonzero(~problem.two_sided & kind) for kind in (mu > 0.0, mu == 0.0))
    cones: list[Any] = []
    if len(rough):
        cones.append(cp.SOC(cp.multiply(mu[rough], blocks[0, rough]), blocks[1:, rough]))
    if len(smooth):
        cones += [blocks[0, smooth] >= 0.0, blocks[1:, smooth] == 0.0]
    program = cp.Problem(cp.Minimize(0.5 * cp.sum_squares((rows.T / root) @ p) + offset @ p), cones)
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
        u = problem.contact_velocity(impulse).reshape(-1, problem.contact_size)
        slipping = np.where(problem.two_sided, 0.0, mu * np.linalg.norm(u[:, 1:], axis=1))
        before, shift = shift, slipping / speed
        if np.abs(shift - before).max(initial=0.0) <= _STILL:
            return Answer(impulse, f"fixed point after {done} programs")
    return Answer(impulse, f"fixed point not reached in {_ROUNDS} programs")

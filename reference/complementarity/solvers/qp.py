"""Convex quadratic programs of frictionless contacts, W = A Aᵀ, in one of two forms.

Velocity form: min ½|x|² subject to A x + b >= 0. Here x = Aᵀp is the change of velocity in kinetic
coordinates, and p are the multipliers. The Hessian is the identity for any rank of W, so redundant
contacts are no problem. Impulse form: min ½|Aᵀp|² + bᵀp subject to p >= 0 (cvxpy's backends:
`cones`). If all contacts have the same e, then b = (1 + e) A u, and the objective is ½|Aᵀp + (1 +
e) u|² up to a constant (Moreau; Anitescu and Potra, Nonlinear Dynamics 14, 1997).
Source: daqp, Arnström, Bemporad, Axehill, IEEE Transactions on Automatic Control 67 (2022);
quadprog, Goldfarb, Idnani, Mathematical Programming 27 (1983); proxqp, Bambade and others,
Robotics: Science and Systems (2022).
"""

from __future__ import annotations

import numpy as np

from iapb.errors import SolverError
from reference import Floats
from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Answer, velocity_scale

_INEQUALITY = 0  # daqp's `sense` of a row
# Accuracies for unit rows and unit velocities, until one has an answer: a few hundred roundings; and
# coarser ones where rounding makes opposed, nearly parallel rows contradict each other.
_ACCURACIES = (1e-13, 1e-11, 1e-9)
_INFINITE = 1e30  # daqp's value for an absent bound
# accuracy requested for a problem scaled to unit W and b; the reached accuracy is measured
_PROXQP = 1e-10


def solve(problem: ImpactProblem, method: str) -> Answer:
    """Return the impulse by "daqp" or "quadprog" (velocity form) or "proxqp" (impulse form)."""
    if method == "proxqp":
        return _by_proxqp(problem)
    if method == "daqp":
        return Answer(daqp(problem.factor, problem.offset), "daqp: optimal")
    return Answer(quadprog(problem.factor, problem.offset), "quadprog: optimal")


def daqp(rows: Floats, offset: Floats) -> Floats:
    """Return p (n,) of  0 <= p ⟂ A Aᵀ p + b >= 0  for A (n, d) and b (n,).

    daqp is called itself, because qpsolvers does not tell an infeasible program from another
    failure.

    Raises
    ------
    SolverError
        daqp ends without a solution (exit flag below 1; -1 means infeasible).
    """
    import daqp

    n, d = rows.shape
    length = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    # unit rows, unit velocities: daqp's tolerances are absolute
    unit = np.where(length > 0.0, length, 1.0)
    lower = -offset / unit
    scale = float(np.abs(lower).max(initial=0.0)) or 1.0
    lower /= scale
    upper = np.full(n, _INFINITE)
    sense = np.full(n, _INEQUALITY, dtype=np.int32)
    for accuracy in _ACCURACIES:
        _, _, flag, detail = daqp.solve(
            np.eye(d),
            np.zeros(d),
            np.ascontiguousarray(rows / unit[:, None]),
            upper,
            lower,
            sense,
            primal_tol=accuracy,
            dual_tol=accuracy,
        )
        if flag >= 1:
            break
    if flag < 1:
        raise SolverError(f"daqp: exit flag {flag}" + (", infeasible" if flag == -1 else ""))
    return -np.asarray(detail["lam"]) * scale / unit


def quadprog(rows: Floats, offset: Floats) -> Floats:
    """Return p (n,) as `daqp` does; quadprog can mistake redundant rows for contradictory ones
    (SolverError)."""
    from qpsolvers import Problem, solve_problem

    d = rows.shape[1]
    length = np.linalg.norm(rows, axis=1)
    unit = np.where(length > 0.0, length, 1.0)
    answer = solve_problem(
        Problem(np.eye(d), np.zeros(d), -rows / unit[:, None], offset / unit), solver="quadprog"
    )
    if not answer.found or answer.z is None:
        raise SolverError("quadprog: no solution found")
    return np.asarray(answer.z) / unit


def _by_proxqp(problem: ImpactProblem) -> Answer:
    from qpsolvers import Problem, solve_problem

    w = problem.factor @ problem.factor.T
    inertia = float(np.abs(w).max(initial=0.0)) or 1.0
    speed = velocity_scale(problem)
    program = Problem(w / inertia, problem.offset / speed, lb=np.zeros(problem.size))
    answer = solve_problem(program, solver="proxqp", eps_abs=_PROXQP, eps_rel=0.0)
    if answer.x is None:
        return Answer(None, "proxqp found no solution")
    return Answer(np.asarray(answer.x) * speed / inertia, f"proxqp found: {answer.found}")

"""ProxQP through qpsolvers, on the impulse form  min ½ pᵀWp + bᵀp  subject to  p >= 0.

Source: Bambade, El-Kazdadi, Taylor, Carpentier, Robotics: Science and Systems (2022).
"""

from __future__ import annotations

import numpy as np

from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Answer, velocity_scale

_ACCURACY = 1e-10  # requested for a problem scaled to unit W and b; the reached accuracy is measured


def solve(problem: ImpactProblem) -> Answer:
    """Return the impulse from the convex quadratic program, scaled to unit size."""
    from qpsolvers import Problem, solve_problem

    w = problem.factor @ problem.factor.T
    inertia, speed = float(np.abs(w).max(initial=0.0)) or 1.0, velocity_scale(problem)
    program = Problem(w / inertia, problem.offset / speed, lb=np.where(problem.two_sided, -np.inf, 0.0))
    answer = solve_problem(program, solver="proxqp", eps_abs=_ACCURACY, eps_rel=0.0)
    if answer.x is None:
        return Answer(None, "proxqp found no solution")
    return Answer(np.asarray(answer.x) * speed / inertia, f"proxqp found: {answer.found}")

"""quadprog through qpsolvers: Goldfarb and Idnani's dual active set on the velocity form.

min ½|x|² subject to A x + b >= 0; the multipliers are the impulses.
Source: Goldfarb, Idnani, Mathematical Programming 27 (1983).
"""

from __future__ import annotations

import numpy as np

from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solvers.answer import Answer


def solve(problem: ImpactProblem) -> Answer:
    """Return the impulse as the multipliers of the velocity form."""
    from qpsolvers import Problem, solve_problem

    rows = problem.factor
    d = rows.shape[1]
    length = np.linalg.norm(rows, axis=1)
    unit = np.where(length > 0.0, length, 1.0)
    program = Problem(np.eye(d), np.zeros(d), -rows / unit[:, None], problem.offset / unit)
    answer = solve_problem(program, solver="quadprog")
    if not answer.found or answer.z is None:
        return Answer(None, "quadprog found no solution")  # it can take redundant rows for contradicting ones
    return Answer(np.asarray(answer.z) / unit, "quadprog found a solution")

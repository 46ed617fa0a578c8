"""quadprog through qpsolvers: Goldfarb and Idnani's dual active set on the velocity form.

The program is min ½|x|² subject to A x + b >= 0; its multipliers are the impulses.
Source: Goldfarb, Idnani, Mathematical Programming 27 (1983).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iapb.errors import SolverError
from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Answer

Floats = NDArray[np.float64]


def solve(problem: ImpactProblem) -> Answer:
    """Return the impulse as the multipliers of the velocity form."""
    try:
        return Answer(multipliers(problem.factor, problem.offset), "quadprog: optimal")
    except SolverError as error:
        if str(error).startswith("refused"):
            raise
        return Answer(None, str(error))


def multipliers(rows: Floats, offset: Floats) -> Floats:
    """Return p (n,) of  0 <= p ⟂ A Aᵀ p + b >= 0  for A (n, d) and b (n,).

    Raises
    ------
    SolverError
        quadprog finds no solution; it can mistake redundant rows for contradictory ones.
    """
    from qpsolvers import Problem, solve_problem

    d = rows.shape[1]
    length = np.linalg.norm(rows, axis=1)
    unit = np.where(length > 0.0, length, 1.0)
    program = Problem(np.eye(d), np.zeros(d), -rows / unit[:, None], offset / unit)
    answer = solve_problem(program, solver="quadprog")
    if not answer.found or answer.z is None:
        raise SolverError("quadprog: no solution found")
    return np.asarray(answer.z) / unit

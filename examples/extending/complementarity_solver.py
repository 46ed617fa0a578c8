"""A complementarity solver: non-negative least squares (Lawson and Hanson 1974).

In the project it is a file of reference/complementarity/solvers, and one line of `SOLVERS` there.

Prints:
    solved [0.1, 0.15, 0.0] True
"""

import numpy as np
from scipy.optimize import nnls

from iapb.errors import SolverError
from reference.complementarity import ImpactProblem
from reference.complementarity import solve as solve_by_name
from reference.complementarity.solution import Answer
from reference.complementarity.solvers import SOLVERS, SolverEntry

CONSISTENT = 1e-9  # share of b that may lie outside the range of A


def solve(problem: ImpactProblem) -> Answer:
    """Return the p >= 0 that minimizes |Aᵀp + y|, with A y = b."""
    A, b = problem.factor, problem.offset
    y = np.linalg.lstsq(A, b, rcond=None)[0]
    if np.abs(A @ y - b).max() > CONSISTENT * np.abs(b).max():
        raise SolverError("refused: b is not in the range of A")
    impulse, rest = nnls(A.T, -y)
    return Answer(impulse, f"norm of the rest {rest:.1e}")


SOLVERS["nnls"] = SolverEntry(__name__, "scipy", "non-negative least squares", "convex")

M, v = np.diag([2.0, 2.0, 0.005]), np.array([0.1, -0.3, 0.0])
J = np.array([[0, 1, -0.01], [0, 1, 0.0], [0, 1, 0.01]])
solution = solve_by_name(ImpactProblem.from_impact(M, J, v, restitution=0.5), "nnls")
velocity = (solution.velocity_plus.round(9) + 0.0).tolist()  # no sign of zero
print(solution.verdict(), velocity, solution.residuals.worst < 1e-12)

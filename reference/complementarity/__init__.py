"""Impacts as complementarity problems: problems, solutions with recomputed residuals, solvers and
laws."""

from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Residuals, Solution
from reference.complementarity.solvers import SOLVERS, solve, solver_names

__all__ = ["SOLVERS", "ImpactProblem", "Residuals", "Solution", "solve", "solver_names"]

"""Benchmark of solvers: one row per solver and problem, judged by recomputed residuals."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iapb.errors import MissingDependencyError
from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Solution, velocity_scale
from reference.complementarity.solvers import solve, solver_names


class SolverRow(NamedTuple):
    """One solver on one problem.

    verdict : "solved", "refused", "failed", "missing" (the solver is not installed) or "left out"
        (it needed too long for an earlier problem)
    spread : largest difference of contact velocities from the best solution, relative to the
        velocity scale; NaN if this solver did not solve the problem. Impulses are not compared,
        because they are not unique
    """

    problem: str
    solver: str
    verdict: str
    spread: float = np.nan


def run_solvers(problem: ImpactProblem, longest: float, slow: set[str]) -> list[SolverRow]:
    """Solve a problem with every solver of its kind.

    A solver that needs more than `longest` [s] is added to `slow`. The solvers in `slow` are left
    out, so give the smallest problems first.
    """
    found = list[Solution]()
    without = list[SolverRow]()
    for name in solver_names(problem):
        if name in slow:
            without.append(SolverRow(problem.name, name, "left out"))
            continue
        try:
            found.append(solve(problem, name))
        except MissingDependencyError:
            without.append(SolverRow(problem.name, name, "missing"))
    best = min(found, key=lambda solution: solution.residuals.worst, default=None)
    rows = list[SolverRow]()
    for solution in found:
        spread = np.nan
        if best and solution.solved():
            apart = np.abs(solution.gamma_plus - best.gamma_plus).max(initial=0.0)
            spread = float(apart / velocity_scale(problem))
        rows.append(SolverRow(problem.name, solution.solver, solution.verdict(), spread))
    slow.update(solution.solver for solution in found if solution.seconds > longest)
    return rows + without

"""Benchmark of solvers: one row per solver and problem with recomputed residuals."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

import numpy as np

from iapb.errors import MissingDependencyError
from reference.complementarity.problem import SYMMETRY_TOLERANCE, ImpactProblem
from reference.complementarity.solution import Residuals, Solution, velocity_scale
from reference.complementarity.solvers import solve, solver_names


@dataclass(frozen=True)
class SolverRow:
    """One solver on one problem.

    verdict : "solved", "refused", "failed", "missing" (the solver is not installed) or "left out"
        (it needed more than `longest` for an earlier problem)
    spread : largest difference of contact velocities from the best solution, relative to the
        velocity scale; NaN if this solver did not solve the problem. Impulses are not compared,
        because they are not unique
    asymmetry : relative asymmetry of the problem's W if it is beyond rounding, else 0
    """

    problem: str
    size: int
    solver: str
    asymmetry: float
    verdict: str
    note: str
    residuals: Residuals = Residuals()
    seconds: float = np.nan
    spread: float = np.nan


def run_solvers(
    problem: ImpactProblem,
    solvers: Iterable[str] | None = None,
    longest: float = np.inf,
    slow: dict[str, float] | None = None,
    progress: Callable[[], object] = lambda: None,
) -> list[SolverRow]:
    """Solve a problem with every solver of its kind, or with `solvers`.

    A solver that needs more than `longest` [s] is added to `slow` with its time. The solvers in
    `slow` are left out, so give the smallest problems first. `progress` is called before each
    solver starts.
    """
    asymmetry = problem.asymmetry if problem.asymmetry > SYMMETRY_TOLERANCE else 0.0
    slow = {} if slow is None else slow
    found = list[Solution]()
    missing = list[SolverRow]()
    left_out = list[SolverRow]()
    for name in solvers or solver_names(problem):
        row = partial(SolverRow, problem.name, problem.size, name, asymmetry)
        if name in slow:
            left_out.append(row("left out", f"left out: {slow[name]:.3g} s for a problem before"))
            continue
        progress()
        try:
            found.append(solve(problem, name))
        except MissingDependencyError as error:
            missing.append(row("missing", str(error)))
    best = min(found, key=lambda s: s.residuals.worst, default=None)
    rows = list[SolverRow]()
    for s in found:
        apart = (
            np.abs(s.gamma_plus - best.gamma_plus).max(initial=0.0)
            if best and s.solved()
            else np.nan
        )
        rows.append(
            SolverRow(
                problem.name,
                problem.size,
                s.solver,
                asymmetry,
                s.verdict(),
                s.note,
                s.residuals,
                s.seconds,
                float(apart / velocity_scale(problem)),
            )
        )
    slow.update({s.solver: s.seconds for s in found if s.seconds > longest})
    return rows + missing + left_out

"""The table of solvers. Each line names the module of a solver; its package is imported at the
solver's first call.

A solver module has a function ``solve(problem) -> Answer``, which may raise SolverError to refuse a
problem. To add a solver, write its module and add a line to SOLVERS.
"""

from __future__ import annotations

import fcntl
import importlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from types import ModuleType

import numpy as np

from iapb.errors import ArgumentError, MissingDependencyError, SolverError
from iapb.names import one_of
from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Answer, Solution


@dataclass(frozen=True)
class SolverEntry:
    """A solver: its module, the packages it needs, its method and the problems it accepts."""

    module: str
    package: str
    method: str
    takes: str  #: "lcp" = any frictionless problem, "convex" = only symmetric semidefinite W, "cone" = friction
    option: str = ""  #: argument of the module's solve if it serves several solvers


_HERE = "reference.complementarity.solvers"
_PINOCCHIO = f"{_HERE}.pinocchio_contact"

SOLVERS: dict[str, SolverEntry] = {
    "enumeration": SolverEntry(f"{_HERE}.enumeration", "scipy", "all active sets, small n", "lcp"),
    "lemke": SolverEntry(f"{_HERE}.lemke", "quantecon", "complementary pivoting (Lemke)", "lcp"),
    "gauss_seidel": SolverEntry(f"{_HERE}.sweeps", "numba", "projected Gauss-Seidel", "lcp"),
    "daqp": SolverEntry(f"{_HERE}.qp", "daqp", "dual active set", "convex", "daqp"),
    "quadprog": SolverEntry(
        f"{_HERE}.qp", "qpsolvers quadprog", "Goldfarb-Idnani active set", "convex", "quadprog"
    ),
    "proxqp": SolverEntry(
        f"{_HERE}.qp", "qpsolvers proxsuite", "proximal augmented Lagrangian", "convex", "proxqp"
    ),
    "cvxpy_clarabel": SolverEntry(
        f"{_HERE}.cones", "cvxpy clarabel", "interior point", "convex", "CLARABEL"
    ),
    "cvxpy_osqp": SolverEntry(f"{_HERE}.cones", "cvxpy osqp", "ADMM", "convex", "OSQP"),
    "cvxpy_scs": SolverEntry(
        f"{_HERE}.cones", "cvxpy scs", "ADMM on the conic form", "convex", "SCS"
    ),
    "nsgs": SolverEntry(f"{_HERE}.sweeps", "numba", "block Gauss-Seidel on the cones", "cone"),
    "cvxpy_socp": SolverEntry(
        f"{_HERE}.cones", "cvxpy clarabel", "interior point, fixed point", "cone", "socp"
    ),
    "pinocchio_pgs": SolverEntry(
        _PINOCCHIO, "pinocchio", "projected Gauss-Seidel", "cone", option="PGS"
    ),
    "pinocchio_admm": SolverEntry(_PINOCCHIO, "pinocchio", "ADMM", "cone", option="ADMM"),
}


def solver_names(problem: ImpactProblem | None = None) -> tuple[str, ...]:
    """Return the solvers' names; with a problem, only those that take its kind (friction or
    not)."""
    cone = problem is not None and problem.friction is not None
    return tuple(
        name
        for name, entry in SOLVERS.items()
        if problem is None or (entry.takes == "cone") == cone
    )


def solve(problem: ImpactProblem, solver: str = "daqp") -> Solution:
    """Solve `problem` by the solver of that name.

    Raises
    ------
    ArgumentError
        The name is unknown.
    MissingDependencyError
        The solver's package is not installed; the message says how to install it.

    If the solver refuses or fails, the Solution has no impulse, and its residuals are infinite.
    """
    if solver not in SOLVERS:
        raise ArgumentError("solver", solver, one_of(solver, SOLVERS))
    entry = SOLVERS[solver]
    call = _load(solver, entry)
    started = time.perf_counter()
    try:
        if (entry.takes == "cone") != (problem.friction is not None):
            kind = "problems with friction" if entry.takes == "cone" else "frictionless problems"
            raise SolverError(f"refused: takes {kind} only")
        answer = (
            call(problem, *filter(None, [entry.option]))
            if problem.offset.any()
            else Answer(np.zeros(problem.size), "b = 0: no impulse is needed")
        )
    except SolverError as error:
        answer = Answer(None, str(error), refused=str(error).startswith("refused"))
    except (
        ArithmeticError,
        LookupError,
        RuntimeError,
        ValueError,
    ) as error:  # raised inside a foreign package
        answer = Answer(None, f"{type(error).__name__}: {error}")
    seconds = time.perf_counter() - started
    impulse = None if answer.impulse is None else np.asarray(answer.impulse, dtype=np.float64)
    return Solution(problem, impulse, solver, answer.note, answer.refused, seconds)


def import_alone(name: str) -> ModuleType:
    """Import a module of another package, one process at a time.

    If two processes import quantecon for the first time at once, they corrupt its cache of compiled
    code, and every later import aborts with "LLVM ERROR: Symbol not found: __gufunc__...". The lock
    is on the package's own file.
    """
    package = name.partition(".")[0]
    found = find_spec(package)
    if found is None or found.origin is None:
        return importlib.import_module(name)
    with open(found.origin) as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        return importlib.import_module(name)


def _load(solver: str, entry: SolverEntry) -> Callable[..., Answer]:
    """Import now what the solver needs, so that this does not count as its time."""
    try:
        for package in entry.package.split():
            import_alone(package)
    except ImportError as error:
        install = "pip install " + entry.package.replace("pinocchio", "pin")
        raise MissingDependencyError(entry.package, f"solver {solver!r}", install) from error
    found: Callable[..., Answer] = importlib.import_module(entry.module).solve
    return found

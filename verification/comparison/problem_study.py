"""Every solver on every problem of a folder: solved, refused or failed by recomputed residuals, and their profile.

A file that cannot be read, an asymmetric W and a solver that is not installed are lines of the record, never left
out in silence. Solutions are compared by velocities: the impulses of hyperstatic problems are not unique.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from reference.complementarity.benchmark import SolverRow
    from reference.datasets import StoredProblem

Floats = NDArray[np.float64]

VERDICTS = ("solved", "refused", "failed", "missing")
FACTORS = np.concatenate([[1.0], np.geomspace(1.5, 1e5, 60)])  # of the fastest solver's time


@dataclass(frozen=True)
class UnreadFile:
    """A file that is not a problem, or a damaged one."""

    file: str
    reason: str


@dataclass(frozen=True)
class ProblemLine:
    """One problem: format, unknowns, whether hyperstatic, asymmetry of W (0 where symmetric), verdicts by solver.

    stored : worst recomputed residual of the multipliers that the file itself carries; NaN where it carries none
    spread : largest difference of contact velocities among the solvers that solved it, relative
    """

    problem: str
    format: str
    unknowns: int
    rank: int
    asymmetry: float
    verdicts: tuple[tuple[str, str], ...]
    spread: float
    stored: float


@dataclass(frozen=True)
class ProblemStudy:
    """The record: problems, rows (one per solver and problem), the profile, files that could not be read.

    profile : per kind of problem ("frictionless", "friction") and solver, the share of problems solved within each
        of FACTORS times the fastest solver's time (Dolan and Moré)
    """

    folder: str
    lines: tuple[ProblemLine, ...]
    rows: tuple[SolverRow, ...]
    unread: tuple[UnreadFile, ...]
    profile: tuple[tuple[str, str, Floats], ...]

    def count(self, solver: str, verdict: str) -> int:
        """Problems with that verdict by that solver."""
        return sum(row.solver == solver and row.verdict == verdict for row in self.rows)

    @property
    def solvers(self) -> tuple[str, ...]:
        """Solvers in the order of their first use."""
        return tuple(dict.fromkeys(row.solver for row in self.rows))


def study_problems(
    folder: Path | str, repeats: int = 1, progress: Callable[[str, int, int], None] | None = None
) -> ProblemStudy:
    """Read every problem file below `folder` and solve it by every solver that takes its kind.

    Raises
    ------
    ArgumentError
        If the folder does not exist.
    """
    from threadpoolctl import threadpool_limits

    from reference.complementarity.benchmark import run_solvers
    from reference.datasets import DatasetError, problem_files, read_problem

    lines, unread = list[ProblemLine](), list[UnreadFile]()
    rows: list[SolverRow] = []
    kinds: dict[str, list[SolverRow]] = {}
    files = problem_files(folder)
    for done, path in enumerate(files):
        if progress is not None:
            progress("problem files", done, len(files))
        try:
            stored = read_problem(path)
        except DatasetError as error:
            unread.append(UnreadFile(path.name, str(error)))
            continue
        with threadpool_limits(1):
            found = run_solvers([stored.problem], repeats=repeats)
        rows += found
        kinds.setdefault("frictionless" if stored.problem.friction is None else "friction", []).extend(found)
        lines.append(_line(stored, found))
    if progress is not None and files:
        progress("problem files", len(files), len(files))
    return ProblemStudy(str(folder), tuple(lines), tuple(rows), tuple(unread), _profiles(kinds))


def _line(stored: StoredProblem, rows: list[SolverRow]) -> ProblemLine:
    problem = stored.problem
    spreads = [row.spread for row in rows if row.verdict == "solved"]
    rank = int(np.linalg.matrix_rank(problem.delassus, hermitian=problem.asymmetry == 0.0)) if problem.size else 0
    return ProblemLine(
        problem.name, stored.format, problem.size, rank, rows[0].asymmetry if rows else 0.0,
        tuple((row.solver, row.verdict) for row in rows), max(spreads, default=np.nan), _stored_residual(stored),
    )  # fmt: skip


def _stored_residual(stored: StoredProblem) -> float:
    """Worst recomputed residual of the multipliers that the file itself carries."""
    from reference.complementarity.solution import Solution

    if stored.stored_impulse is None or stored.problem.size == 0:
        return np.nan
    return Solution(stored.problem, stored.stored_impulse, "stored in the file").residuals.worst


def _profiles(kinds: dict[str, list[SolverRow]]) -> tuple[tuple[str, str, Floats], ...]:
    from reference.complementarity.benchmark import performance_profile

    found = []
    for kind, rows in kinds.items():
        found += [(kind, solver, share) for solver, share in performance_profile(rows, FACTORS).items()]
    return tuple(found)

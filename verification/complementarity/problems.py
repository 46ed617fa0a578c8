"""Run every solver on every problem of a folder; recomputed residuals decide: solved, refused or failed.

The record also lists files that cannot be read, asymmetric matrices W and solvers that are not installed. Solutions
are compared by velocities, because the impulses of hyperstatic problems are not unique.

`own_problems` makes problems for users without such a folder: the hard cases, impacts of the project's scenes,
hyperstatic families, and patches with friction. They are the same in every call.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iapb.errors import ArgumentError
from reference.complementarity.benchmark import SolverRow, performance_profile, run_solvers
from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Solution
from reference.complementarity.solvers import solver_names
from reference.datasets import DatasetError, StoredProblem, problem_files, read_problem
from reference.one_thread import one_thread
from verification.complementarity.cases import random_cases
from verification.complementarity.scene_cases import scene_impacts
from verification.cost.step_cost import patch, pile
from verification.finding import Failure, attempt
from verification.hard_cases import HARD_CASES, HardCase
from verification.impacts import ImpactCase

Floats = NDArray[np.float64]

VERDICTS = ("solved", "refused", "failed", "missing", "left out")
FACTORS = np.concatenate([[1.0], np.geomspace(1.5, 1e5, 60)])  # multiples of the fastest solver's time


@dataclass(frozen=True)
class UnreadFile:
    """A file that is damaged or contains no problem."""

    file: str
    reason: str


@dataclass(frozen=True)
class ProblemLine:
    """One problem: format, friction, unknowns, rank and asymmetry of W (0 if symmetric), (solver, verdict) pairs.

    stored : largest recomputed residual of the multipliers stored in the file; NaN if the file has none
    spread : largest relative difference of contact velocities among the solvers that solved the problem
    """

    problem: str
    format: str
    friction: bool
    unknowns: int
    rank: int
    asymmetry: float
    verdicts: tuple[tuple[str, str], ...]
    spread: float
    stored: float


@dataclass(frozen=True)
class ProblemStudy:
    """The record of a folder: its problems, one row per solver and problem, the profile, and the unread files.

    profile : (kind, solver, shares): the shares of the problems of a kind ("frictionless", "friction") that the solver
        solves within each of FACTORS times the fastest solver's time (Dolan and Moré)
    """

    folder: str
    lines: tuple[ProblemLine, ...]
    rows: tuple[SolverRow, ...]
    unread: tuple[UnreadFile, ...]
    profile: tuple[tuple[str, str, Floats], ...]

    def count(self, solver: str, verdict: str) -> int:
        """Return the number of problems on which the solver has this verdict."""
        return sum(row.solver == solver and row.verdict == verdict for row in self.rows)

    @property
    def solvers(self) -> tuple[str, ...]:
        """Names of the solvers in the order of their first use."""
        return tuple(dict.fromkeys(row.solver for row in self.rows))


Progress = Callable[[str, int, int], None]


def study_problems(
    folder: Path | str, repeats: int = 1, longest: float = np.inf, progress: Progress | None = None,
    failures: list[Failure] | None = None,
) -> ProblemStudy:
    """Read every problem file below `folder` and solve it with every solver for its kind of problem.

    Parameters
    ----------
    repeats : number of solves of each pair of solver and problem; the fastest solve counts
    longest : if a solver needs more time than this [s], it skips all problems with more unknowns
    failures : receives the problems that raise an exception; if it is None, the exception propagates

    Raises
    ------
    ArgumentError
        If the folder does not exist.
    """
    read, unread = list["StoredProblem"](), list[UnreadFile]()
    files = problem_files(folder)
    for done, path in enumerate(files):
        if progress is not None:
            progress(f"reading {folder}", done, len(files))
        try:
            read.append(read_problem(path))
        except DatasetError as error:
            unread.append(UnreadFile(path.name, str(error)))
    return study_read(str(folder), read, unread, repeats, longest, progress, failures)


def study_read(
    name: str, problems: Sequence[StoredProblem], unread: Sequence[UnreadFile] = (), repeats: int = 1,
    longest: float = np.inf, progress: Progress | None = None, failures: list[Failure] | None = None,
) -> ProblemStudy:
    """Solve every problem of a collection called `name` with every solver for its kind of problem."""
    pairs, say = sum(len(solver_names(stored.problem)) for stored in problems), progress or (lambda *_: None)
    stage, begun = f"problems of {name}, by every solver", itertools.count()
    say(stage, 0, pairs)
    with one_thread():
        _warm(problems)
        small_first = sorted((stored.problem for stored in problems), key=lambda problem: problem.size)
        rows: list[SolverRow] = []
        slow: dict[str, float] = {}
        for problem in small_first:
            rows += attempt(problem.name, partial(
                run_solvers, [problem], repeats=repeats, longest=longest, slow=slow,
                progress=lambda *_: say(stage, next(begun), pairs)), failures) or []
    say(stage, pairs, pairs)
    kinds: dict[str, list[SolverRow]] = {}
    for stored in problems:
        kind = "frictionless" if stored.problem.friction is None else "friction"
        kinds.setdefault(kind, []).extend(_of(stored, rows))
    tried = [attempt(stored.problem.name, partial(_line, stored, found), failures)
             for stored in problems if (found := _of(stored, rows))]  # fmt: skip
    lines = tuple(line for line in tried if line is not None)
    return ProblemStudy(name, lines, tuple(rows), tuple(unread), _profiles(kinds))


def _warm(problems: Sequence[StoredProblem]) -> None:
    """Import and compile every solver on a problem of one contact; this time is not measured."""
    for friction in {stored.problem.friction is not None for stored in problems}:
        size = 3 if friction else 1
        w, b = np.eye(size), -np.eye(size)[0]
        run_solvers([ImpactProblem.from_delassus(w, b, 0.0, 0.5 if friction else None)])


def _of(stored: StoredProblem, rows: Sequence[SolverRow]) -> list[SolverRow]:
    return [row for row in rows if row.problem == stored.problem.name]


def _line(stored: StoredProblem, rows: list[SolverRow]) -> ProblemLine:
    problem = stored.problem
    spreads = [row.spread for row in rows if row.verdict == "solved"]
    rank = int(np.linalg.matrix_rank(problem.delassus, hermitian=problem.asymmetry == 0.0)) if problem.size else 0
    return ProblemLine(
        problem.name, stored.format, problem.friction is not None, problem.size, rank,
        rows[0].asymmetry if rows else 0.0, tuple((row.solver, row.verdict) for row in rows),
        max(spreads, default=np.nan), _stored_residual(stored),
    )  # fmt: skip


def _stored_residual(stored: StoredProblem) -> float:
    """Largest recomputed residual of the multipliers stored in the file; NaN if the file has none."""
    if stored.stored_impulse is None or stored.problem.size == 0:
        return np.nan
    return Solution(stored.problem, stored.stored_impulse, "stored in the file").residuals.worst


def _profiles(kinds: dict[str, list[SolverRow]]) -> tuple[tuple[str, str, Floats], ...]:
    found = []
    for kind, rows in kinds.items():
        found += [(kind, solver, share) for solver, share in performance_profile(rows, FACTORS).items()]
    return tuple(found)


Maker = Callable[[str], "ImpactProblem"]  # name -> problem

# Hard cases of the catalogue with few contacts. Cases with many contacts take the slowest solvers minutes.
HARD = ("nearly_parallel_normals", "printed_formula_gains", "hilbert_rows", "kahan_rows", "mass_ratio",
        "tiny_lever_arm", "face_at_three_points", "grazing", "subnormal_speeds", "light_direction",
        "bar_with_unequal_restitution")
HYPERSTATIC_CONTACTS = (8, 24, 64)
SCENES = ("peg_corner", "peg_hole_space", "three_link_arm_elastic", "arm_obstacles")
FAMILIES = ("face on floor", "corner", "tight hole", "random rows")
FRICTIONS = (0.1, 0.5, 1.0)
FRICTIONAL_CONTACTS = (1, 4, 12)
_SEED = 9


def own_problems(failures: list[Failure] | None = None) -> tuple[StoredProblem, ...]:
    """Return all problems of our own, frictionless ones first; `failures` receives those that cannot be made."""
    makers: dict[str, Maker] = {f"hard case {name}": partial(_hard_case, name) for name in HARD}
    makers |= {f"impact of {name}": partial(_scene_impact, name) for name in SCENES}
    makers |= dict(_hyperstatic()) | dict(_with_friction())
    made = (attempt(name, partial(make, name), failures) for name, make in makers.items())
    return tuple(StoredProblem(problem, format="built here") for problem in made if problem is not None)


def _hard_case(hard: str, name: str) -> ImpactProblem:
    case = HARD_CASES[hard]()
    if not isinstance(case, HardCase):
        raise ArgumentError("HARD", hard, "the name of a hard impact")
    return ImpactProblem.from_impact(
        case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution, name=name
    )


def _scene_impact(scene: str, name: str) -> ImpactProblem:
    """Return the impact of a scene with the most contacts."""
    return _posed(max(scene_impacts(scene).cases, key=lambda case: case.contacts), name)


def _hyperstatic() -> Iterator[tuple[str, Maker]]:
    for case in random_cases(1, restitutions=(0.5,), families=FAMILIES, seed=_SEED):
        if case.redundancy:
            yield f"{case.family}, {case.redundancy} redundant of {case.contacts}", partial(_posed, case)
    for contacts in HYPERSTATIC_CONTACTS:
        for make in (patch, pile):
            case = make(contacts, np.random.default_rng([_SEED, contacts]))
            yield f"{make.__name__} of {contacts}", partial(_posed, case)


def _posed(case: ImpactCase, name: str) -> ImpactProblem:
    return ImpactProblem.from_impact(
        case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution, name=name
    )


def _with_friction() -> Iterator[tuple[str, Maker]]:
    """Yield a box that lands on a patch and slides with dry friction, and a rod wedged between two walls."""
    for contacts in FRICTIONAL_CONTACTS:
        for mu in FRICTIONS:
            yield f"patch of {contacts}, μ = {mu:g}", partial(_rough_patch, contacts, mu)
    for mu in FRICTIONS:
        yield f"rod between walls, μ = {mu:g}", partial(_wedged_rod, mu)


def _rough_patch(contacts: int, mu: float, name: str) -> ImpactProblem:
    case = patch(contacts, np.random.default_rng([_SEED, contacts, 3]))
    rows = _with_tangents(case.contact_jacobian)
    return ImpactProblem.from_impact(case.mass_matrix, rows, case.velocity, 0.0, mu, name=name)


def _with_tangents(normals: np.ndarray) -> Floats:
    """Return a normal and two tangent rows for every contact of the patch: (k, 6) -> (3k, 6)."""
    rows = []
    for normal in normals:
        point = np.array([-normal[4], normal[3], -0.5])  # a point r has r × z = (y, −x, 0)
        rows += [normal, *(np.concatenate([t, np.cross(point, t)]) for t in np.eye(3)[:2])]
    return np.array(rows)


def _wedged_rod(mu: float, name: str) -> ImpactProblem:
    """A turning rod whose ends press on two facing walls: the normals are opposite, so friction alone can hold it."""
    points, normals = ((-0.6, -0.8), (0.6, 0.8)), ((1.0, 0.0), (-1.0, 0.0))
    rows = [_row(np.array(point), np.array(direction)) for point, (x, y) in zip(points, normals, strict=True)
            for direction in ((x, y, 0.0), (-y, x, 0.0), (0.0, 0.0, 1.0))]  # fmt: skip
    velocity = np.array([0.0, -0.4, 0.1, 0.0, 0.0, 0.7])
    mass = np.diag([1.0, 1.0, 1.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0])
    return ImpactProblem.from_impact(mass, np.array(rows), -velocity, 0.0, mu, name=name)


def _row(point: Floats, direction: Floats) -> Floats:
    """Return the row that maps (v, ω) to the velocity of the point (x, y) along a direction."""
    return np.concatenate([direction, np.cross([*point, 0.0], direction)])

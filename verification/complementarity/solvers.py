"""Run every solver on every problem of a folder; recomputed residuals decide: solved, refused or
failed.

The record also lists files that cannot be read, asymmetric matrices W and solvers that are not
installed. Solutions are compared by velocities, because the impulses of hyperstatic problems are
not unique.

`own_problems` makes problems for users without such a folder: the hard cases, impacts of the
project's scenes, hyperstatic families, and patches with friction. They are the same in every call.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from reference.complementarity.benchmark import SolverRow, run_solvers
from reference.complementarity.problem import SYMMETRY_TOLERANCE, ImpactProblem
from reference.complementarity.solution import Solution
from reference.complementarity.solvers import SOLVERS
from reference.datasets import DatasetError, StoredProblem, problem_files, read_problem
from reference.one_thread import one_thread
from verification.check import Check, Study, no_row_fails
from verification.complementarity.families import random_cases
from verification.complementarity.of_runs import scene_impacts
from verification.cost.impact_times import LONGEST
from verification.cost.problems import patch, pile
from verification.finding import Failure, attempt
from verification.hard_cases import HARD_CASES
from verification.impacts import Floats
from verification.table import Columns, Row

VERDICTS = ("solved", "refused", "failed", "missing", "left out")
OWN = "own problems"  # name of the collection that `own_problems` makes


class ProblemStudy(NamedTuple):
    """A collection of problems, solved by every solver for its kind of problem.

    lines : a row for each problem, with a column for each solver, and for each file that cannot be
        read
    rows : one for each solver and problem, as `run_solvers` returns them
    """

    lines: tuple[Row, ...]
    rows: tuple[SolverRow, ...]

    @property
    def solvers(self) -> tuple[str, ...]:
        """Names of the solvers in the order of their first use."""
        return tuple(dict.fromkeys(row.solver for row in self.rows))


def study_read(
    problems: Sequence[StoredProblem],
    unread: Mapping[str, str],
    longest: float,
    failures: list[Failure] | None,
) -> ProblemStudy:
    """Solve every problem of a collection; `unread` has the reason for each file that cannot be
    read."""
    slow = set[str]()
    rows: list[SolverRow] = []
    with one_thread():
        # imports and compiles, untimed
        for friction in {stored.problem.friction is not None for stored in problems}:
            size = 3 if friction else 1
            first = ImpactProblem.from_delassus(
                np.eye(size), -np.eye(size)[0], 0.0, 0.5 if friction else None
            )
            run_solvers(first, np.inf, slow)
        for problem in sorted((one.problem for one in problems), key=lambda one: one.size):
            solving = partial(run_solvers, problem, longest, slow)
            rows += attempt(problem.name, solving, failures) or []
    names = dict.fromkeys(row.solver for row in rows)
    lines = list[Row]()
    for stored in problems:
        found = [row for row in rows if row.problem == stored.problem.name]
        made = partial(_line, stored, found, names)
        line = attempt(stored.problem.name, made, failures) if found else None
        lines += [line] if line else []
    lines += [
        {"problem": file, **dict.fromkeys(names, "not read"), "why not read": reason}
        for file, reason in unread.items()
    ]
    return ProblemStudy(tuple(lines), tuple(rows))


def _line(stored: StoredProblem, rows: list[SolverRow], solvers: Mapping[str, Any]) -> Row:
    """Return the row of a problem: its size, the verdict on each solver, the spread of the contact
    velocities among those that solved it, and the recomputed residual of the multipliers that the
    file has."""
    problem = stored.problem
    verdicts = {row.solver: row.verdict for row in rows}
    residual = None
    if stored.stored_impulse is not None and problem.size:
        residual = Solution(problem, stored.stored_impulse, "stored in the file").residuals.worst
    rank = (
        int(np.linalg.matrix_rank(problem.delassus, hermitian=problem.asymmetry == 0.0))
        if problem.size
        else 0
    )
    return {
        "problem": problem.name,
        "unknowns": problem.size,
        "rank": rank,
        "asymmetry of W": problem.asymmetry if problem.asymmetry > SYMMETRY_TOLERANCE else None,
        **{name: verdicts.get(name) for name in solvers},
        "spread of velocities": max(
            (row.spread for row in rows if row.verdict == "solved"), default=None
        ),
        "residual as stored": residual,
        "why not read": None,
    }


def on_problems(study: Study, name: str, folder: Path | None) -> ProblemStudy:
    """Return the study of every problem file below a folder, or of our own problems, made once."""

    def make() -> ProblemStudy:
        read = list[StoredProblem]()
        unread = dict[str, str]()
        for path in problem_files(folder) if folder is not None else ():
            try:
                read.append(read_problem(path))
            except DatasetError as error:
                unread[path.name] = str(error)
        given = own_problems(study.failures) if folder is None else read
        return study_read(given, unread, LONGEST[study.depth], study.failures)

    return study.once(("problems", name), make)


def collections(folders: Mapping[str, Path]) -> tuple[Check, ...]:
    """Return a check for each folder of problem files by name: a row per problem."""
    return tuple(_collection(name, folder) for name, folder in folders.items())


def _collection(name: str, folder: Path) -> Check:
    return Check(
        key=name,
        question="Does at least one solver solve each problem?",
        cases=lambda study: on_problems(study, name, folder).lines,
        row=lambda study, line: line,
        holds=lambda row: "solved" in row.values(),
        targets=no_row_fails("problems that no solver solves"),
        columns=Columns(timed=("spread of velocities",)),
    )


def _solver(study: Study, name: str) -> Row:
    """Return how many of our own problems a solver solves."""
    found = [row.verdict for row in on_problems(study, OWN, None).rows if row.solver == name]
    return {
        "solver": name,
        "method": SOLVERS[name].method,
        "package": SOLVERS[name].package,
        "problems": len(found),
        **{verdict: found.count(verdict) for verdict in VERDICTS},
    }


SOLVER_TABLE = Check(
    key="solvers",
    question="Which solvers solve our own problems, by residuals computed again?",
    cases=lambda study: on_problems(study, OWN, None).solvers,
    row=_solver,
    columns=Columns(
        prose=VERDICTS
    ),  # a slow solver is left out; which one is slow differs between runs
)


# Hard cases of the catalogue with few contacts. Cases with many contacts take the slowest solvers
# minutes.
HARD = (
    "nearly_parallel_normals",
    "printed_formula_gains",
    "hilbert_rows",
    "kahan_rows",
    "mass_ratio",
    "tiny_lever_arm",
    "face_at_three_points",
    "grazing",
    "subnormal_speeds",
    "light_direction",
    "bar_with_unequal_restitution",
)
HYPERSTATIC_CONTACTS = (8, 24, 64)
SCENES = ("peg_corner", "peg_room", "three_link_arm_elastic", "arm_obstacles")
FAMILIES = ("face on floor", "corner", "tight hole", "random rows")
FRICTIONS = (0.1, 0.5, 1.0)
FRICTIONAL_CONTACTS = (1, 4, 12)
_SEED = 9


def own_problems(failures: list[Failure] | None) -> tuple[StoredProblem, ...]:
    """Return all problems of our own, frictionless ones first; `failures` receives those that
    cannot be made."""
    makers: dict[str, Callable[[], tuple[Any, ...]]] = {
        f"hard case {name}": partial(_hard, name) for name in HARD
    }
    makers |= {f"impact of {name}": partial(_widest, name) for name in SCENES}
    for case in random_cases(1, restitutions=(0.5,), families=FAMILIES, seed=_SEED):
        if case.redundancy:
            makers[f"{case.family}, {case.redundancy} redundant of {case.contacts}"] = partial(
                _given, case
            )
    for contacts in HYPERSTATIC_CONTACTS:
        for make in (patch, pile):
            case = make(contacts, np.random.default_rng([_SEED, contacts]))
            makers[f"{make.__name__} of {contacts}"] = partial(_given, case)
    makers |= {
        f"patch of {contacts}, μ = {mu:g}": partial(_rough_patch, contacts, mu)
        for contacts in FRICTIONAL_CONTACTS
        for mu in FRICTIONS
    }
    makers |= {f"rod between walls, μ = {mu:g}": partial(_wedged_rod, mu) for mu in FRICTIONS}
    made = {name: attempt(name, given, failures) for name, given in makers.items()}
    return tuple(
        StoredProblem(ImpactProblem.from_impact(*given, name=name))
        for name, given in made.items()
        if given is not None
    )


def _given(case: Any) -> tuple[Any, ...]:
    """Return M, J, v and e of an impact or a hard case."""
    return case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution


def _hard(name: str) -> tuple[Any, ...]:
    return _given(HARD_CASES[name]())


def _widest(scene: str) -> tuple[Any, ...]:
    """Return the impact of a scene with the most contacts."""
    return _given(max(scene_impacts(scene), key=lambda case: case.contacts))


def _rough_patch(contacts: int, mu: float) -> tuple[Any, ...]:
    """Return M, rows, v, e and μ of a box that lands on a patch and slides with dry friction."""
    case = patch(contacts, np.random.default_rng([_SEED, contacts, 3]))
    return case.mass_matrix, _with_tangents(case.contact_jacobian), case.velocity, 0.0, mu


def _with_tangents(normals: np.ndarray) -> Floats:
    """Return a normal and two tangent rows for every contact of the patch: (k, 6) -> (3k, 6)."""
    rows = []
    for normal in normals:
        point = np.array([-normal[4], normal[3], -0.5])  # a point r has r × z = (y, −x, 0)
        rows += [normal, *(np.concatenate([t, np.cross(point, t)]) for t in np.eye(3)[:2])]
    return np.array(rows)


def _wedged_rod(mu: float) -> tuple[Any, ...]:
    """Return a turning rod whose ends press on two facing walls: only friction can hold it, as the
    normals oppose."""
    ends = (((-0.6, -0.8, 0.0), (1.0, 0.0)), ((0.6, 0.8, 0.0), (-1.0, 0.0)))
    rows = [
        np.concatenate([direction, np.cross(point, direction)])
        for point, (x, y) in ends
        for direction in ((x, y, 0.0), (-y, x, 0.0), (0.0, 0.0, 1.0))
    ]
    mass = np.diag([1.0, 1.0, 1.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0])
    return mass, np.array(rows), -np.array([0.0, -0.4, 0.1, 0.0, 0.0, 0.7]), 0.0, mu

"""The impacts of a scene as complementarity problems, with and without friction, for every solver."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

import numpy as np

from iapb.run import Run
from iapb.scene import Scene
from reference.complementarity.solvers import SOLVERS
from reference.datasets import StoredProblem
from verification.complementarity.agreement import compare_cases
from verification.complementarity.problems import VERDICTS, ProblemStudy, study_read
from verification.complementarity.scene_cases import impacts_of_run, problems_of_run
from verification.finding import MIXED, NOT_TESTABLE, REPRODUCED, Failure, Part, Table, titled

Progress = Callable[[str, int, int], None]

LONGEST = 0.4  # [s] a solver that takes longer on one impact skips larger ones
CASES = 200  # largest number of impacts for which IAPB's motion is compared with that of the Newton LCP


def compare_impacts(
    run: Run, scene: Scene, most: int, progress: Progress, failures: list[Failure]
) -> tuple[list[Part], dict[str, Table]]:
    """Return the parts on the impacts of an IAPB run, and the tables "solvers" and "problems"."""
    problems, left_out = problems_of_run(run, scene, most)
    if not problems:
        why = f"{left_out} impacts follow another law than (21)" if left_out else "nothing collides"
        sentence = f"No impact of {scene.name} can be given to solvers: {why}."
        return [Part(sentence, NOT_TESTABLE, "impacts", optional=True)], {}
    stored = [StoredProblem(problem, format="built here") for problem in problems]
    study = study_read(f"impacts of {scene.name}", stored, longest=LONGEST, progress=progress, failures=failures)
    return [_motion(run, scene, failures), _solved(study)], {"solvers": _solvers(study), "problems": _problems(study)}


def _motion(run: Run, scene: Scene, failures: list[Failure]) -> Part:
    """Return the part on whether IAPB's impacts equal those of the Newton LCP, as they do if all contacts push."""
    compared = compare_cases(impacts_of_run(run, scene).cases[:CASES], failures=failures)
    agree, push = sum(one.agrees for one in compared), sum(one.pushes for one in compared)
    sentence = (f"IAPB moves as the frictionless Newton LCP in {agree} of its {len(compared)} impacts; in "
                f"{len(compared) - push} an impulse pulls. The largest distance is "
                f"{max(one.distance for one in compared):.2g} of |v⁻|.")  # fmt: skip
    return Part(sentence, REPRODUCED if agree == len(compared) else MIXED, "motion", agree, len(compared))


def _solved(study: ProblemStudy) -> Part:
    """Return the part on correct answers and on solvers with wrong ones; a refusal or an error is no answer."""
    solved = [row for row in study.rows if row.verdict == "solved"]
    wrong = Counter(row.solver for row in study.rows if row.verdict == "failed" and np.isfinite(row.residuals.worst))
    answers = len(solved) + wrong.total()
    unsolved = [line.problem for line in study.lines if "solved" not in dict(line.verdicts).values()]
    sentence = (f"{len(solved)} of {answers} answers are solutions, by residuals recomputed from the problem; "
                f"{len(study.lines) - len(unsolved)} of {len(study.lines)} problems have one.")
    if wrong:
        sentence += f" Wrong answers: {', '.join(f'{solver} {count}' for solver, count in wrong.items())}."
    verdict = MIXED if unsolved or wrong else REPRODUCED
    return Part(sentence, verdict, "solvers", len(solved), answers, timed=True)


def _solvers(study: ProblemStudy) -> Table:
    """Return a table with one row per solver."""
    rows = []
    for solver in study.solvers:
        mine = [row for row in study.rows if row.solver == solver]
        solved = [row for row in mine if row.verdict == "solved"]
        counts = [sum(row.verdict == verdict for row in mine) for verdict in VERDICTS[1:]]
        rows.append((solver, "friction" if SOLVERS[solver].takes == "cone" else "none", len(mine), len(solved), *counts,
                     max((row.residuals.worst for row in solved), default=None),
                     max((row.spread for row in solved), default=None),
                     float(np.median([1e6 * row.seconds for row in solved])) if solved else None))  # fmt: skip
    return titled(("solver", "friction", "problems", *VERDICTS, "worst residual", "spread of velocities",
                   "median time [µs]"), rows, 3,
                  "Residuals are recomputed from the problem, relative to its velocities; solved: at most 1e-6.",
                  timed=("median time [µs]", "left out"))  # fmt: skip


def _problems(study: ProblemStudy) -> Table:
    """Return a table with one row per solver and problem."""
    size = {line.problem: line for line in study.lines}
    rows = [(row.problem, size[row.problem].unknowns, size[row.problem].rank, row.solver, row.verdict,
             _known(row.residuals.worst), _known(row.spread), _known(1e6 * row.seconds), row.note)
            for row in study.rows]  # fmt: skip
    return titled(("problem", "unknowns", "rank", "solver", "outcome", "worst residual", "spread of velocities",
                   "time [µs]", "note"), rows, 3, timed=("time [µs]", "note"))  # fmt: skip


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None

"""Compare IAPB and its three assumptions with complementarity, in outcome and in cost."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from iapb.run import Run
from verification.complementarity import tables
from verification.complementarity.findings import parts_of
from verification.complementarity.study import ComparisonStudy, compare
from verification.finding import REPRODUCED, Failure, Finding, Part, Table, finding_of

ID, TITLE = "complementarity", "Against complementarity"
LEAD = (
    "IAPB solves (21): every colliding contact separates with e times its approach velocity, and impulses may pull. A "
    "linear complementarity problem (LCP) allows only pushing impulses and decides which contacts push. Both laws are "
    "applied to the same impacts: random families of known geometry, every impact of the project's scenes, and "
    "problems that solvers find hard. A solution counts only if its residuals, recomputed from the problem, are small. "
    "Velocities after the impact are compared in the kinetic metric, relative to |v⁻|."
)
# Optional folder of contact problems by others, next to the project. A clone does not need it.
FOLDER = Path(__file__).resolve().parents[3] / "shared" / "problems"
FOLDER_NAME = "published problems"


def complementarity(run: Callable[..., Run], depth: str, progress: Callable[[int, int], None]) -> Finding:
    """Compare the laws and return the finding with its tables; `run` simulates a scene in a world."""
    stages: list[str] = []

    def say(stage: str, done: int, total: int) -> None:
        if stage not in stages:
            stages.append(stage)
        progress(len(stages) - 1, STAGES)

    study = _renamed(compare(depth, [FOLDER] if FOLDER.is_dir() else [], progress=say))
    failures = list[Failure]()
    more = {"worlds": tables.worlds(run, failures=failures)}
    progress(STAGES, STAGES)
    return finding_of_study(study, more, failures)


def finding_of_study(
    study: ComparisonStudy, more: Mapping[str, Table] | None = None, failures: Sequence[Failure] = ()
) -> Finding:
    """Return the finding of a comparison: its judged sentences and all its tables, to which `more` is added."""
    failed = [*study.failures, *failures]
    parts = tuple(parts_of(study, failed))
    made = tables.all_tables(study, failed) | dict(more or {})
    return finding_of(ID, TITLE, LEAD, answer(study, parts), parts, made, failed)


STAGES = 9  # number of stages of `compare` with a folder of problems


def _renamed(study: ComparisonStudy) -> ComparisonStudy:
    """Return the study with the folder named FOLDER_NAME instead of by its path on this machine."""
    own, *others = study.problems
    return replace(study, problems=(own, *(replace(each, folder=FOLDER_NAME) for each in others)))


def answer(study: ComparisonStudy, parts: Sequence[Part]) -> str:
    """Return the answer for the first page of the report."""
    cells = study.cells + study.scenes
    cases = sum(cell.cases for cell in cells) or 1
    agree = sum(cell.agree * cell.cases for cell in cells) / cases
    against = sum(cell.contradictions for cell in cells)
    held = sum(part.verdict == REPRODUCED for part in parts)
    return (f"IAPB and the Newton LCP give the same velocity in {agree:.0%} of {cases} impacts. They agree exactly "
            f"where pushing impulses (p >= 0) can produce IAPB's velocity ({against} exceptions). {held} of "
            f"{len(parts)} findings are reproduced without restriction.")

"""What each sentence of a comparison amounts to: one of the verdicts of the claims ledger, from the record alone."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

import numpy as np

from verification.claims.claim import verdict_of
from verification.complementarity import sentences
from verification.complementarity.agreement import REPRODUCED as CONE_TOLERANCE
from verification.complementarity.agreement import SAME
from verification.complementarity.extensions import GAIN
from verification.complementarity.problem_study import ProblemStudy
from verification.complementarity.step_cost import rivals
from verification.complementarity.study import ComparisonStudy
from verification.complementarity.world_cost import costs_more, step_rivals
from verification.finding import LIMITED, NOT_TESTABLE, REFUTED, REPRODUCED, Failure, attempt

# Jᵀp lies in range(Jᵀ) to the rounding of two solves with M: condition numbers reach 1e4 in the families.
MOMENTUM = 1e-9
# Two solvers' outcomes of one law: ten times the residual that `reference.complementarity.laws` accepts.
SAME_LAW = 1e-8


@dataclass(frozen=True)
class Judged:
    """A sentence with its verdict: `name` is that of the function in `sentences` that made it.

    timed : whether it rests on measured times
    """

    name: str
    sentence: str
    verdict: str
    timed: bool = False


def judge(study: ComparisonStudy, failures: list[Failure] | None = None) -> tuple[Judged, ...]:
    """Every sentence of a study with its verdict; those about nothing are left out.

    failures : receives the sentences that cannot be made, as where every case that they are about failed
    """
    found = [attempt(f"sentence on {name.replace('_', ' ')}", partial(_judged, study, name), failures)
             for name in VERDICTS]  # fmt: skip
    for folder in study.problems:
        found += attempt(f"sentences on {folder.folder}", partial(judge_problems, folder), failures) or []
    return tuple(judged for judged in found if judged is not None)


def _judged(study: ComparisonStudy, name: str) -> Judged | None:
    sentence = str(getattr(sentences, name)(study))
    return Judged(name, sentence, VERDICTS[name](study), name in FROM_TIMES) if sentence else None


def judge_problems(study: ProblemStudy) -> list[Judged]:
    """The sentences about one collection of problems: each solved by somebody, and solved alike."""
    solved = [any(verdict == "solved" for _, verdict in line.verdicts) for line in study.lines]
    solved += [False for _ in study.unread]
    verdict = REPRODUCED if all(solved) else LIMITED
    # who is asked at all depends on how long he took before
    return [Judged("problems", sentence, verdict, timed=True) for sentence in sentences.problems(study)]


def _single_contact(study: ComparisonStudy) -> str:
    return _all(c.distance <= sentences.C05_TOLERANCE for c in study.single)


def _wider_class(study: ComparisonStudy) -> str:
    return _all(c.contradictions == 0 for c in study.cells + study.scenes)


def _two_contacts(study: ComparisonStudy) -> str:
    return _all(c.predicted == c.found for c in study.two_contacts)


def _difference(study: ComparisonStudy) -> str:
    return _all(c.defect <= CONE_TOLERANCE for c in study.cells + study.scenes)


def _energy(study: ComparisonStudy) -> str:
    cells = study.cells + study.scenes
    return _all(c.least_extra_loss >= -SAME and c.momentum <= MOMENTUM for c in cells)


def _scenes(study: ComparisonStudy) -> str:
    """Whether all agree; where they differ is what the map shows, and refutes nothing."""
    return REPRODUCED if all(c.agree == 1.0 for c in study.scenes) else LIMITED


def _touching(study: ComparisonStudy) -> str:
    """No contact that touches is left approaching, impact by impact."""
    cells = [c for c in study.cells if c.family == "with a neighbour"]
    return _by_share(1.0 - float(np.mean([c.left_approaching for c in cells])))


def _friction(study: ComparisonStudy) -> str:
    """The NCP's motion where all push, and never a gain of energy."""
    if any(c.largest_gain > GAIN for c in study.friction):
        return REFUTED
    return _by_share(sum(c.same for c in study.friction) / max(1, sum(c.pushing for c in study.friction)))


def _unequal(study: ComparisonStudy) -> str:
    return _all(c.distance <= SAME_LAW and c.gain <= GAIN for c in study.unequal)


def _ideal_world(study: ComparisonStudy) -> str:
    return verdict_of([row.first_order for row in study.convergence])


def _cost(study: ComparisonStudy) -> str:
    """An impact costs more by a complementarity solver than by IAPB, called alike, pair by pair."""
    return verdict_of([pair.costs_more for pair in rivals(study.impact_costs)])


def _steps(study: ComparisonStudy) -> str:
    """A step of the rigid world costs more than a step of IAPB, both taken from Python."""
    return verdict_of([costs_more(ideal, ours) for ideal, ours in step_rivals(study.step_costs)])


def _all(outcomes: Iterable[bool]) -> str:
    """A statement that claims to be exact has no exceptions."""
    found = list(outcomes)
    return NOT_TESTABLE if not found else REPRODUCED if all(found) else REFUTED


def _by_share(share: float) -> str:
    return REPRODUCED if share == 1.0 else LIMITED if share >= 0.5 else REFUTED


# The function in `sentences` -> its verdict; in the order of the report.
VERDICTS: dict[str, Callable[[ComparisonStudy], str]] = {
    "single_contact": _single_contact,
    "wider_class": _wider_class,
    "two_contacts": _two_contacts,
    "difference": _difference,
    "energy": _energy,
    "scenes": _scenes,
    "touching": _touching,
    "friction": _friction,
    "unequal": _unequal,
    "ideal_world": _ideal_world,
    "cost": _cost,
    "steps": _steps,
}
FROM_TIMES = ("cost", "steps")

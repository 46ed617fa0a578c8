"""Topic "mechanics": linkages and free bodies against Pinocchio, closed forms, and laws of conservation."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

from reports.evidence import mechanics_sentences as sentences
from reports.evidence.mechanics_tables import (
    AGAINST_PINOCCHIO,
    bodies_table,
    filters_table,
    linked_table,
    pinocchio_table,
    study_table,
    times_table,
)
from reports.runner import Runner
from verification.finding import Failure, Finding, Part, attempt, finding_of, of_each

ID, TITLE = "mechanics", "Linkages and free bodies"
LEAD = (
    "Objects and linkages are points of one configuration space (1)-(3). Here its mechanics is held against Pinocchio, "
    "against closed forms and against the laws of conservation; then it is used: linked impacts in which the rows "
    "decide, the same impact in other coordinates, an arm led through its singular poses, a ball in a faceted socket."
)


def compute(runner: Runner, depth: str, progress: Callable[[int, int], None]) -> Finding:
    """Run every study of the mechanics and say what each found."""
    from verification.cost.many_bodies import study_many_bodies
    from verification.mechanics import STUDIES, check_mechanics
    from verification.mechanics.false_collisions import study_false_collisions
    from verification.mechanics.linked_impacts import study_linked_impacts

    failures: list[Failure] = []
    total = len(STUDIES) + 3
    studies = check_mechanics(depth, lambda done, _: progress(done, total), failures)
    linked = study_linked_impacts(failures)
    progress(total - 2, total)
    rolled = study_false_collisions(simulate=lambda scene: runner(scene, "IAPB"), failures=failures)
    progress(total - 1, total)
    costs = study_many_bodies(failures=failures)
    progress(total, total)
    tables = {
        "linked impacts": linked_table(linked),
        **{name: study_table(studies[name]) for name in ("coordinate invariance", "tumbling") if name in studies},
        "false collisions in time": times_table(rolled),
        "false collisions": filters_table(rolled),
        "against Pinocchio": pinocchio_table(studies),
        **{name: study_table(studies[name]) for name in ("power balance", "positive definite") if name in studies},
        **{name: study_table(studies[name], leave_out=("fault",)) for name in ("operating",) if name in studies},
        "many bodies": bodies_table(costs),
    }
    said: list[partial[Iterator[Part]]] = [
        *(partial(sentences.against_pinocchio, name, studies[name]) for name in AGAINST_PINOCCHIO if name in studies),
        *(partial(sentence, studies[name]) for name, sentence in sentences.OF_STUDIES.items() if name in studies),
        partial(sentences.linked, linked), partial(sentences.rows_decide, linked),
        partial(sentences.false_collisions, rolled), partial(sentences.many_bodies, costs),
    ]  # fmt: skip
    findings = tuple(of_each(said, lambda sentence: sentence(), failures, lambda sentence: sentence.func.__name__))
    verdict = attempt("verdict", lambda: sentences.verdict(studies, linked), failures) or ""
    return finding_of(ID, TITLE, LEAD, verdict, findings, tables, failures)

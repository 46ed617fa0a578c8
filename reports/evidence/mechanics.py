"""Topic "mechanics": linkages and free bodies against Pinocchio, closed forms, and laws of conservation."""

from __future__ import annotations

from collections.abc import Callable

from reports.evidence import mechanics_sentences as sentences
from reports.evidence.mechanics_tables import (
    bodies_table,
    filters_table,
    linked_table,
    pinocchio_table,
    study_table,
    times_table,
)
from reports.pages.records import Topic
from reports.runner import Runner

ID, TITLE = "mechanics", "Linkages and free bodies"
LEAD = (
    "Objects and linkages are points of one configuration space (1)-(3). Here its mechanics is held against Pinocchio, "
    "against closed forms and against the laws of conservation; then it is used: linked impacts in which the rows "
    "decide, the same impact in other coordinates, an arm led through its singular poses, a ball in a faceted socket."
)


def compute(runner: Runner, depth: str, progress: Callable[[int, int], None]) -> Topic:
    """Run every study of the mechanics and say what each found."""
    from verification.mechanics import STUDIES, check_mechanics
    from verification.studies.false_collisions import study_false_collisions
    from verification.studies.linked_impacts import study_linked_impacts
    from verification.studies.many_bodies import study_many_bodies

    total = len(STUDIES) + 3
    studies = check_mechanics(depth, lambda done, _: progress(done, total))
    linked = study_linked_impacts()
    progress(total - 2, total)
    rolled = study_false_collisions(simulate=lambda scene: runner(scene, "IAPB"))
    progress(total - 1, total)
    costs = study_many_bodies()
    progress(total, total)
    tables = {
        "linked impacts": linked_table(linked),
        "coordinate invariance": study_table(studies["coordinate invariance"]),
        "tumbling": study_table(studies["tumbling"]),
        "false collisions in time": times_table(rolled),
        "false collisions": filters_table(rolled),
        "against Pinocchio": pinocchio_table(studies),
        "power balance": study_table(studies["power balance"]),
        "positive definite": study_table(studies["positive definite"]),
        "operating": study_table(studies["operating"], leave_out=("fault",)),
        "many bodies": bodies_table(costs),
    }
    findings = (
        *sentences.against_pinocchio(studies),
        sentences.positive_definite(studies["positive definite"]),
        sentences.power_balance(studies["power balance"]),
        sentences.tumbling(studies["tumbling"]),
        sentences.coordinate_invariance(studies["coordinate invariance"]),
        sentences.operating(studies["operating"]),
        *sentences.linked(linked),
        sentences.false_collisions(rolled),
        *sentences.many_bodies(costs),
    )
    return Topic(ID, TITLE, LEAD, findings, tables, sentences.verdict(studies, linked))

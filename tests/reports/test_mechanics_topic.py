"""The topic of the mechanics: its sentences follow the records, also where they are bad, and its figures are drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reports.evidence import mechanics_sentences as sentences
from reports.evidence.mechanics_tables import (
    filters_table,
    linked_table,
    pinocchio_table,
    study_table,
    times_table,
)
from reports.figures import RECIPES
from reports.figures.figure import Figure, draw
from reports.figures.linked_impacts import BERNOULLI, CRADLE, outcomes
from verification.cost.many_bodies import StepCost
from verification.finding import LIMITED, NOT_COMPUTED, REFUTED, REPRODUCED, Table
from verification.mechanics import robots
from verification.mechanics.coordinate_invariance import coordinate_invariance
from verification.mechanics.false_collisions import SETTINGS, FalseCollisions
from verification.mechanics.linked_impacts import PER_BODY, LinkedOutcome, study_linked_impacts
from verification.mechanics.own_robots import compare_kinds
from verification.mechanics.tumbling import tumbling


@pytest.fixture(scope="module")
def linked() -> tuple[LinkedOutcome, ...]:
    return study_linked_impacts()


@pytest.fixture(scope="module")
def compared() -> dict[str, object]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(robots, "STATES", 2)
        kinds = compare_kinds()
    skipped = Table(kinds.columns, note="no folder")
    return dict.fromkeys(("random trees", "joint kinds", "scenes", "URDF texts"), kinds) | {"robots": skipped}


def rolled(left: dict[float, int]) -> tuple[FalseCollisions, ...]:
    """Runs of the socket, by damping how many false collisions both filters leave."""
    found = []
    for damping, kept in left.items():
        for clustering, coherence in SETTINGS.values():
            count = kept if clustering and coherence else 20
            found.append(FalseCollisions(
                clustering, coherence, damping, 2000, count, count, 0 if clustering else 99, 5 if count else 0,
                1e-3 * count, 0.1, 1.2, tuple(np.linspace(0.1, 1.9, count)), (1e-3,) * count,
            ))  # fmt: skip
    return tuple(found)


def test_robots_that_are_not_there_are_said_to_be_not_there(compared) -> None:
    found = [next(sentences.against_pinocchio(name, study)) for name, study in compared.items()]
    assert [finding.verdict for finding in found] == [REPRODUCED] * 4 + [NOT_COMPUTED]
    assert "not there" in found[-1].sentence
    assert len(pinocchio_table(compared).rows) == 4 * len(compared["joint kinds"].rows)


def test_a_mechanism_that_differs_is_refuted(compared) -> None:
    kinds = compared["joint kinds"]
    wrong = replace(kinds, holds=(False,) * len(kinds.rows))
    assert next(sentences.against_pinocchio("random trees", wrong)).verdict == REFUTED


def test_linked_impacts_are_refuted_where_momentum_is_lost_by_relative_rows(linked) -> None:
    said = (*sentences.linked(linked), *sentences.rows_decide(linked))
    assert [finding.verdict for finding in said] == [REPRODUCED] * 3
    spoilt = [replace(o, velocity=1.001 * o.velocity) if o.treatment != PER_BODY else o for o in linked]
    assert next(sentences.linked(spoilt)).verdict == REFUTED


def test_per_body_rows_that_kept_momentum_would_refute_erratum_3(linked) -> None:
    kept = [replace(o, velocity=o.before) if o.treatment == PER_BODY else o for o in linked]
    assert list(sentences.linked(kept))[1].verdict == REFUTED


@pytest.mark.parametrize(
    ("left", "outcome"),
    [({40.0: 0, 60.0: 0}, REPRODUCED), ({10.0: 7, 40.0: 0}, LIMITED), ({10.0: 7, 40.0: 3}, REFUTED)],
)
def test_false_collisions_are_judged_by_what_both_filters_leave(left, outcome) -> None:
    [finding] = sentences.false_collisions(rolled(left))
    assert finding.verdict == outcome
    assert ("comes back" in finding.sentence) == (outcome != REPRODUCED)


def test_work_that_grows_as_all_pairs_is_refuted() -> None:
    counts = (20, 50, 100, 200)
    linear = [StepCost(n, 1e-6 * n, 0.0, 0, n * n, n) for n in counts]
    pairs, time = sentences.many_bodies(linear)
    assert (pairs.verdict, pairs.timed, time.timed) == (REPRODUCED, False, True)
    assert next(sentences.many_bodies([replace(cost, tested=cost.pairs) for cost in linear])).verdict == REFUTED


def test_every_figure_of_the_topic_is_drawn_from_its_tables(linked) -> None:
    sockets = rolled({10.0: 7, 40.0: 0})
    inputs = {
        "mechanics/linked impacts": linked_table(linked),
        "mechanics/coordinate invariance": study_table(coordinate_invariance()),
        "mechanics/tumbling": study_table(tumbling()),
        "mechanics/false collisions in time": times_table(sockets),
        "mechanics/false collisions": filters_table(sockets),
    }
    drawn = [draw(recipe, inputs) for recipe in RECIPES if recipe.section == "mechanics"]
    assert len(drawn) >= 4 and all(isinstance(figure, Figure) for figure in drawn)
    assert all(panel.svg.startswith("<svg") and panel.alt for figure in drawn for panel in figure.panels)


def test_the_table_of_linked_impacts_is_read_back_as_it_was(linked) -> None:
    table = linked_table(linked)
    for problem in (CRADLE, BERNOULLI):
        mine = [o for o in linked if o.problem == problem]
        read = outcomes(table, problem)
        assert [(o.treatment, o.rows) for o in read] == [(o.treatment, o.rows) for o in mine]
        for ours, theirs in zip(read, mine, strict=True):
            np.testing.assert_array_equal(ours.velocity, theirs.velocity)

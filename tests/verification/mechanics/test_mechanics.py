"""What is said of the mechanics follows the records, also where they are bad, and its figures are drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reports.figures import RECIPES
from reports.figures.figure import Figure, draw
from reports.figures.linked_impacts import BERNOULLI, CRADLE, outcomes
from verification.finding import MIXED, NOT_TESTABLE, REFUTED, REPRODUCED, Table
from verification.mechanics import robots
from verification.mechanics.coordinate_invariance import coordinate_invariance
from verification.mechanics.false_collisions import (
    SETTINGS,
    FalseCollisions,
    filters,
    filters_table,
    times_table,
)
from verification.mechanics.linked_impacts import (
    PER_BODY,
    LinkedOutcome,
    conserved,
    linked_table,
    per_body,
    rows_decide,
    study_linked_impacts,
)
from verification.mechanics.robots import agreement, compare_kinds, pinocchio_table
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
    said = [agreement(name, study) for name, study in compared.items()]
    assert [part.verdict for part in said] == [REPRODUCED] * 4 + [NOT_TESTABLE]
    assert "are not compared" in said[-1].sentence
    assert len(pinocchio_table(compared).rows) == 4 * len(compared["joint kinds"].rows)


def test_a_mechanism_that_differs_is_refuted(compared) -> None:
    kinds = compared["joint kinds"]
    assert agreement("random trees", replace(kinds, holds=(False, *kinds.holds[1:]))).verdict == REFUTED


def test_linked_impacts_are_refuted_where_momentum_is_lost_by_relative_rows(linked) -> None:
    assert {said(linked).verdict for said in (conserved, per_body, rows_decide)} == {REPRODUCED}
    spoilt = [replace(o, velocity=1.001 * o.velocity) if o.treatment != PER_BODY else o for o in linked]
    assert conserved(spoilt).verdict == REFUTED


def test_per_body_rows_that_kept_momentum_would_refute_erratum_3(linked) -> None:
    kept = [replace(o, velocity=o.before) if o.treatment == PER_BODY else o for o in linked]
    assert per_body(kept).verdict == REFUTED


@pytest.mark.parametrize(
    ("left", "outcome"),
    [({40.0: 0, 60.0: 0}, REPRODUCED), ({10.0: 7, 40.0: 0}, MIXED), ({10.0: 7, 40.0: 3}, REFUTED)],
)
def test_false_collisions_are_judged_by_what_both_filters_leave(left, outcome) -> None:
    said = filters(rolled(left))
    assert said.verdict == outcome
    assert ("bounces off the facets" in said.sentence) == (outcome != REPRODUCED)


def test_every_figure_of_the_topic_is_drawn_from_its_tables(linked) -> None:
    sockets = rolled({10.0: 7, 40.0: 0})
    inputs = {
        "mechanics/linked impacts": linked_table(linked),
        "mechanics/coordinate invariance": coordinate_invariance(),
        "mechanics/tumbling": tumbling(),
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

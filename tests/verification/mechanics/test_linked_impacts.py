"""Cradle and Bernoulli: what keeps energy and momentum, what does not, and what the rows decide."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pytest

from verification.check import Study
from verification.finding import REFUTED, REPRODUCED
from verification.mechanics import linked_impacts as study


def chosen(found: Iterable[tuple[str, str, np.ndarray]], treatment: str, rows: str) -> np.ndarray:
    (velocity,) = [velocity for one, words, velocity in found if treatment in one and rows in words]
    return velocity


def test_relative_rows_keep_energy_and_momentum_and_per_body_rows_lose_momentum() -> None:
    table = study.LINKED_IMPACTS.table(Study())
    for row in table.records():
        assert abs(row["energy change"]) < study.CONSERVED, row
        change = row["momentum change"]
        assert change > 0.5 if row["treatment"] == study.PER_BODY else change < study.CONSERVED
    assert [part.verdict for part in study.LINKED_IMPACTS.sentences(table)] == [REPRODUCED] * 3


@pytest.mark.parametrize(("part", "share"), [(0, 1.001), (1, 0.0)])
def test_outcomes_that_contradict_a_sentence_refute_it(
    monkeypatch, part: int, share: float
) -> None:
    """Relative rows that lose momentum, and per-body rows that keep it."""

    def spoilt(balls, outcomes=study.outcomes):
        for treatment, words, after in outcomes(balls):
            if (treatment == study.PER_BODY) == (part == 1):
                after = share * after if share else balls.velocity
            yield treatment, words, after

    monkeypatch.setattr(study, "outcomes", spoilt)
    assert (
        study.LINKED_IMPACTS.sentences(study.LINKED_IMPACTS.table(Study()))[part].verdict == REFUTED
    )


@pytest.mark.parametrize("n", range(2, 8))
def test_cradle_depends_on_which_rows_collide(n: int) -> None:
    found = list(study.outcomes(study.cradle(n)))
    every = chosen(found, "(12)", "all")[:, 0]
    first = chosen(found, "(12)", "approaching")[:, 0]
    handed_on = chosen(found, "event-driven", "one after")[:, 0]
    np.testing.assert_allclose(every, [2.0 / n - 1.0] + [2.0 / n] * (n - 1), atol=study.CONSERVED)
    np.testing.assert_allclose(first, [0.0, 1.0] + [0.0] * (n - 2), atol=study.CONSERVED)
    np.testing.assert_allclose(handed_on, [0.0] * (n - 1) + [1.0], atol=study.CONSERVED)
    per_body = chosen(found, "(13)", "all")[:, 0]  # as from a wall
    np.testing.assert_allclose(per_body, [-1.0] + [0.0] * (n - 1), atol=study.CONSERVED)


def test_bernoulli_struck_at_once_is_symmetric_and_in_turn_is_not() -> None:
    found = list(study.outcomes(study.bernoulli()))
    at_once = chosen(found, "(12)", "approaching")
    cos, sin = math.cos(math.pi / 6.0), math.sin(math.pi / 6.0)
    speed = 2.0 * math.sqrt(3.0) / 5.0
    expected = [[-0.2, 0.0], [speed * cos, speed * sin], [speed * cos, -speed * sin]]
    np.testing.assert_allclose(at_once, expected, atol=study.CONSERVED)
    first, second = (chosen(found, "event-driven", f"{k}, then") for k in (0, 1))
    assert (
        abs(first[0, 1]) > 0.1
    )  # the striker is thrown aside, to the side of the ball struck second
    np.testing.assert_allclose(first[[0, 2, 1]] * [1.0, -1.0], second, atol=study.CONSERVED)

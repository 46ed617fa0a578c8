"""Cradle and Bernoulli: what keeps energy and momentum, what does not, and what the rows decide."""

from __future__ import annotations

import math

import numpy as np
import pytest

from verification.mechanics.linked_impacts import (
    CONSERVED,
    LinkedOutcome,
    bernoulli,
    cradle,
    outcomes,
    study_linked_impacts,
)

TOLERANCE = CONSERVED


def chosen(found: tuple[LinkedOutcome, ...], treatment: str, rows: str) -> LinkedOutcome:
    (outcome,) = [o for o in found if treatment in o.treatment and rows in o.rows]
    return outcome


def test_relative_rows_and_sequences_keep_energy_and_momentum() -> None:
    for outcome in study_linked_impacts():
        if "per-body" not in outcome.treatment:
            assert abs(outcome.energy_change) < TOLERANCE, outcome
            assert outcome.momentum_change < TOLERANCE, outcome


def test_per_body_rows_keep_energy_and_lose_momentum() -> None:
    lost = [o for o in study_linked_impacts() if "per-body" in o.treatment]
    assert len(lost) == 14
    for outcome in lost:
        assert abs(outcome.energy_change) < TOLERANCE
        assert outcome.momentum_change > 0.5, outcome


@pytest.mark.parametrize("n", range(2, 8))
def test_cradle_depends_on_which_rows_collide(n: int) -> None:
    found = outcomes(cradle(n))
    every = chosen(found, "(12)", "all").velocity[:, 0]
    first = chosen(found, "(12)", "approaching").velocity[:, 0]
    handed_on = chosen(found, "event-driven", "one after").velocity[:, 0]
    np.testing.assert_allclose(every, [2.0 / n - 1.0] + [2.0 / n] * (n - 1), atol=TOLERANCE)
    np.testing.assert_allclose(first, [0.0, 1.0] + [0.0] * (n - 2), atol=TOLERANCE)
    np.testing.assert_allclose(handed_on, [0.0] * (n - 1) + [1.0], atol=TOLERANCE)


def test_cradle_per_body_rows_reverse_the_striker_as_from_a_wall() -> None:
    outcome = chosen(outcomes(cradle(5)), "(13)", "all")
    np.testing.assert_allclose(outcome.velocity[:, 0], [-1.0, 0.0, 0.0, 0.0, 0.0], atol=TOLERANCE)
    assert outcome.momentum_change == pytest.approx(2.0)


def test_bernoulli_struck_at_once_is_symmetric_and_in_turn_is_not() -> None:
    found = outcomes(bernoulli())
    at_once = chosen(found, "(12)", "approaching").velocity
    cos, sin = math.cos(math.pi / 6.0), math.sin(math.pi / 6.0)
    speed = 2.0 * math.sqrt(3.0) / 5.0
    expected = [[-0.2, 0.0], [speed * cos, speed * sin], [speed * cos, -speed * sin]]
    np.testing.assert_allclose(at_once, expected, atol=TOLERANCE)
    first, second = (chosen(found, "event-driven", f"{k}, then").velocity for k in (0, 1))
    assert abs(first[0, 1]) > 0.1  # the striker is thrown aside, to the side of the ball struck second
    np.testing.assert_allclose(first[[0, 2, 1]] * [1.0, -1.0], second, atol=TOLERANCE)


def test_bernoulli_third_row_holds_the_struck_balls_together() -> None:
    found = outcomes(bernoulli())
    three, two = chosen(found, "(12)", "all").velocity, chosen(found, "(12)", "approaching").velocity
    assert abs(three[1, 1] - three[2, 1]) < TOLERANCE
    assert abs(two[1, 1] - two[2, 1]) > 0.5

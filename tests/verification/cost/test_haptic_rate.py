"""Contacts at the haptic rate, scaling and the anytime resolver: what must hold on any machine."""

from __future__ import annotations

import pytest

from verification.claims import CLAIMS
from verification.cost.anytime import anytime
from verification.cost.haptic_rate import (
    ALLOWED,
    FACTORED,
    PRINTED,
    RateTrial,
    haptic_rate,
    most_contacts,
)
from verification.cost.kernels import quartiles
from verification.cost.scaling import Timing, exponent


def test_sizes_grow_until_one_is_late() -> None:
    trials = haptic_rate((3,), (6, 12), calls=5)
    assert {trial.method for trial in trials} == {FACTORED, PRINTED}
    for method in (FACTORED, PRINTED):
        chosen = [trial for trial in trials if trial.method == method]
        assert [trial.contacts for trial in chosen] == [6, 12][: len(chosen)]
        assert all(trial.in_time for trial in chosen[:-1])


def test_the_most_contacts_are_the_last_in_time() -> None:
    trials = tuple(RateTrial(FACTORED, 3, c, late, 1e-4) for c, late in ((6, 0), (12, ALLOWED), (30, ALLOWED + 1)))
    assert most_contacts(trials, FACTORED, 3) == 12
    assert most_contacts(trials, PRINTED, 3) == 0


@pytest.mark.parametrize(("late", "contacts", "outcome"), [(0, 6, True), (2, 6, False), (2, 300, None)])
def test_c19_speaks_of_late_calls_up_to_sixty_contacts(late: int, contacts: int, outcome: bool | None) -> None:
    assert CLAIMS["C19"].holds({"late calls": late, "contacts": contacts}) is outcome


@pytest.mark.parametrize("power", [0.9, 1.5])
def test_the_exponent_of_a_power_law_is_found(power: float) -> None:
    timings = [Timing("factored", 12, c, quartiles([1e-6 * c**power])) for c in (50, 100, 5000)]
    assert exponent(timings, "factored", "contacts") == pytest.approx(power, abs=1e-12)


def test_every_budget_is_passive_and_the_whole_one_meets_restitution() -> None:
    rows = anytime(impacts=5)
    assert all(row.most_gain <= 0.0 for row in rows)
    for row in rows:
        assert (row.worst < 1e-13) == (row.budget == row.rank)
    by_size = {(row.coordinates, row.budget): row.lost for row in rows}
    assert by_size[12, 0] == 0.0 < by_size[12, 3] < by_size[12, 8] == pytest.approx(1.0)

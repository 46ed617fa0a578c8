"""Contacts at the haptic rate, scaling and the anytime resolver: what must hold on any machine."""

from __future__ import annotations

import pytest

from verification.claims import CLAIMS
from verification.cost.calls import PRINTED
from verification.cost.growth import (
    ALLOWED,
    FACTORED,
    RATE_COLUMNS,
    SCALING_COLUMNS,
    SIZES,
    TITLES,
    exponent,
    haptic_rate,
    most_contacts,
    scaling,
)
from verification.cost.impacts import anytime
from verification.finding import table_of


def test_sizes_grow_until_one_is_late() -> None:
    trials = haptic_rate((3,), (6, 12), calls=5)
    assert set(trials.column("method")) == set(TITLES.values())
    for method in TITLES.values():
        chosen = trials.where(method=method)
        assert chosen.column("contacts") == [6, 12][: len(chosen.rows)]
        assert all(late <= ALLOWED for late in chosen.column("late calls")[:-1])


def test_the_most_contacts_are_the_last_in_time() -> None:
    keys = ("method", "coordinates", "contacts", "late calls")
    rows = [("a", 3, 6, 0), ("a", 3, 12, ALLOWED), ("a", 3, 30, ALLOWED + 1), ("b", 3, 6, 9)]
    trials = table_of(RATE_COLUMNS, [dict(zip(keys, row, strict=True)) for row in rows])
    assert most_contacts(trials) == {"a": {3: 12}, "b": {3: 0}}


@pytest.mark.parametrize(("late", "contacts", "outcome"), [(0, 6, True), (2, 6, False), (2, 300, False)])
def test_c19_fails_wherever_calls_are_late(late: int, contacts: int, outcome: bool | None) -> None:
    assert CLAIMS["C19"].holds({"late calls": late, "contacts": contacts}) is outcome


@pytest.mark.parametrize("power", [0.9, 1.5])
def test_the_exponent_of_a_power_law_is_found(power: float) -> None:
    rows = [{"method": FACTORED, "coordinates": 12, "contacts": c, "time": c**power} for c in (50, 100, 5000)]
    assert exponent(table_of(SCALING_COLUMNS, rows), FACTORED, "contacts") == pytest.approx(power, abs=1e-12)


def test_every_budget_is_passive_and_the_whole_one_meets_restitution() -> None:
    rows = anytime(impacts=5).records()
    assert max(row["largest relative gain"] for row in rows) <= 0.0
    for row in rows:
        assert (row["largest residual"] < 1e-13) == (row["budget"] == row["rank"])
    by_size = {(row["coordinates"], row["budget"]): row["share of the loss"] for row in rows}
    assert by_size[12, 0] == 0.0 < by_size[12, 3] < by_size[12, 8] == pytest.approx(1.0)


def test_sizes_are_timed_by_both_methods() -> None:
    """Times themselves are never judged by a test: that is for `iapb bench`."""
    found = scaling(3, sizes=((3, 4), (12, 600)))
    assert [row[:3] for row in found.rows] == [(FACTORED, 3, 4), (PRINTED, 3, 4), (FACTORED, 12, 600)]
    assert all(0.0 < row["lower quartile"] <= row["time"] <= row["upper quartile"] for row in found.records())
    assert {(12, 60), (12, 300)} <= set(SIZES)  # where the printed formula has its targets

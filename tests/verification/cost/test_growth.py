"""Contacts at the haptic rate, and scaling: what must hold on any machine."""

from __future__ import annotations

import pytest

from verification.check import Study
from verification.claims import CLAIMS
from verification.cost.calls import PRINTED
from verification.cost.growth import (
    ALLOWED,
    FACTORED,
    FACTORS,
    SIZES,
    fitted,
    haptic_rate,
    most_contacts,
    scaling,
    steepest,
)
from verification.cost.impacts import BUDGET_ROWS, Stopped
from verification.table import table_from


def test_sizes_grow_until_one_is_late() -> None:
    for method in (FACTORED, PRINTED):
        trials = list(haptic_rate(3, method, (6, 12), calls=5))
        assert [row["contacts"] for row in trials] == [6, 12][: len(trials)]
        assert all(row["late calls [of 1000]"] <= ALLOWED for row in trials[:-1])


def test_the_most_contacts_are_the_last_in_time() -> None:
    keys = ("method", "coordinates", "contacts", "late calls")
    rows = [("a", 3, 6, 0), ("a", 3, 12, ALLOWED), ("a", 3, 30, ALLOWED + 1), ("b", 3, 6, 9)]
    trials = table_from(dict(zip(keys, row, strict=True)) for row in rows)
    assert most_contacts(trials) == {"a": {3: 12}, "b": {3: 0}}


@pytest.mark.parametrize(("late", "outcome"), [(0, True), (2, False)])
def test_c19_fails_wherever_calls_are_late(late: int, outcome: bool) -> None:
    assert CLAIMS["C19"].holds({"late calls": late, "contacts": 6}) is outcome


def test_where_a_curve_climbs_fastest_is_found() -> None:
    assert steepest([1, 100, 1000, 10], [1.0, 1e4, 1.0, 10.0]) == (10, 100, pytest.approx(3.0))  # the fall is steeper


def test_exponents_and_the_steepest_range_are_those_of_the_method_and_the_axis() -> None:
    power = {FACTORED: (1.0, 2.0), PRINTED: (0.5, 3.0)}  # over contacts and coordinates, above the smallest size
    sizes = [(12, c) for c in (30, 60, 120)] + [(d, 60) for d in (6, 24)]
    table = table_from(
        {"method": method, "coordinates": d, "contacts": c, "time [µs]": (max(c, 60) / 60) ** a * (d / 12) ** b}
        for method, (a, b) in power.items() for d, c in sizes)  # fmt: skip
    for method, (over_contacts, over_coordinates) in power.items():
        row = fitted(table, method, "contacts")
        assert (row["steepest from"], row["to"], row["there"]) == (60, 120, pytest.approx(over_contacts))
        row = fitted(table, method, "coordinates")
        assert (row["exponent"], row["there"]) == (pytest.approx(over_coordinates), pytest.approx(over_coordinates))


def test_every_budget_is_passive_and_the_whole_one_meets_restitution() -> None:
    rows = BUDGET_ROWS.table(Study(), [Stopped(12, 60, budget) for budget in (0, 3, 7, 8)]).records()
    assert max(row["largest relative gain"] for row in rows) <= 0.0
    assert [row["largest residual"] < 1e-13 for row in rows] == [row["budget"] == row["rank"] for row in rows]
    none, few, _, every = (row["share of the loss"] for row in rows)
    assert none == 0.0 < few < every == pytest.approx(1.0)


def test_sizes_are_timed_by_both_methods() -> None:
    """Times themselves are never judged by a test: that is for `iapb bench`."""
    found = scaling(Study(), ((3, 4), (12, 600)))
    assert [(row["method"], row["contacts"]) for row in found] == [(FACTORED, 4), (PRINTED, 4), (FACTORED, 600)]
    assert all(0.0 < row["lower quartile [µs]"] <= row["upper quartile [µs]"] for row in found)
    assert {(12, contacts) for contacts in FACTORS} <= set(SIZES)  # where the printed formula has its targets

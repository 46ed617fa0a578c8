"""Accuracy against time: the impacts have one truth for all methods, the records hide nothing, a
budget is kept."""

from __future__ import annotations

from typing import Any

import pytest

from iapb import ArgumentError
from reports.commands.bench import seconds_of
from verification import which_method
from verification.cost import accuracy as study
from verification.table import Table


@pytest.fixture(scope="module")
def measured() -> Table:
    seen: list[tuple[int, int]] = []
    found = study.work_precision([(4, 3)], progress=lambda done, of: seen.append((done, of)))
    assert seen == [(k, 9) for k in range(10)]
    return found


def test_a_small_study_is_complete_and_its_answers_are_right(measured: Table) -> None:
    ways = [way for way in study.WAYS if way.rows < 3]
    assert len(measured.rows) == 9 * len(ways)
    assert min(measured.where(outcome="ok")["time"]) > 0.0
    ours = measured.where(method=study.IAPB, work="all rows")
    assert set(ours["outcome"]) == {"ok"}
    assert max(ours["relative error"]) < 1e-12 and max(ours["relative energy gain"]) == 0.0
    one, two = (
        max(measured.where(method=study.IAPB, work=rows)["relative error"])
        for rows in ("1 row", "2 rows")
    )
    assert one > two > 1e-12
    assert max(measured.where(method=study.SWEEPS, work="1024 sweeps")["relative error"]) < one


def rows_of(ways: dict[str, list[tuple[float, ...]]]) -> Table:
    """The rows of ways of "method, work": (time [µs], error, gain or nothing) on each impact of one
    size."""
    return study.ACCURACY.table_of(
        [
            {
                "contacts": 4,
                "coordinates": 3,
                "problem": str(k),
                "method": way.split(", ")[0],
                "work": way.split(", ")[1],
                "called": study.COMPILED,
                "time [µs]": time,
                "relative error": error,
                "relative energy gain": sum(gain),
                "outcome": "ok" if time < 1e4 else study.TOO_SLOW,
            }
            for way, found in ways.items()
            for k, (time, error, *gain) in enumerate(found)
        ]
    )


KNOWN = rows_of(
    {
        way: [found] * 2
        for way, found in {
            "IAPB, 1 row": (1.0, 0.5),
            "IAPB, all rows": (3.0, 1e-15),
            "Gauss-Seidel, 4 sweeps": (0.4, 0.1),
            "Gauss-Seidel, 64 sweeps": (2.0, 1e-10, 1e-3),
            "Lemke, all pivots": (2.5, 1e-11),
            "slow, all": (1e5, 1e-16),
        }.items()
    }
)


def test_the_choice_is_in_time_makes_no_energy_and_is_as_exact_as_can_be() -> None:
    def chosen(budget: float) -> tuple[str, str] | None:
        found = study.choose(KNOWN, budget, 4, 3)
        return None if found is None else (found.method, found.work)

    assert chosen(3e-7) is None
    assert (
        chosen(5e-7) == chosen(2e-6) == (study.SWEEPS, "4 sweeps")
    )  # the more exact one makes energy
    assert chosen(2.6e-6) == chosen(1.0) == ("Lemke", "all pivots")  # below 1e-9 the faster one
    nearest = study.choose(KNOWN, 5e-7, 4, 3)
    assert nearest is not None and not nearest.enough and "no method solves half" in str(nearest)
    assert "nearest is Gauss-Seidel, stopped after 4 sweeps" in str(nearest)


@pytest.mark.parametrize(
    ("named", "given"),
    [
        ("budget", (0.0, 2, 3)),
        ("budget", ("1", 2, 3)),
        ("contacts", (1.0, 0, 3)),
        ("coordinates", (1.0, 2, 3.0)),
    ],
)
def test_a_wrong_budget_or_size_is_named(named: str, given: tuple[Any, ...]) -> None:
    with pytest.raises(ArgumentError) as caught:
        which_method(*given)
    assert caught.value.argument == named


@pytest.mark.parametrize(
    ("text", "seconds"), [("50us", 5e-5), ("0.5 ms", 5e-4), ("1e-4s", 1e-4), ("3µs", 3e-6)]
)
def test_budgets_are_read(text: str, seconds: float) -> None:
    assert seconds_of(text) == pytest.approx(seconds)

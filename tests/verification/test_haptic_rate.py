"""The targets of the page on speed: each decides alone, and a planted miss is one."""

from __future__ import annotations

import pytest

from verification.check import Study
from verification.claims.speed import C19, C22
from verification.cost import growth, impact_times, robots, steps
from verification.cost.accuracy import COMPILED, LEMKE, PYTHON
from verification.cost.trajectories import (
    MOTIONS,
    WORTH,
    worth,
)
from verification.finding import REFUTED, REPRODUCED
from verification.haptic_rate import BENCH, DERIVED
from verification.numbers import read_values
from verification.table import Table

Tables = dict[str, Table]


def _races(ratio: float) -> Table:
    row = {"scene": "peg in the corner", "MuJoCo's step [µs]": 1.0, "ratio": ratio, "target": 0.1}
    return steps.RACES.table_of([row])


def _rates(printed: float, power: float = 1.0) -> Table:
    return C19.table_of(
        [
            {
                "method": method,
                "deadline": growth.MILLISECOND,
                "coordinates": 12,
                "contacts": c,
                "late calls [of 1000]": 0,
                "time [µs]": factor * c**power,
            }
            for method, factor in zip(growth.TITLES.values(), (1.0, printed), strict=True)
            for c in (60, 300, 1200)
        ]
    )


def _pairs(*ratios: float, method: str = LEMKE, called: str = COMPILED) -> Table:
    steps_row = {
        "impacts": impact_times.STEPS,
        "method": impact_times.RIGID,
        "called": PYTHON,
        "time [µs]": 1e3,
        "IAPB [µs]": 2.0,
        "IAPB, slowest [µs]": 3.0,
        "solver alone [µs]": 9.0,
    }
    rows = [
        {
            "impacts": "pile",
            "method": method,
            "called": called,
            "contacts": k,
            "ratio": ratio,
            "lower quartile": ratio,
            "upper quartile": ratio,
            "apart": 0.0,
        }
        for k, ratio in enumerate(ratios, 1)
    ]
    return C22.table_of([*rows, steps_row])


def _bodies(power: float, pairs: float) -> Table:
    return steps.BODIES.table_of(
        [
            {"bodies": n, "step [µs]": float(n) ** power, "pairs tested": float(n) ** pairs}
            for n in (20, 100, 200)
        ]
    )


def _robots(ratio: float) -> Table:
    return robots.ROBOTS.table_of(
        [
            {"robot": "arm", "quantity": "bias", "form": form, "ratio": ratio}
            for form in robots.LIMITS
        ]
    )


def _motions(**errors: tuple[float, ...]) -> Table:
    """Runs whose steps and times fall and grow by a hundred from one to the next."""
    return MOTIONS.table_of(
        [
            {
                "scene": "ball",
                "method": method,
                "step [ms]": 10.0**-k,
                "time [ms/s]": 1.1 * 100.0**k,
                "position": error,
                "energy made": error,
                "outcome": "ok",
                "note": "",
            }
            for method, given in errors.items()
            for k, error in enumerate(given)
        ]
    )


def _whole(tables: Tables) -> Tables:
    study = Study(results={("table", key): table for key, table in tables.items()})
    return tables | {check.key: study.table(check) for check in DERIVED}


@pytest.fixture
def tables() -> Tables:
    """Every target is met."""
    motions = _motions(IAPB=(1e-1, 1e-2, 1e-3), MuJoCo=(1e-1, 2e-2))
    names = ("IAPB", "IAPB, stiff springs")
    return {
        steps.RACES.key: _races(0.05),
        C19.key: _rates(200.0),
        C22.key: _pairs(0.5, 0.4),
        steps.BODIES.key: _bodies(1.0, 1.0),
        robots.ROBOTS.key: _robots(0.9),
        MOTIONS.key: motions,
        WORTH.key: WORTH.table_of([worth(motions, name) for name in names]),
    }


@pytest.mark.parametrize(
    ("key", "planted", "misses"),
    [
        (steps.RACES.key, _races(0.4), 1),
        (C19.key, _rates(50.0), 1),  # at 300 contacts alone
        (C19.key, _rates(200.0, power=1.5), 1),
        (C22.key, _pairs(0.5, 2.0), 1),
        (C22.key, _pairs(0.5, 2.0, method=impact_times.DAQP, called=PYTHON), 1),
        (steps.BODIES.key, _bodies(2.0, 1.0), 1),
        (steps.BODIES.key, _bodies(1.0, 2.0), 1),
        (robots.ROBOTS.key, _robots(2.0), 1),  # above the limit of many states alone
        (MOTIONS.key, _motions(IAPB=(1e-1, 1e-2), MuJoCo=(1e-1, 5e-3)), 2),
    ],
)
def test_a_missed_target_is_refuted(tables: Tables, key: str, planted: Table, misses: int) -> None:
    met = BENCH.conclude(_whole(tables))
    assert not met.failures and {part.verdict for part in met.parts} == {REPRODUCED}
    found = BENCH.conclude(_whole(tables | {key: planted}))
    assert not found.failures and found.verdict == REFUTED
    assert [part.verdict for part in found.parts].count(REFUTED) == misses
    values = read_values(found.tables)
    assert values["targets_met"] == values["targets"] - misses == len(found.parts) - misses

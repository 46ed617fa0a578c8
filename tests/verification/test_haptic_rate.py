"""The study of the haptic rate: a miss is called a miss; a report measures each quantity once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from verification.claims.speed import C19, C22
from verification.cost.accuracy import BUDGET_ROWS
from verification.cost.calls import PRINTED
from verification.cost.effects import summary
from verification.cost.growth import FACTORED, FITTED, MILLISECOND, SCALING, fitted
from verification.cost.robots import MANY, ONE, ROBOTS
from verification.cost.solvers import DAQP, IAPB, IMPACT_TIMES, KERNEL, printed_faster
from verification.cost.steps import BODIES, IDEAL, RACES
from verification.cost.trajectories import BELOW, MOTIONS, TIMED_OUT, WORTH, curves, worth
from verification.finding import NOT_COMPUTED, REFUTED, REPRODUCED, Finding
from verification.haptic_rate import BENCH, KERNELS, RATE, SOLVERS, TOPIC, quoting
from verification.table import Table, table_from

Tables = dict[str, Table]


def _races(ratio: float) -> Table:
    return RACES.table_of(
        [
            {
                "scene": "peg in the corner",
                "MuJoCo's solver": "Newton",
                "iapb's contacts": 4,
                "MuJoCo's contacts": 8,
                "MuJoCo's step [µs]": 1.0 / ratio,
                "ratio": ratio,
                "quartiles": "",
                "target": 0.1,
            }
        ]
    )


def _times(printed: float) -> Table:
    sizes = [(12, c) for c in (50, 60, 500)] + [(d, 60) for d in (3, 6)]
    return SCALING.table_of(
        [
            {
                "method": method,
                "coordinates": d,
                "contacts": c,
                "time [µs]": t * c * d,
                "lower quartile [µs]": 1,
                "upper quartile [µs]": 2,
            }
            for d, c in sizes
            for method, t in ((FACTORED, 0.01), (PRINTED, 0.01 * printed))
        ]
    )


def _costs(*solvers: tuple[str, float]) -> Table:
    return IMPACT_TIMES.table_of(
        [
            {
                "impacts": "patch",
                "contacts": 4,
                "solver": name,
                "outcome": "solved",
                "median [µs]": t,
                "least [µs]": t,
                "largest [µs]": t,
            }
            for name, t in solvers
        ]
    )


def _bodies(*counts: int, step: Callable[[int], float], tested: Callable[[int], int]) -> Table:
    return BODIES.table_of(
        [
            {
                "bodies": n,
                "step [µs]": step(n),
                "contacts": 1.0,
                "pairs of shapes": n * n,
                "pairs tested": tested(n),
            }
            for n in counts
        ]
    )


def _run(
    method: str, step: float, error: float | None, time: float, outcome: str = "ok", note: str = ""
) -> Any:
    return {
        "scene": "ball",
        "method": method,
        "step [ms]": step,
        "time [ms/s]": time,
        "position": error,
        "energy": error,
        "signed energy": error,
        "energy made": error,
        "outcome": outcome,
        "note": note,
    }


def _budget(budget: int, gain: float = 0.0) -> Any:
    return {
        "coordinates": 6,
        "contacts": 24,
        "rank": 4,
        "budget [rows]": budget,
        "median residual": 0.1,
        "largest residual": 0.2,
        "share of the loss": budget / 4,
        "largest relative gain": gain,
    }


def _kernels(*ratios: float) -> Table:
    return C22.table_of(
        [
            {
                "problem": "pile",
                "contacts": k,
                "ratio": ratio,
                "lower quartile": ratio,
                "upper quartile": ratio,
            }
            for k, ratio in enumerate(ratios, 1)
        ]
    )


LATE = C19.table_of(
    [
        {"method": name, "deadline": MILLISECOND, "coordinates": 3, "contacts": c, "late calls": 0}
        for name, c in (("factored", 600), ("the printed formula", 60))
    ]
)


@pytest.fixture
def tables() -> Tables:
    """Every target is met."""
    motions = MOTIONS.table_of(
        [
            _run("IAPB", 1.0, 1e-3, 1.0),
            _run("PB", 1.0, 1.0, 1.0),
            _run("MuJoCo", 1.0, 1e-2, 10.0),
            _run("MuJoCo", 0.1, None, 3e3, "timed out"),
        ]
    )
    scaled = _times(20.0)
    given = {
        RACES: _races(0.05),
        SCALING: scaled,
        FITTED: FITTED.table_of([fitted(scaled, *case) for case in FITTED.cases(None)]),  # type: ignore[arg-type]
        RATE: RATE.table_of(
            [
                {
                    "coordinates": 3,
                    "most contacts, factored": 600,
                    "most contacts, printed formula": 60,
                }
            ]
        ),
        BODIES: _bodies(20, 100, 200, step=float, tested=int),
        ROBOTS: ROBOTS.table_of(
            [
                {"robot": "arm", "quantity": "bias", "form": form, "ratio": 0.9}
                for form in (ONE, MANY)
            ]
        ),
        SOLVERS: _costs((IAPB, 1e-4), (KERNEL, 1e-6), ("daqp", 3e-4), (DAQP, 2e-4)),
        BUDGET_ROWS: BUDGET_ROWS.table_of([_budget(budget) for budget in range(5)]),
        MOTIONS: motions,
        WORTH: worth(motions),
    }
    return {check.key: table for check, table in given.items()} | {KERNELS.key: _kernels(2.0, 3.0)}


def _found(tables: Tables) -> Finding:
    found = BENCH.conclude(tables)
    assert not found.failures
    return found


@pytest.mark.parametrize(
    ("change", "number"),
    [
        ({RACES.key: _races(0.4)}, "0.4 times as long as MuJoCo's"),
        ({SCALING.key: _times(5.0)}, "takes 5 times"),
        (
            {SOLVERS.key: _costs((IAPB, 1e-4), ("daqp", 3e-5), (DAQP, 2e-4))},
            "than daqp on a patch of 4 contacts",
        ),
        (
            {SOLVERS.key: _costs((IAPB, 1e-4), ("daqp", 3e-4), (DAQP, 3e-5))},
            "faster than DAQP in 0 of the 1 impacts",
        ),
        (
            {KERNELS.key: _kernels(2.0, 0.5, 1.0)},
            "faster than Lemke's method in 1 of the 2 sizes of impact",
        ),
        ({BODIES.key: _bodies(20, 200, step=lambda n: 1e-3 * n**2, tested=int)}, "power 2"),
        ({BODIES.key: _bodies(20, 200, step=float, tested=lambda n: n * n)}, "tested pairs"),
        (
            {BUDGET_ROWS.key: BUDGET_ROWS.table_of([_budget(2, gain=1e-16)])},
            "adds energy in 1 of 1",
        ),
    ],
)
def test_a_miss_is_called_one(tables: Tables, change: Tables, number: str) -> None:
    found = _found(tables | change)
    missed, others = (
        [part for part in found.parts if (part.verdict == REFUTED) == miss]
        for miss in (True, False)
    )
    assert (
        len(missed) == 1
        and number in missed[0].sentence
        and {part.verdict for part in others} == {REPRODUCED}
    )
    assert (
        f"We meet {len(others)} of {len(found.parts)} of our own targets for speed and accuracy"
        in found.answer
    )
    assert (
        missed[0].miss or "a budget of rows" in missed[0].sentence
    )  # the first page has a clause on it


def test_a_scene_that_drifts_while_it_is_timed_is_not_called_at_rest() -> None:
    row = _races(0.4).by_title()[0]
    for drift, said in (
        (1e-9, "corner at rest, our step"),
        (5e-3, "nearly at rest (moving by 0.005 rad), our step"),
    ):
        [part] = RACES.sentences(RACES.table_of([row | {"iapb's drift": drift}]))
        assert said in part.miss


def test_piles_on_which_the_printed_formula_is_faster_are_named() -> None:
    rows = [
        {
            "impacts": "pile",
            "contacts": c,
            "solver": name,
            "outcome": "solved",
            "median [µs]": t,
            "least [µs]": t,
            "largest [µs]": t,
        }
        for c in (4, 64, 300)
        for name, t in ((IAPB, 1.0 * c), (PRINTED, 80.0))
    ]
    assert printed_faster(IMPACT_TIMES.table_of(rows)).startswith(
        "On piles of 300 independent contacts"
    )
    assert "up to 3.8 times" in printed_faster(IMPACT_TIMES.table_of(rows)) and not printed_faster(
        _costs((IAPB, 1.0))
    )


def test_the_effect_that_saves_most_for_its_error_is_best() -> None:
    keys = ("effect", "active", "step", "all on", "faster than real time", "time saved", "position")
    rows = [
        ("cheap", True, 2.0, 3.0, 500.0, 10.0, 0.0),
        ("dear", True, 2.0, 3.0, 500.0, 40.0, 1.0),
        ("bad", True, 2.0, 3.0, 500.0, 10.0, 2.0),
        ("off", False, 2.0, 3.0, 500.0, None, None),
    ]
    tables = {"slow": table_from(dict(zip(keys, row, strict=True)) for row in rows)}
    assert {row["effect"]: row["best of its error"] for row in summary(tables).records()} == {
        "cheap": "yes",
        "dear": "yes",
        "bad": "no",
    }


def _table(**errors: tuple[float, ...]) -> Table:
    """Runs whose steps and times fall and grow by a hundred from one to the next; " in a note:
    below the bound."""
    return MOTIONS.table_of(
        [
            _run(
                name,
                10.0**-k,
                error,
                1.1 * 100.0**k + (name == "late"),
                note=f"position {BELOW}" if error < 1e-9 else "",
            )
            for name, given in errors.items()
            for k, error in enumerate(given)
        ]
    )


def test_what_a_tenfold_accuracy_costs_and_who_is_never_worth_it() -> None:
    """Error over time with slope −1/2 costs a hundredfold; a method behind another on every scene
    is on no front."""
    good, late = worth(_table(good=(1e-1, 1e-2, 1e-3), late=(2e-1, 2e-1, 2e-1))).records()
    assert good["tenfold accuracy costs"] == pytest.approx(100.0) and good["best for its time"] == 1
    assert late["tenfold accuracy costs"] is None and late["least error"] == 2e-1
    assert late["best for its time"] == 0 and late["error stays"] == 1
    # a fast run is not worth its time if its error is useless
    coarse, fine = worth(_table(coarse=(0.9,), fine=(1.0, 0.95, 0.01))).records()
    assert coarse["best for its time"] == 0 and fine["best for its time"] == 1


@pytest.mark.parametrize(("errors", "undecided"), [((9e-1, 3e-1), 1), ((9e-1, 8.9e-1), 0)])
def test_a_method_that_our_limit_of_time_cuts_short_is_not_called_worthless(
    errors: tuple[float, ...], undecided: int
) -> None:
    """Its error still falls where we stop it; where it is level, more time would not help it."""
    runs = [
        *_table(good=(1e-1, 1e-2, 1e-3), slow=errors).by_title(),
        _run("slow", 1e-3, None, 1e9, TIMED_OUT),
    ]
    motions = MOTIONS.table_of(
        [
            run | {"time [ms/s]": 2.0 * run["time [ms/s]"]} if run["method"] == "slow" else run
            for run in runs
        ]
    )
    good, slow = worth(motions).records()
    assert (good["cut short"], slow["cut short"], slow["best for its time"]) == (0, undecided, 0)


def test_a_motion_on_which_another_world_is_more_exact_is_a_miss() -> None:
    errors = {"IAPB": (1e-1, 1e-2), "PB": (1.0,), IDEAL: (1e-1, 5e-3)}
    [part] = MOTIONS.sentences(_table(**errors))
    assert (
        part.verdict == REFUTED
        and f"as exact as {IDEAL} (smallest errors 1 % and 0.5 % of" in part.miss
    )
    [part] = MOTIONS.sentences(_table(**errors | {IDEAL: (1e-1, 2e-2)}))
    assert part.verdict == REPRODUCED


@pytest.mark.parametrize(
    ("errors", "used", "words"),
    [
        ((1e-1, 1e-2, 1e-3), (1e-1, 1e-2, 1e-3), "10× costs 100×"),
        ((1e-1, 1e-2, 1e-3, 0.9e-3, 1.1e-3), (1e-1, 1e-2, 1e-3), "10× costs 100×, then level"),
        (
            (0.9, 1.0, 1e-1, 1e-2),
            (1.0, 1e-1, 1e-2),
            "10× costs 100×",
        ),  # the coarse end does not count
        ((1e-1, 1e-2, 1e-3, 1e-10), (1e-1, 1e-2, 1e-3), "10× costs 100×"),  # exact by chance
        ((0.5, 0.48, 0.5), (), "stays at 0.48"),
        # no fit to two runs, nor to three whose errors span less than the tenfold: the measured
        # factors instead
        ((1e-1, 1e-2, 0.9e-2), (1e-1, 1e-2), "10× costs 100× (2 runs), then level"),
        ((8e-1, 4e-1, 1e-1), (8e-1, 4e-1, 1e-1), "8× costs 10000× (3 runs)"),
    ],
)
def test_a_fit_takes_the_runs_on_which_the_error_falls(
    errors: tuple[float, ...], used: tuple[float, ...], words: str
) -> None:
    [curve] = curves(_table(good=errors))
    assert tuple(run["position"] for run in curve.used) == used and curve.words == words
    assert (curve.cost is None) == (not used or "runs" in words)
    assert sorted(run["position"] for run in curve.runs) == sorted(errors)


def test_a_report_measures_each_quantity_once_and_quotes_it(tables: Tables) -> None:
    own = {check.key: tables[check.key] for check in TOPIC.checks}
    topic = TOPIC.conclude(own)
    c19, c22 = (
        Finding(check.key, "", "", "", REPRODUCED, tables={check.key: table})
        for check, table in ((C19, LATE), (C22, tables[KERNELS.key]))
    )
    costs = Finding(
        "complementarity", "", "", "", REPRODUCED, tables={IMPACT_TIMES.key: tables[SOLVERS.key]}
    )
    whole = quoting(topic, (c19, c22, costs))
    assert [(part.sentence, part.verdict) for part in whole.parts] == [
        (part.sentence, part.verdict) for part in _found(tables).parts
    ]
    assert (
        whole.tables[KERNELS.key] is tables[KERNELS.key]
        and whole.tables[RATE.key].rows == tables[RATE.key].rows
    )
    part = quoting(topic, (c19, costs)).parts[-1]
    assert part.verdict == NOT_COMPUTED and KERNELS.key in part.sentence
    assert quoting(replace(topic, tables={}), (c19, costs)).parts == topic.parts

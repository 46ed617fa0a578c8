"""The study of the haptic rate: a miss is called a miss, an absent engine is named, every figure has its table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from reports.commands import bench as command
from reports.figures.cost import (
    anytime,
    effect_costs,
    effect_steps,
    impact_scaling,
    integrator_precision,
    trajectory_precision,
)
from reports.figures.plot import Plot
from tests.reports.figure_inputs import tables as kept_tables
from verification.claims.speed import CLEAR, costs_more
from verification.clock import Times
from verification.cost.against_mujoco import PART_COLUMNS, RACE_COLUMNS
from verification.cost.calls import PRINTED
from verification.cost.effects import COLUMNS as EFFECT_COLUMNS
from verification.cost.effects import saved, steps, summary
from verification.cost.growth import FACTORED, RATE_COLUMNS, SCALING_COLUMNS, fitted, steepest
from verification.cost.impacts import BUDGET_COLUMNS, METHOD_COLUMNS
from verification.cost.many_bodies import COLUMNS as BODY_COLUMNS
from verification.cost.start_up import COLUMNS as START_COLUMNS
from verification.cost.step_cost import COST_COLUMNS, IAPB, KERNEL
from verification.cost.study import (
    KERNELS,
    RATE,
    SOLVERS,
    _rate,
    _say_motions,
    _say_worth,
    compute,
    finding,
    quoting,
)
from verification.cost.trajectories import (
    BELOW,
    IDEAL,
    INTEGRATORS,
    STIFFENED,
    TIMED_OUT,
    WORLDS,
    by_chance,
    curves,
    tenfold_cost,
    worth,
)
from verification.cost.trajectories import COLUMNS as MOTION_COLUMNS
from verification.finding import MIXED, NOT_COMPUTED, REPRODUCED, Failure, Finding, Table, table_of, titled
from verification.mechanics.robot_timing import MANY, ONE

Tables = dict[str, Table]


def _races(ratio: float) -> Table:
    return table_of(RACE_COLUMNS, [
        {"scene": "peg in the corner", "MuJoCo's form": "box", "MuJoCo's solver": "Newton", "iapb's contacts": 4,
         "MuJoCo's contacts": 8, "MuJoCo's step": 1.0 / ratio, "ratio": ratio, "quartiles": "", "target": 0.1}
    ])  # fmt: skip


def _times(printed: float) -> Table:
    sizes = [(12, c) for c in (50, 60, 500)] + [(d, 60) for d in (3, 6)]
    return table_of(SCALING_COLUMNS, [
        {"method": method, "coordinates": d, "contacts": c, "time": t * c * d, "lower quartile": 1, "upper quartile": 2}
        for d, c in sizes for method, t in ((FACTORED, 0.01), (PRINTED, 0.01 * printed))
    ])  # fmt: skip


def _costs(*solvers: tuple[str, float]) -> Table:
    return table_of(COST_COLUMNS, [
        {"impacts": "patch", "contacts": 4, "solver": name, "outcome": "solved", "median": t, "least": t, "largest": t}
        for name, t in solvers])  # fmt: skip


def _bodies(*counts: int, step: Callable[[int], float], tested: Callable[[int], int]) -> Table:
    return table_of(BODY_COLUMNS, [{"bodies": n, "step": step(n), "contacts": 1.0, "pairs of shapes": n * n,
                                    "pairs tested": tested(n)} for n in counts])  # fmt: skip


def _run(method: str, step: float, error: float | None, time: float, outcome: str = "ok", note: str = "") -> Any:
    return {"scene": "ball", "method": method, "step": step, "time": time, "position": error, "energy": error,
            "signed energy": error, "energy made": error, "outcome": outcome, "note": note}  # fmt: skip


def _budget(budget: int, gain: float = 0.0) -> Any:
    return {"coordinates": 6, "contacts": 24, "rank": 4, "budget": budget, "median residual": 0.1,
            "largest residual": 0.2, "share of the loss": budget / 4, "largest relative gain": gain}  # fmt: skip


@pytest.fixture
def tables() -> Tables:
    """Everything as asked for."""
    parts = (("whole step", 1.0), ("contacts found", 0.6), ("record", 0.1), ("device", 0.05))
    robots = titled(("robot", "quantity", "form", "ratio"), [("arm", "bias", form, 0.9) for form in (ONE, MANY)])
    late = [{"method": "factored", "coordinates": 3, "contacts": 600, "late calls": 0},
            {"method": "the printed formula", "coordinates": 3, "contacts": 60, "late calls": 0}]  # fmt: skip
    motions = [_run("IAPB, semi-implicit Euler", 1.0, 1e-3, 1.0), _run(STIFFENED, 1.0, 1.0, 1.0),
               _run("MuJoCo", 1.0, 1e-2, 10.0), _run("MuJoCo", 0.1, None, 3e3, "timed out")]  # fmt: skip
    return {
        "steps against MuJoCo": _races(0.05),
        "parts of a step": table_of(PART_COLUMNS, [
            {"scene": "peg in the corner", "part": name, "time": t} for name, t in parts]),
        "scaling": _times(20.0), "fitted": fitted(_times(20.0)),
        "contacts at 1 kHz": _rate(table_of(RATE_COLUMNS, late)),
        "bodies": _bodies(20, 100, 200, step=float, tested=int),
        "robots": replace(robots, note="made up"),
        "solvers": _costs((IAPB, 1e-4), (KERNEL, 1e-6), ("daqp", 3e-4), ("Lemke kernel", 2e-6)),
        "start": Table(START_COLUMNS, (("iapb --help", 0.4, 0.3, 1, 0.5),)),
        "budgets": table_of(BUDGET_COLUMNS, [_budget(budget) for budget in range(5)]),
        "motions": table_of(MOTION_COLUMNS, motions), "worth": worth(table_of(MOTION_COLUMNS, motions), WORLDS),
        "order bias": titled(("method", "spread"), [("IAPB", 4.0)]),
    }  # fmt: skip


def _found(tables: Tables) -> Finding:
    found = finding(tables, [])
    assert not found.failures
    return found


def test_what_is_as_asked_for_is_said_to_be(tables: Tables) -> None:
    found = _found(tables)
    assert {part.verdict for part in found.parts} == {found.verdict} == {REPRODUCED}
    assert "0.05 times MuJoCo's time with box (8 contacts" in found.parts[0].sentence
    assert "600 at d = 3 (60 by the printed formula)" in found.parts[5].sentence
    assert found.timed and not found.parts[-2].timed


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"steps against MuJoCo": _races(0.4)}, "contacts found 60 %"),
        ({"scaling": _times(5.0)}, "5 times as long"),
        ({"solvers": _costs((IAPB, 1e-4), (KERNEL, 1e-6), ("daqp", 3e-5))}, "daqp on the patch at 4 contacts"),
        ({"start": Table(START_COLUMNS, (("iapb --help", 0.9, 0.8, 1, 0.5),))}, "takes 0.90 s of wall time"),
        ({"bodies": _bodies(20, 200, step=lambda n: 1e-3 * n**2, tested=int)}, "power 2.00"),
        ({"bodies": _bodies(20, 200, step=float, tested=lambda n: n * n)}, "tested pairs"),
        ({"order bias": titled(("method", "spread"), [("IAPB", 14.0)])}, "at most 14 % (IAPB)"),
        ({"budgets": table_of(BUDGET_COLUMNS, [_budget(2, gain=1e-16)])}, "gains energy in 1 of 1"),
    ],
)
def test_a_miss_is_called_one(tables: Tables, change: Tables, words: str) -> None:
    missed = [part for part in _found(tables | change).parts if part.verdict == MIXED]
    assert len(missed) == 1 and words in missed[0].sentence
    assert missed[0].miss or "a budget of rows" in missed[0].sentence  # the first page has a clause on it


def test_an_absent_engine_is_named(tables: Tables) -> None:
    first = _found(tables | {"steps against MuJoCo": Table(RACE_COLUMNS, note="mujoco is not installed")}).parts[0]
    assert first.verdict == NOT_COMPUTED and "not installed" in first.sentence


def test_an_error_that_the_truth_cannot_show_is_not_called_an_error(tables: Tables) -> None:
    runs = [*tables["motions"].records(), _run("MuJoCo", 0.2, 1e-9, 50.0, note=f"position, energy {BELOW}")]
    sentence = next(part.sentence for part in _found(tables | {"motions": table_of(MOTION_COLUMNS, runs)}).parts
                    if "Whole motion" in part.sentence)  # fmt: skip
    assert f"MuJoCo {BELOW} of 1.0e-09 in 50 ms per simulated second" in sentence


def test_figures_draw_every_method_and_failure(tables: Tables) -> None:
    inputs = {f"haptic-rate/{name}": table for name, table in tables.items()}
    motions = trajectory_precision.draw(inputs)
    assert [panel.label for panel in motions.panels] == ["", "ball"]
    assert [(name, look.filled) for name, look in motions.legend] == [
        ("IAPB", True), ("PB, stiffened", True), ("MuJoCo", False), ("best for its time", True)]  # fmt: skip
    without = {**inputs, "haptic-rate/motions": tables["motions"].where(outcome="ok")}
    assert motions.panels[1].svg != trajectory_precision.draw(without).panels[1].svg
    assert len(impact_scaling.draw(inputs).panels) == len(anytime.draw(inputs).panels) == 2


def test_what_is_lost_when_time_runs_out_is_said_at_the_curves(tables: Tables) -> None:
    """Half of four rows leave the residual of 0.1 of 0.1 at the start, and half of the energy."""
    drawn = anytime.draw({"haptic-rate/budgets": tables["budgets"]})
    assert len(drawn.panels) == 2 and "4 for 24 contacts" in drawn.caption
    assert "100 to 100 % of the normal velocity" in drawn.caption and "50 to 50 % less energy" in drawn.caption
    assert "None of the 5 budgets of rows created energy" in drawn.caption
    gained = table_of(BUDGET_COLUMNS, [_budget(2, gain=1e-16), *map(_budget, (0, 4))])
    assert "1 of the 3 budgets of rows created energy" in anytime.draw({"haptic-rate/budgets": gained}).caption


def test_the_front_of_effects_is_pareto() -> None:
    rows = [("cheap", True, 10.0, 0.0), ("dear", True, 40.0, 1.0), ("bad", True, 10.0, 2.0), ("off", False, None, None)]
    keys = ("effect", "active", "time saved", "position")
    effects = table_of(EFFECT_COLUMNS, [dict(zip(keys, row, strict=True)) for row in rows])
    table = summary({"scene": effects})
    assert {row["effect"]: row["best of its error"] for row in table.records()} == {
        "cheap": "yes", "dear": "yes", "bad": "no"}  # fmt: skip
    assert len(effect_costs.draw({"effect_costs": table}).panels) == 1


def test_a_time_saved_is_shown_only_beyond_the_noise() -> None:
    """All rounds but the fastest and the slowest must agree on the side of 1."""
    assert saved(Times((0.9, 1.1, 0.9, 0.9, 0.9))) == pytest.approx(10.0)
    assert saved(Times((1.1, 0.9, 1.1, 1.1, 1.1))) == pytest.approx(-10.0)
    assert saved(Times((0.9, 1.1, 0.9, 1.1, 0.9))) is saved(Times((1.0, 1.0, 1.0))) is None


def test_steps_are_shown_with_the_shares_that_exceed_the_noise() -> None:
    keys = ("effect", "active", "step", "all on", "faster than real time", "time saved")
    rows = [("gravity", True, 2.0, 3.0, 500.0, 10.0), ("wall_contacts", True, 2.0, 3.0, 500.0, 40.0),
            ("friction", True, 2.0, 3.0, 500.0, None), ("delay", False, 2.0, 3.0, 500.0, None)]
    noisy = [("gravity", True, 1.0, 1.5, 900.0, None)]
    table = steps({name: table_of(EFFECT_COLUMNS, [dict(zip(keys, row, strict=True)) for row in each])
                   for name, each in (("slow", rows), ("quick", noisy))})  # fmt: skip
    # in the order of the scenes, not of their times: two reports can then be compared row by row
    assert table.rows == (("slow", 3, 2.0, 3.0, 500.0, "wall contacts 40 % (0.8 µs), gravity 10 % (0.2 µs)"),
                          ("quick", 1, 1.0, 1.5, 900.0, "each below the noise"))
    drawn = effect_steps.draw({"effect_steps": table, "machine": "a processor, report of a day"})
    assert "a processor, report of a day" in drawn.caption and "slow 2 µs, with all on 3 µs" in drawn.panels[0].alt
    assert drawn.panels[0].alt.startswith("quick 1 µs")
    assert "wall contacts 40 % (0.8 µs), gravity 10 % (0.2 µs)</text>" in drawn.panels[0].svg


def test_bench_ends_with_1_where_a_row_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    failed = Failure("impact of 4 contacts", "SolverError", "no solution")
    topic = Finding("haptic-rate", "The haptic rate", "", "", NOT_COMPUTED, failures=(failed,))
    monkeypatch.setattr(command, "haptic_study", lambda *_: topic)
    monkeypatch.setattr(command, "work_precision", lambda **_: Table(METHOD_COLUMNS))
    answer = command.bench(False, False, "", 20, 6)
    assert answer.status == 1 and "Not computed: impact of 4 contacts: SolverError: no solution" in answer.lines
    monkeypatch.setattr(command, "haptic_study", lambda *_: replace(topic, failures=()))
    assert command.bench(False, False, "", 20, 6).status == 0


def _table(**errors: tuple[float, ...]) -> Table:
    """Runs whose steps and times fall and grow by a hundred from one to the next; " in a note: below the bound."""
    return table_of(MOTION_COLUMNS, [
        _run(name, 10.0**-k, error, 1.1 * 100.0**k + (name == "late"), note=f"position {BELOW}" if error < 1e-9 else "")
        for name, given in errors.items() for k, error in enumerate(given)])  # fmt: skip


def test_what_a_tenfold_accuracy_costs_and_who_is_never_worth_it() -> None:
    """Error over time with slope −1/2 costs a hundredfold; a method behind another on every scene is on no front."""
    good, late = worth(_table(good=(1e-1, 1e-2, 1e-3), late=(2e-1, 2e-1, 2e-1)), ("good", "late")).records()
    assert good["tenfold accuracy costs"] == pytest.approx(100.0) and good["best for its time"] == 1
    assert late["tenfold accuracy costs"] is None and late["least error"] == 2e-1
    assert late["best for its time"] == 0 and late["error stays"] == 1
    # a fast run is not worth its time if its error is useless
    coarse, fine = worth(_table(coarse=(0.9,), fine=(1.0, 0.95, 0.01)), ("coarse", "fine")).records()
    assert coarse["best for its time"] == 0 and fine["best for its time"] == 1


@pytest.mark.parametrize(("errors", "undecided"), [((9e-1, 3e-1), 1), ((9e-1, 8.9e-1), 0)])
def test_a_method_that_our_limit_of_time_cuts_short_is_not_called_worthless(
    errors: tuple[float, ...], undecided: int
) -> None:
    """Its error still falls where we stop it; where it is level, more time would not help it."""
    runs = [*_table(good=(1e-1, 1e-2, 1e-3), slow=errors).records(), _run("slow", 1e-3, None, 1e9, TIMED_OUT)]
    motions = table_of(MOTION_COLUMNS, [run | {"time": 2.0 * run["time"]} if run["method"] == "slow" else run
                                        for run in runs])  # fmt: skip
    good, slow = worth(motions, ("good", "slow")).records()
    assert (good["cut short"], slow["cut short"], slow["best for its time"]) == (0, undecided, 0)
    [part] = _say_worth({"worth": worth(motions, ("good", "slow"))})
    assert ("lengths: slow." in part.sentence) == (not undecided)
    assert ("not decided, because finer steps would take too long: slow on 1 of 1 scenes" in part.sentence) == undecided


def test_a_motion_on_which_another_world_is_more_exact_is_a_miss() -> None:
    errors = {"IAPB, semi-implicit Euler": (1e-1, 1e-2), "PB, semi-implicit Euler": (1.0,), IDEAL: (1e-1, 5e-3)}
    [part] = _say_motions({"motions": _table(**errors)})
    assert part.verdict == MIXED and "no step of IAPB is as exact as ideal (1.0e-02 against 5.0e-03)" in part.miss
    [part] = _say_motions({"motions": _table(**errors | {IDEAL: (1e-1, 2e-2)})})
    assert part.verdict == REPRODUCED


@pytest.mark.parametrize(("errors", "used", "words"), [
    ((1e-1, 1e-2, 1e-3), (1e-1, 1e-2, 1e-3), "10× costs 100×"),
    ((1e-1, 1e-2, 1e-3, 0.9e-3, 1.1e-3), (1e-1, 1e-2, 1e-3), "10× costs 100×, then level"),
    ((0.9, 1.0, 1e-1, 1e-2), (1.0, 1e-1, 1e-2), "10× costs 100×"),  # the coarse end does not count
    ((1e-1, 1e-2, 1e-3, 1e-10), (1e-1, 1e-2, 1e-3), "10× costs 100×"),  # exact by chance
    ((0.5, 0.48, 0.5), (), "stays at 0.48"),
    # no fit to two runs, nor to three whose errors span less than the tenfold: the measured factors instead
    ((1e-1, 1e-2, 0.9e-2), (1e-1, 1e-2), "10× costs 100× (2 runs), then level"),
    ((8e-1, 4e-1, 1e-1), (8e-1, 4e-1, 1e-1), "8× costs 10000× (3 runs)"),
])
def test_a_fit_takes_the_runs_on_which_the_error_falls(
    errors: tuple[float, ...], used: tuple[float, ...], words: str
) -> None:
    [curve] = curves(_table(good=errors), ("good",))
    assert tuple(run["position"] for run in curve.used) == used and curve.words == words
    assert (curve.cost is None) == (not used or "runs" in words)
    assert sorted(run["position"] for run in curve.runs) == sorted(errors)


@pytest.mark.parametrize(("recipe", "methods"), [(trajectory_precision, WORLDS), (integrator_precision, INTEGRATORS)])
def test_a_number_uses_exactly_the_strong_marks_that_are_drawn(
    recipe: Any, methods: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    strong, pale = [], []

    def noted(self: Plot, points: Any, look: Any, **how: Any) -> None:
        (pale if "alpha" in how else strong).append((look.filled, sorted(points)))

    monkeypatch.setattr(Plot, "marks", noted)
    motions = kept_tables()["haptic-rate/motions"]
    drawn = recipe.draw({"haptic-rate/motions": motions})
    found = curves(motions, methods)
    assert len(found) > 20 and sum(curve.cost is not None for curve in found) > 10
    for curve in found:
        assert curve.cost == tenfold_cost(curve.used)
        compiled = curve.method in INTEGRATORS  # whether a mark is filled says how the method is called
        assert (compiled, sorted((run["time"], run["position"]) for run in curve.used)) in strong
        left = sorted((run["time"], run["position"]) for run in curve.left_out if not by_chance(run))
        assert (compiled, left) in pale
        [panel] = [panel for panel in drawn.panels if panel.label == curve.scene]
        assert f": {curve.words}</text>" in panel.svg
    assert drawn.numbers.rows == worth(motions, methods).rows  # the table in the picture is that of the same runs
    for row in drawn.numbers.records():
        assert ("never worth" in drawn.panels[0].alt.split("best for its time: ")[1 + methods_of(drawn, row)]) == (
            row["best for its time"] == row["cut short"] == 0)  # fmt: skip


def methods_of(drawn: Any, row: Any) -> int:
    """The line of a method in the picture's table."""
    return int(drawn.numbers.column("method").index(row["method"]))


def test_a_report_measures_each_quantity_once_and_quotes_it(
    tables: Tables, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = {name: table for name, table in tables.items() if name not in (RATE, SOLVERS)}
    monkeypatch.setattr("verification.cost.study.measured", lambda *given: iter(own.items()))
    topic = compute(None, "quick", lambda done, total: None)
    assert not {RATE, SOLVERS} & set(topic.tables)
    assert [part.verdict for part in topic.parts].count(NOT_COMPUTED) == 2
    late = [{"method": "factored", "coordinates": 3, "contacts": 600, "late calls": 0}]
    c19 = Finding("C19", "", "", "", REPRODUCED, tables={"C19": table_of(RATE_COLUMNS, late)})
    costs = Finding("complementarity", "", "", "", REPRODUCED, tables={"time per impact": tables[SOLVERS]})
    kernels = kept_tables()["C22/C22"].judged(costs_more)
    c22 = Finding("C22", "", "", "", REPRODUCED, tables={"C22": kernels})
    said = [part for part in quoting(topic, (c19, costs, c22)).parts if "compiled on both sides" in part.sentence]
    slower = sum(row["ratio"] is not None and row["upper quartile"] <= 1 / CLEAR for row in kernels.records())
    assert len(said) == 1 and "claim C22" in said[0].sentence
    assert said[0].miss.startswith(f"compiled, IAPB is slower than Lemke's method in {slower} of ")
    assert quoting(topic, (c19, costs, c22)).tables[KERNELS] is kernels
    whole = quoting(topic, (c19, costs))
    assert whole.tables[SOLVERS] is costs.tables["time per impact"]
    assert whole.tables[RATE].rows == _rate(c19.tables["C19"]).rows
    assert NOT_COMPUTED not in [part.verdict for part in whole.parts]
    assert quoting(replace(topic, tables={}), (c19, costs)).parts == topic.parts


def test_where_a_curve_climbs_fastest_is_found() -> None:
    assert steepest([1, 100, 1000, 10], [1.0, 1e4, 1.0, 10.0]) == (10, 100, pytest.approx(3.0))  # the fall is steeper


def test_the_steepest_range_stands_under_its_method_axis_and_heading() -> None:
    power = {FACTORED: (1.0, 2.0), PRINTED: (0.5, 3.0)}  # over contacts and coordinates, above the smallest size
    sizes = [(12, c) for c in (30, 60, 120)] + [(d, 60) for d in (6, 24)]
    table = table_of(SCALING_COLUMNS, (
        {"method": method, "coordinates": d, "contacts": c, "time": (max(c, 60) / 60) ** a * (d / 12) ** b}
        for method, (a, b) in power.items() for d, c in sizes))
    found = {(row["method"], row["axis"]): (row["steepest from"], row["to"], row["there"])
             for row in fitted(table).records()}
    assert found == {(method, axis): (*ends, pytest.approx(power[method][k])) for method in power
                     for k, (axis, ends) in enumerate({"contacts": (60, 120), "coordinates": (6, 12)}.items())}

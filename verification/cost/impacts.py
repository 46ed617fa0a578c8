"""Error, energy gain and restitution residual of one impact against computing time, and the best method for a budget.

Every method resolves the same nine impacts of a size (`verification.impacts.timed_problems`), compiled or from Python.
Methods that can be stopped early run with several amounts of work. `choose` finds the method for a budget of time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from numbers import Real
from typing import Any

import numpy as np

from iapb import resolve_impact
from iapb.errors import ArgumentError, IapbError, MissingDependencyError
from reference.exact import relative_energy_gain
from reference.one_thread import one_thread
from verification.clock import Times, sampler, seconds, take_turns
from verification.cost.calls import (
    PRINTED,
    Call,
    DaqpCall,
    Floats,
    KernelCall,
    LemkeCall,
    SweepsCall,
    engine_call,
    printed_call,
    random_impact,
)
from verification.finding import Column, Failure, Table, attempt, of_each, table_of
from verification.impacts import ImpactCase, timed_problems

COMPILED, PYTHON = "compiled", "from Python"
IAPB, SWEEPS, LEMKE = "IAPB", "Gauss-Seidel", "Lemke"
CALLED, QP = "IAPB from Python", "DAQP from Python"


@dataclass(frozen=True)
class Way:
    """A method with an amount of work; `make` returns the timed call; `rows` is a row budget, 0 for none."""

    method: str
    work: str
    called: str
    make: Callable[[ImpactCase], Call]
    rows: int = 0


ROWS, REPEATED = (1, 2, 4, 8, 16), (1, 4, 16, 64, 256, 1024)
# To add a method, add a line here.
WAYS: tuple[Way, ...] = (
    *(Way(IAPB, f"{rows} row{'s' * (rows > 1)}", COMPILED, partial(KernelCall, budget=rows), rows)
      for rows in ROWS),
    Way(IAPB, "all rows", COMPILED, KernelCall),
    *(Way(SWEEPS, f"{sweeps} sweep{'s' * (sweeps > 1)}", COMPILED, partial(SweepsCall, sweeps=sweeps))
      for sweeps in REPEATED),
    Way(LEMKE, "all pivots", COMPILED, LemkeCall),
    Way(CALLED, "all rows", PYTHON, engine_call),
    Way(PRINTED, "as printed", PYTHON, printed_call),
    Way(QP, "active set", PYTHON, DaqpCall),
)
METHODS = tuple(dict.fromkeys(way.method for way in WAYS))
SIZES = ((1, 3), (4, 3), (20, 6), (60, 12), (300, 30), (1000, 30))  # (contacts, coordinates)
ROUNDS = 5
LONGEST = 1e-2  # [s] largest time of a call: a slower method is timed once and skips all further impacts
_ENOUGH = 0.02  # [s] spent on one method of one impact; slow methods get fewer rounds
LARGEST = 10_000  # contacts or coordinates of one impact: more would take hours or the whole memory
NO_GAIN = 1e-12  # a relative gain of energy below this is rounding

METHOD_COLUMNS = (
    Column("contacts", condition=True), Column("coordinates", condition=True), Column("problem", condition=True),
    Column("method", condition=True), Column("work", condition=True), Column("called", condition=True),
    Column("time", "µs", timed=True), Column("quartiles", "µs", timed=True), Column("relative error", timed=True),
    Column("relative energy gain", timed=True), Column("restitution residual", timed=True),
    Column("failed after", "µs", timed=True), Column("outcome", timed=True),
)


def work_precision(
    sizes: Iterable[tuple[int, int]] = SIZES, rounds: int = ROUNDS, ways: Sequence[Way] = WAYS,
    progress: Callable[[int, int], None] | None = None, failures: list[Failure] | None = None,
) -> Table:
    """Measure error, energy gain and time of every method on nine impacts of each size.

    Parameters
    ----------
    sizes : (contacts, coordinates) of each size
    rounds : number of times that each method is timed, in random order, each time after a warm-up call
    ways : methods, each with an amount of work
    progress : called as progress(impacts done, number of impacts) after each impact
    failures : receives exceptions other than `IapbError`, which gives a row; if it is None, they propagate

    Returns
    -------
    Table
        One row per impact and way: the median time; |v⁺ − exact v⁺| / |v⁻| in the kinetic metric; the exact
        (KE⁺ − KE⁻)/KE⁻, or 0 for a loss; max |Jᵢv⁺ + e Jᵢv⁻| / (‖Aᵢ‖ |u|). The outcome is "ok", "too slow" (more than
        LONGEST), or "failed" with its reason. A failed row has only the time until the method gave up.
    """
    chosen, records = tuple(sizes), list[dict[str, Any]]()
    slow: set[tuple[str, str]] = set()  # ways that were too slow on an earlier impact
    for number, (contacts, coordinates) in enumerate(chosen):
        problems = timed_problems(contacts, coordinates)
        for done, problem in enumerate(problems, start=1 + number * len(problems)):
            with one_thread():
                found = _measure(problem, [way for way in ways if way.rows < coordinates], slow, rounds, failures)
            records += found
            slow |= {(row["method"], row["work"]) for row in found if row["outcome"] == TOO_SLOW}
            if progress is not None:
                progress(done, len(chosen) * len(problems))
    note = ("Median CPU times of the thread; methods run in random order, with a warm-up call before each. Errors are "
            "relative to exact rational arithmetic, in the kinetic metric. A loss of energy counts as a gain of zero.")
    return table_of(METHOD_COLUMNS, records, digits=3, note=note, timed_rows=True)


TOO_SLOW = "too slow"


def _measure(
    problem: ImpactCase, ways: Sequence[Way], slow: set[tuple[str, str]], rounds: int, failures: list[Failure] | None
) -> list[dict[str, Any]]:
    calls: dict[tuple[str, str], Call] = {}

    def attempted(way: Way) -> tuple[Floats | str, float]:
        try:
            call = calls[way.method, way.work] = way.make(problem)
        except MissingDependencyError as error:
            return str(error), 0.0
        _try(call)  # a method compiles at its first call
        answer: list[Floats | str] = []
        spent = seconds(lambda: answer.append(_try(call)))
        return (answer[0] if isinstance(answer[0], str) else answer[0].copy()), spent

    tried = {(way.method, way.work): attempt(f"{problem.label}, {way.method}, {way.work}", partial(attempted, way),
                                             failures) for way in ways if (way.method, way.work) not in slow}
    answers = {key: found for key, found in tried.items() if found is not None}
    working = {key: sampler(calls[key]) for key, (answer, spent) in answers.items()
               if not isinstance(answer, str) and spent < LONGEST}
    times = take_turns(working, rounds, warm=False, enough=_ENOUGH)
    rows = []
    for way in ways:
        key = way.method, way.work
        if key not in answers and key not in slow:
            continue
        answer, spent = answers.get(key, ("", LONGEST))
        row = {"contacts": problem.contacts, "coordinates": problem.coordinates, "problem": problem.label,
               "method": way.method, "work": way.work, "called": way.called}
        if key in slow:
            row |= {"outcome": TOO_SLOW, "failed after": 1e6 * LONGEST}
        elif isinstance(answer, str):
            row |= {"outcome": f"failed: {answer}", "failed after": 1e6 * spent}
        elif spent >= LONGEST:
            row |= {"outcome": TOO_SLOW, "failed after": 1e6 * spent}
        else:
            row |= {"outcome": "ok", **_timing(times[key]), **_quality(problem, answer)}
        rows.append(row)
    return rows


def _try(call: Call) -> Floats | str:
    """Return v⁺, or the reason why the call gives no v⁺."""
    try:
        v_plus = call()
    except IapbError as error:
        return str(error)
    return v_plus if np.all(np.isfinite(v_plus)) else "the velocity is not finite"


def _timing(times: Times) -> dict[str, Any]:
    return {"time": 1e6 * times.median, "quartiles": f"{times.lower * 1e6:.3g} to {times.upper * 1e6:.3g}"}


def _quality(problem: ImpactCase, v_plus: Floats) -> dict[str, float | None]:
    lower = np.linalg.cholesky(problem.mass_matrix)
    speed = float(np.linalg.norm(lower.T @ problem.velocity))
    error = np.array([float(Fraction(x) - t) for x, t in zip(v_plus.tolist(), problem.truth, strict=True)])
    gain = relative_energy_gain(problem.mass_matrix, problem.velocity, v_plus)
    found = {
        "relative error": float(np.linalg.norm(lower.T @ error)) / speed,
        "relative energy gain": max(gain, 0.0),  # a loss with e < 1 is correct, so it is no error
        "restitution residual": _residual(problem, v_plus),
    }
    return {name: value if math.isfinite(value) else None for name, value in found.items()}


def _residual(case: ImpactCase, v_plus: Floats) -> float:
    """Return max |Jᵢv⁺ + e Jᵢv⁻| / (‖Aᵢ‖ |u|)."""
    mass, J, v = case.arrays
    lower = np.linalg.cholesky(mass)
    scale = np.linalg.norm(np.linalg.solve(lower, J.T), axis=0) * np.linalg.norm(lower.T @ v)
    return float(np.max(np.abs(J @ v_plus + case.restitution * (J @ v)) / scale))


@dataclass(frozen=True)
class Choice:
    """The best method for a budget of time at one size of impact, and its results at that size.

    Attributes
    ----------
    budget : time for one impact [s].  contacts, coordinates : the size.  method, work, called : the way to choose.
    time : its median time [s].
    error : median relative error of v⁺ over the impacts that end in time without a gain of energy.
    largest : the largest of these errors.
    share : share of the impacts that end in time without a gain of energy.
    solved : share of the impacts that also have an error of at most SOLVED.
    """

    budget: float
    contacts: int
    coordinates: int
    method: str
    work: str
    called: str
    time: float
    error: float
    largest: float
    share: float
    solved: float

    @property
    def enough(self) -> bool:
        """Whether the method solves at least half of the impacts."""
        return self.solved >= 0.5

    @property
    def how(self) -> str:
        """The method in words, with the amount of work after which it stops."""
        return f"{self.method}, stopped after {self.work}" if self.work.split()[0].isdigit() else self.method

    def __str__(self) -> str:
        called = " (compiled)" if self.called == COMPILED else ""
        use = "use" if self.enough else f"no method solves half of the hard cases to {SOLVED:g}; the nearest is"
        return (f"With {short_time(self.budget)} for {self.contacts} contacts on {self.coordinates} coordinates, {use} "
                f"{self.how}{called}: {short_time(self.time)} an impact, relative error of the "
                f"velocity {self.error:.0e} (largest {self.largest:.0e}); {100 * self.share:.0f} % of the hard cases "
                "end in time without a gain of energy.")


BUDGETS = (5e-7, 5e-6, 5e-5, 5e-4, 5e-3)  # [s]
_EQUAL = 1e-9  # errors below this count as equal: the faster method is taken
_MOST = 0.99  # a larger share of solved impacts than this counts as no better
SOLVED = 1e-3  # relative error below which an impact counts as solved


def choose(measured: Table, budget: float, contacts: int, coordinates: int, called: str = COMPILED) -> Choice | None:
    """Return the best way for a budget [s] at a measured size; None if no way answers in time without an energy gain.

    The best way solves the most of the nine impacts in time. Among equals it answers the most impacts in time; then it
    has the least largest error, where errors below 1e-9 count as equal; then it is the fastest. Ways that solve less
    than half of the impacts count as equal in the first criterion, and their `enough` is False.
    """
    found: list[Choice] = []
    for rows in by_way(measured.where(contacts=contacts, coordinates=coordinates, called=called)).values():
        good = [row for row in rows if row["outcome"] == "ok" and row["time"] <= 1e6 * budget
                and row["relative energy gain"] <= NO_GAIN]
        if good:
            errors = [row["relative error"] for row in good]
            found.append(Choice(
                budget, contacts, coordinates, good[0]["method"], good[0]["work"], called,
                1e-6 * float(np.median([row["time"] for row in good])), float(np.median(errors)), max(errors),
                len(good) / len(rows), sum(error <= SOLVED for error in errors) / len(rows)))
    return min(found, key=lambda one: (-min(one.solved, _MOST) * one.enough, -min(one.share, _MOST),
                                       max(one.largest, _EQUAL), one.time), default=None)


def by_way(measured: Table) -> dict[tuple[str, str], list[dict[str, Any]]]:
    """Return the rows of each method and amount of work."""
    ways: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for row in measured.records():
        ways.setdefault((row["method"], row["work"]), []).append(row)
    return ways


def which_method(budget: float, contacts: int, coordinates: int, rounds: int = ROUNDS) -> tuple[Choice, ...]:
    """Measure one size of impact on this machine and return the best method, compiled and from Python.

    Parameters
    ----------
    budget : time for one impact [s].
    contacts, coordinates : the size of the impact.
    rounds : number of times that each way is timed, in random order; the median counts.

    Returns
    -------
    tuple of Choice
        The best compiled method and the best method called from Python; without those that have no way in time.

    Raises
    ------
    ArgumentError
        A budget or size that is not positive, or a size above LARGEST.
    """
    if isinstance(budget, bool) or not isinstance(budget, Real) or not 0.0 < budget < math.inf:
        raise ArgumentError("budget", budget, "a finite number of seconds above 0")
    for name, value in (("contacts", contacts), ("coordinates", coordinates), ("rounds", rounds)):
        if isinstance(value, bool) or not isinstance(value, int | np.integer) or not 1 <= value <= LARGEST:
            raise ArgumentError(name, value, f"a whole number from 1 to {LARGEST:,}")
    measured = work_precision([(contacts, coordinates)], rounds)
    found = (choose(measured, budget, contacts, coordinates, called) for called in (COMPILED, PYTHON))
    return tuple(choice for choice in found if choice is not None)


def short_time(seconds_: float) -> str:
    """Return a time as text, for example 0.5 µs, 50 µs or 5 ms."""
    return f"{1e3 * seconds_:.2g} ms" if seconds_ >= 1e-3 else f"{1e6 * seconds_:.3g} µs"


CHOICE_COLUMNS = (
    Column("contacts", condition=True), Column("coordinates", condition=True), Column("budget", "µs", condition=True),
    Column("method", timed=True), Column("work", timed=True), Column("time", "µs", timed=True),
    Column("error", timed=True), Column("largest error", timed=True), Column("share solved", "%", timed=True),
    Column("nearest", timed=True), Column("from Python", timed=True),
)


def choices(measured: Table) -> Table:
    """Return the result of `choose` for every measured size and every budget."""
    records: list[dict[str, Any]] = []
    for contacts, coordinates in dict.fromkeys(measured.select(("contacts", "coordinates")).rows):
        for budget in BUDGETS:
            best = choose(measured, budget, contacts, coordinates)
            python = choose(measured, budget, contacts, coordinates, PYTHON)
            records.append({
                "contacts": contacts, "coordinates": coordinates, "budget": 1e6 * budget, "method": "none",
                "from Python": f"{python.method}, {short_time(python.time)}" if python and python.enough else "none",
                **(_told(best) if best else {})})
    return table_of(CHOICE_COLUMNS, records, digits=2, note=(
        f"Compiled methods; the last column is for calls from Python. None: nothing solves half of the nine impacts to "
        f"{SOLVED:g} in time; then the nearest method, and its largest error."))


def _told(best: Choice) -> dict[str, Any]:
    if not best.enough:
        return {"nearest": f"{best.method}, {best.work}: {best.largest:.1g}"}
    return {"method": best.method, "work": best.work, "time": 1e6 * best.time, "error": best.error,
            "largest error": best.largest, "share solved": 100.0 * best.solved}


def lost_to_rivals(measured: Table, called: str = COMPILED) -> Table:
    """Return the impacts on which a complementarity solver is faster than IAPB at the same error or 1e-6.

    Both are compiled, or both are called from Python; there IAPB checks its arguments, and DAQP does not.
    """
    records: list[dict[str, Any]] = []
    rows = measured.where(called=called, outcome="ok").records()
    name = IAPB if called == COMPILED else CALLED
    ours = {(row["contacts"], row["problem"]): row for row in rows
            if row["method"] == name and row["work"] == "all rows"}
    for row in rows:
        if row["method"] in (IAPB, CALLED, PRINTED):
            continue
        mine = ours[row["contacts"], row["problem"]]
        good = row["relative error"] <= max(1e-6, mine["relative error"]) and row["relative energy gain"] <= NO_GAIN
        if good and row["time"] < mine["time"]:
            records.append({"contacts": row["contacts"], "problem": row["problem"], "solver": row["method"],
                            "work": row["work"], "time": row["time"], "IAPB": mine["time"],
                            "ratio": mine["time"] / row["time"]})
    return table_of((Column("contacts", condition=True), Column("problem", condition=True),
                     Column("solver", condition=True), Column("work", condition=True), Column("time", "µs", timed=True),
                     Column("IAPB", "µs", timed=True), Column("ratio", timed=True)), records, digits=3, timed_rows=True)


def order_bias(contacts: int = 4, coordinates: int = 3, rounds: int = 25) -> Table:
    """Time each method right after each other method; with a fair clock the times do not depend on the order."""
    problem = timed_problems(contacts, coordinates)[4]
    calls: dict[str, Call] = {}
    for way in WAYS:
        with suppress(MissingDependencyError):
            calls[way.method] = way.make(problem)
    timers = {method: sampler(call) for method, call in calls.items()}

    def after(before: str, method: str) -> float:
        calls[before]()
        return timers[method]()

    pairs = [(before, method) for before in calls for method in calls if before != method]
    times = take_turns({pair: partial(after, *pair) for pair in pairs}, rounds)
    records = []
    for method in calls:
        samples = np.array([times[before, method].samples for before in calls if before != method])
        middles = np.median(samples / np.median(samples, axis=0), axis=1)  # a slowdown affects a whole round
        medians = dict(zip((before for before in calls if before != method),
                           (1e6 * float(np.median(samples)) * middles).tolist(), strict=True))
        slowest, fastest = max(medians, key=lambda name: medians[name]), min(medians, key=lambda name: medians[name])
        records.append({"method": method, "least": medians[fastest], "after": fastest, "most": medians[slowest],
                        "then after": slowest, "spread": 100.0 * (medians[slowest] / medians[fastest] - 1.0)})
    columns = (Column("method", condition=True), Column("least", "µs", timed=True), Column("after", timed=True),
               Column("most", "µs", timed=True), Column("then after", timed=True), Column("spread", "%", timed=True))
    note = (f"{contacts} contacts, {coordinates} coordinates; median of {rounds} rounds, relative to the median of "
            "each round. Least and most: the methods timed just before.")  # fmt: skip
    return table_of(columns, records, digits=3, note=note)


TRUNCATED = ((6, 24), (12, 60), (30, 120))  # (d, c), rows of rank two thirds of d
BUDGET_COLUMNS = (
    Column("coordinates", condition=True),
    Column("contacts", condition=True),
    Column("rank", condition=True),
    Column("budget", "rows", condition=True),
    Column("median residual"),
    Column("largest residual"),
    Column("share of the loss"),
    Column("largest relative gain"),
)


def anytime(
    impacts: int = 40, progress: Callable[[int, int], None] | None = None, failures: list[Failure] | None = None
) -> Table:
    """Resolve random plastic impacts with every row budget from 0 to the rank."""
    records: list[dict[str, Any]] = []
    for done, (d, c) in enumerate(TRUNCATED, start=1):
        cases = [random_impact(d, c, np.random.default_rng([0, d, c, k]), 0.0) for k in range(impacts)]
        records += of_each(range((cases[0].rank or 0) + 1), partial(_stopped, cases), failures,
                           lambda budget, d=d, c=c: f"budget of {budget} rows, d = {d}, c = {c}")  # type: ignore[misc]  # fmt: skip
        if progress is not None:
            progress(done, len(TRUNCATED))
    return table_of(BUDGET_COLUMNS, records, digits=3,
                    note="Residual: max |J v⁺ + e J v⁻| in the kinetic metric, of |v⁻|.")  # fmt: skip


def _stopped(cases: list[ImpactCase], budget: int) -> list[dict[str, Any]]:
    residuals, gains, lost = [], [], []
    for case in cases:
        mass, rows, v = case.arrays
        v_plus = resolve_impact(mass, rows, v, 0.0, budget=budget).velocity
        full = resolve_impact(mass, rows, v, 0.0).velocity
        residuals.append(_residual(case, v_plus))
        gains.append(relative_energy_gain(mass, v, v_plus))
        before, after, least = (0.5 * float(w @ mass @ w) for w in (v, v_plus, full))
        lost.append((before - after) / (before - least))
    return [{"coordinates": case.coordinates, "contacts": case.contacts, "rank": case.rank, "budget": budget,
             "median residual": float(np.median(residuals)), "largest residual": max(residuals),
             "share of the loss": float(np.median(lost)), "largest relative gain": max(gains)}]  # fmt: skip

"""What a microsecond buys at one impact: error, energy and restitution against time, and what a budget of rows buys."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from iapb import resolve_impact
from iapb.errors import IapbError
from reference.exact import relative_energy_gain
from reference.one_thread import one_thread
from verification.clock import Times, seconds, take_turns
from verification.cost.calls import Call, Floats, engine_call, random_impact, solver_call
from verification.finding import Column, Failure, Table, attempt, of_each, table_of
from verification.impacts import ImpactCase, timed_problems

_solver = partial(solver_call, needs_answer=True)
METHODS: dict[str, Callable[[ImpactCase], Call]] = {
    "factored": partial(engine_call, method="factored"),
    "gram_pinv": partial(engine_call, method="gram_pinv"),
    "gram_cholesky": partial(engine_call, method="gram_cholesky"),
    "damped": partial(engine_call, method="damped"),
    "svd": partial(engine_call, method="svd"),
    # complementarity: pivoting, sweeps, active sets, proximal, and an interior point modelled by cvxpy
    "lemke LCP": partial(_solver, name="lemke"),
    "gauss_seidel LCP": partial(_solver, name="gauss_seidel"),
    "daqp QP": partial(_solver, name="daqp"),
    "quadprog QP": partial(_solver, name="quadprog"),
    "proxqp QP": partial(_solver, name="proxqp"),
    "cvxpy QP": partial(_solver, name="cvxpy_clarabel"),
    # the anytime form: what a budget of rows buys
    "factored, 1 row": partial(engine_call, method="factored", budget=1),
    "factored, 2 rows": partial(engine_call, method="factored", budget=2),
    "factored, 4 rows": partial(engine_call, method="factored", budget=4),
}
ROUNDS = 30
_ENOUGH = 0.5  # seconds spent on one method of one problem; slow methods get fewer rounds

METHOD_COLUMNS = (
    Column("method", condition=True),
    Column("problem", condition=True),
    Column("time", "µs", timed=True),
    Column("quartiles", "µs", timed=True),
    Column("relative error"),
    Column("relative energy gain"),
    Column("restitution residual"),
    Column("failed after", "µs", timed=True),
    Column("outcome"),
)


def work_precision(
    problems: Iterable[ImpactCase] | None = None,
    methods: Iterable[str] | None = None,
    rounds: int = ROUNDS,
    progress: Callable[[int, int], None] | None = None,
    failures: list[Failure] | None = None,
) -> Table:
    """Measure error, energy gain and time of every method on every problem, methods in turn.

    Parameters
    ----------
    problems : by default `timed_problems()`, which know their exact answers
    methods : names of impact methods, by default all
    rounds : how often each is timed
    progress : called with (problems done, problems) after each
    failures : receives what raises anything but an `IapbError`, which is a row; without it that passes through

    Returns
    -------
    Table
        one row per problem and method: the median time; |v⁺ − exact v⁺| / |v⁻| in the kinetic metric;
        (KE⁺ − KE⁻)/KE⁻ exactly, 0 for a loss; max |Jᵢv⁺ + e Jᵢv⁻| / (‖Aᵢ‖ |u|). The outcome is "ok", or "failed"
        with its reason, and then the time until the method gave up is all there is.
    """
    chosen = timed_problems() if problems is None else tuple(problems)
    names = tuple(METHODS if methods is None else methods)
    records: list[dict[str, Any]] = []
    for done, problem in enumerate(chosen, start=1):
        with one_thread():
            records += _measure(problem, names, rounds, failures)
        if progress is not None:
            progress(done, len(chosen))
    note = ("Medians of warm calls from Python, in turn; errors against exact rational arithmetic, in the kinetic "
            "metric. A negative gain is a loss and is drawn as none.")  # fmt: skip
    return table_of(METHOD_COLUMNS, records, digits=3, note=note)


def _measure(
    problem: ImpactCase, names: tuple[str, ...], rounds: int, failures: list[Failure] | None
) -> list[dict[str, Any]]:
    calls: dict[str, Call] = {}

    def attempted(name: str) -> Floats | str:
        calls[name] = METHODS[name](problem)
        return _try(calls[name])

    tried = {name: attempt(f"{problem.label}, {name}", partial(attempted, name), failures) for name in names}
    answers = {name: answer for name, answer in tried.items() if answer is not None}  # trying them warms up, too
    working = {name: partial(seconds, calls[name]) for name, answer in answers.items() if not isinstance(answer, str)}
    times = take_turns(working, rounds, warm=False, enough=_ENOUGH)
    return [
        {"method": name, "problem": problem.label} | (
            {"outcome": f"failed: {answer}", "failed after": 1e6 * seconds(partial(_try, calls[name]))}
            if isinstance(answer, str) else {"outcome": "ok", **_timing(times[name]), **_quality(problem, answer)})
        for name, answer in answers.items()
    ]  # fmt: skip


def _try(call: Call) -> Floats | str:
    """v⁺, or the reason why there is none."""
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
        "relative energy gain": max(gain, 0.0),  # what e < 1 takes by right is no error
        "restitution residual": _residual(problem, v_plus),
    }
    return {name: value if math.isfinite(value) else None for name, value in found.items()}


def _residual(case: ImpactCase, v_plus: Floats) -> float:
    """max |Jᵢv⁺ + e Jᵢv⁻| / (‖Aᵢ‖ |u|)."""
    mass, J, v = case.arrays
    lower = np.linalg.cholesky(mass)
    scale = np.linalg.norm(np.linalg.solve(lower, J.T), axis=0) * np.linalg.norm(lower.T @ v)
    return float(np.max(np.abs(J @ v_plus + case.restitution * (J @ v)) / scale))


SIZES = ((6, 24), (12, 60), (30, 120))  # (d, c), rows of rank two thirds of d
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
    """Resolve random plastic impacts with every budget from 0 rows to the rank."""
    records: list[dict[str, Any]] = []
    for done, (d, c) in enumerate(SIZES, start=1):
        cases = [random_impact(d, c, np.random.default_rng([0, d, c, k]), 0.0) for k in range(impacts)]
        records += of_each(range((cases[0].rank or 0) + 1), partial(_stopped, cases), failures,
                           lambda budget, d=d, c=c: f"budget of {budget} rows, d = {d}, c = {c}")  # type: ignore[misc]  # fmt: skip
        if progress is not None:
            progress(done, len(SIZES))
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

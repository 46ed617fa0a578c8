"""Measure error, energy gain and restitution against time: warm, interleaved, one thread, medians with quartiles."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from fractions import Fraction
from functools import partial

import numpy as np

from iapb import resolve_impact
from iapb.errors import IapbError, SolverError
from reference.complementarity import ImpactProblem, solve
from reference.exact import relative_energy_gain
from reference.one_thread import one_thread
from verification.finding import Failure, attempt
from verification.impacts import Floats, ImpactCase, timed_problems

TimedMethod = Callable[[ImpactCase], Floats]


def _engine(method: str, budget: int | None = None) -> TimedMethod:
    def call(problem: ImpactCase) -> Floats:
        return resolve_impact(*problem.arrays, problem.restitution, method=method, budget=budget).velocity

    return call


def _solver(name: str) -> TimedMethod:
    """The impact as a complementarity problem in p ≥ 0, made and solved anew at each call."""

    def call(problem: ImpactCase) -> Floats:
        solution = solve(ImpactProblem.from_impact(*problem.arrays, problem.restitution), name)
        if solution.impulse is None:
            raise SolverError(f"{name} gave no impulse: {solution.note}")
        return solution.velocity_plus

    return call


METHODS: dict[str, TimedMethod] = {
    "factored": _engine("factored"),
    "gram_pinv": _engine("gram_pinv"),
    "gram_cholesky": _engine("gram_cholesky"),
    "damped": _engine("damped"),
    "svd": _engine("svd"),
    # complementarity: pivoting, sweeps, active sets, proximal, and an interior point modelled by cvxpy
    "lemke LCP": _solver("lemke"),
    "gauss_seidel LCP": _solver("gauss_seidel"),
    "daqp QP": _solver("daqp"),
    "quadprog QP": _solver("quadprog"),
    "proxqp QP": _solver("proxqp"),
    "cvxpy QP": _solver("cvxpy_clarabel"),
    # the anytime form: what a budget of rows buys
    "factored, 1 row": _engine("factored", 1),
    "factored, 2 rows": _engine("factored", 2),
    "factored, 4 rows": _engine("factored", 4),
}


ROUNDS = 30
_ENOUGH = 0.5  # seconds spent on one method of one problem; slow methods get fewer rounds, never less than three
_LEAST_ROUNDS = 3


@dataclass(frozen=True)
class Quartiles:
    """Median and quartiles of the time of one call [s], over `rounds` calls."""

    lower: float
    median: float
    upper: float
    rounds: int


@dataclass(frozen=True)
class Measurement:
    """One method on one problem.

    Attributes
    ----------
    status : "ok", or "failed" with the reason in `note`; the numbers of a failure are NaN.
    forward_error : |v⁺ − exact v⁺| / |v⁻| in the kinetic metric.
    energy_gain : (KE⁺ − KE⁻)/KE⁻ exactly; negative is a loss.
    restitution_residual : max |Jᵢv⁺ + e Jᵢv⁻| / (‖Aᵢ‖ |u|).
    failed_after : seconds until a failure was given up, warm; NaN for what worked.
    """

    family: str
    label: str
    coordinates: int
    contacts: int
    mass_condition: float
    closeness: float
    method: str
    status: str
    note: str
    forward_error: float
    energy_gain: float
    restitution_residual: float
    seconds: Quartiles
    failed_after: float = np.nan


def work_precision(
    problems: Iterable[ImpactCase] | None = None,
    methods: Iterable[str] | None = None,
    rounds: int = ROUNDS,
    progress: Callable[[int, int], None] | None = None,
    failures: list[Failure] | None = None,
) -> tuple[Measurement, ...]:
    """Measure error, energy gain and time of every method on every problem, methods interleaved.

    Parameters
    ----------
    problems : by default `timed_problems()`, which know their exact answers
    methods : names of impact methods, by default all
    rounds : how often each is timed
    progress : called with (problems done, problems) after each
    failures : receives what raises anything but an `IapbError`, which is a record; without it that passes through

    Returns
    -------
    tuple of Measurement
        one record per problem and method, for a work-precision figure and its table.
    """
    chosen = timed_problems() if problems is None else tuple(problems)
    names = tuple(METHODS if methods is None else methods)
    records: list[Measurement] = []
    for done, problem in enumerate(chosen, start=1):
        with one_thread():
            records.extend(_measure(problem, names, rounds, failures))
        if progress is not None:
            progress(done, len(chosen))
    return tuple(records)


def _measure(
    problem: ImpactCase, names: tuple[str, ...], rounds: int, failures: list[Failure] | None
) -> list[Measurement]:
    tried = {name: attempt(f"{problem.label}, {name}", partial(_try, name, problem), failures) for name in names}
    answers = {name: answer for name, answer in tried.items() if answer is not None}  # trying them warms up, too
    working = [name for name, answer in answers.items() if not isinstance(answer, str)]
    times = _interleaved(problem, working, rounds)
    return [_record(problem, name, answer, times.get(name, [])) for name, answer in answers.items()]


def _seconds_to_fail(name: str, problem: ImpactCase) -> float:
    started = time.perf_counter()
    _try(name, problem)
    return time.perf_counter() - started


def _try(name: str, problem: ImpactCase) -> Floats | str:
    """v⁺, or the reason why there is none."""
    try:
        v_plus = METHODS[name](problem)
    except IapbError as error:
        return str(error)
    return v_plus if np.all(np.isfinite(v_plus)) else "the velocity is not finite"


def _interleaved(problem: ImpactCase, names: list[str], rounds: int) -> dict[str, list[float]]:
    """Times of each method, one call of every method per round: a slow minute of the machine hits all alike.

    Each round starts with another method, since the one that follows a large solver finds its caches cold.
    """
    times: dict[str, list[float]] = {name: [] for name in names}
    for turn in range(rounds):
        first = turn % len(names) if names else 0
        for name in names[first:] + names[:first]:
            spent = times[name]
            if len(spent) >= _LEAST_ROUNDS and sum(spent) > _ENOUGH:
                continue
            started = time.perf_counter()
            METHODS[name](problem)
            spent.append(time.perf_counter() - started)
    return times


def _record(problem: ImpactCase, name: str, answer: Floats | str, times: list[float]) -> Measurement:
    failed = isinstance(answer, str)
    error, gain, residual = (np.nan, np.nan, np.nan) if isinstance(answer, str) else _quality(problem, answer)
    lower, median, upper = np.percentile(times, [25, 50, 75]) if times else (np.nan, np.nan, np.nan)
    return Measurement(
        problem.family,
        problem.label,
        problem.coordinates,
        problem.contacts,
        problem.mass_condition,
        problem.closeness,
        name,
        "failed" if failed else "ok",
        str(answer) if failed else "",
        error,
        gain,
        residual,
        Quartiles(float(lower), float(median), float(upper), len(times)),
        _seconds_to_fail(name, problem) if failed else np.nan,
    )


def _quality(problem: ImpactCase, v_plus: Floats) -> tuple[float, float, float]:
    """Forward error, energy gain and restitution residual."""
    lower = np.linalg.cholesky(problem.mass_matrix)
    speed = float(np.linalg.norm(lower.T @ problem.velocity))
    error = np.array([float(Fraction(x) - t) for x, t in zip(v_plus.tolist(), problem.truth, strict=True)])
    J = problem.contact_jacobian
    unmet = np.abs(J @ v_plus + problem.restitution * (J @ problem.velocity))
    scale = np.linalg.norm(np.linalg.solve(lower, J.T), axis=0) * speed
    gain = relative_energy_gain(problem.mass_matrix, problem.velocity, v_plus)
    return float(np.linalg.norm(lower.T @ error)) / speed, gain, float(np.max(unmet / scale))

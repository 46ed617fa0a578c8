"""The methods that are measured, as functions problem -> v⁺. To add one: a line in METHODS."""

from __future__ import annotations

from collections.abc import Callable

from iapb.errors import SolverError
from verification.cost.problems import Floats, TimedProblem

TimedMethod = Callable[[TimedProblem], Floats]


def _engine(method: str, budget: int | None = None) -> TimedMethod:
    def call(problem: TimedProblem) -> Floats:
        from iapb import resolve_impact

        given = problem.mass_matrix, problem.contact_jacobian, problem.velocity, problem.restitution
        return resolve_impact(*given, method=method, budget=budget).velocity

    return call


def _solver(name: str) -> TimedMethod:
    """The impact as a complementarity problem in p ≥ 0, made and solved anew at each call."""

    def call(problem: TimedProblem) -> Floats:
        from reference.complementarity import ImpactProblem, solve

        given = problem.mass_matrix, problem.contact_jacobian, problem.velocity, problem.restitution
        solution = solve(ImpactProblem.from_impact(*given), name)
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

"""The timed calls that resolve one impact from M, J, v to v⁺; kernels are repeated in compiled code."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb import resolve_impact
from iapb.compiled import block, kernel
from iapb.contact.kernels.impact import factored_impact, make_impact_work, rank_tolerance
from iapb.errors import MissingDependencyError, SolverError
from iapb.mechanics.kernels.cholesky import cholesky, from_whitened, to_whitened
from reference.complementarity import ImpactProblem, solve
from reference.complementarity.solvers.lemke import import_lcp_lemke
from verification.impacts import ImpactCase

PRINTED = "printed formula (numpy)"
Floats = NDArray[Any]
Call = Callable[[], Floats]


def random_impact(d: int, c: int, rng: np.random.Generator, restitution: float = 0.5) -> ImpactCase:
    """Return a random impact with c rows, whose rank is two thirds of d (or c, if this is less)."""
    rank = max(1, (2 * d) // 3)
    root, rows = rng.normal(size=(d, d)), rng.normal(size=(c, rank)) @ rng.normal(size=(rank, d))
    return ImpactCase(root @ root.T + np.eye(d), rows, rng.normal(size=d), restitution, rank=rank)


def engine_call(case: ImpactCase, method: str, budget: int | None = None) -> Call:
    """Return a call of `resolve_impact` with a method; it includes the checks of the arguments."""
    return lambda: resolve_impact(*case.arrays, case.restitution, method=method, budget=budget).velocity


def printed_call(case: ImpactCase) -> Call:
    """Return a call of formula (21) as printed, in numpy."""
    mass, rows, v = case.arrays

    def call() -> Floats:
        solved = np.linalg.solve(mass, rows.T)
        return v - (1.0 + case.restitution) * (solved @ (np.linalg.pinv(rows @ solved) @ (rows @ v)))

    return call


@kernel
def repeat_impact(  # type: ignore[no-untyped-def]
    mass_matrix, lower, v, restitution, columns, budget, work, v_plus, momentum, times
):
    """Repeat `times` times: factor M, copy the rows and resolve the impact with at most `budget` rows."""
    d, count = columns.shape
    for _ in range(times):
        cholesky(mass_matrix, lower)
        for k in range(d):
            for i in range(count):
                work.columns[k, i] = columns[k, i]
        factored_impact(mass_matrix, lower, v, restitution, count, rank_tolerance(lower), budget, True, work,
                        v_plus, momentum)


class KernelCall:
    """The engine's kernel on arrays that are allocated once; each call factors M and copies the rows."""

    def __init__(self, case: ImpactCase, budget: int | None = None) -> None:
        self.mass, self.v = np.ascontiguousarray(case.mass_matrix), case.velocity.copy()
        self.columns, self.restitution = np.ascontiguousarray(case.contact_jacobian.T), case.restitution
        d, c = len(self.v), case.contacts
        self.budget = d if budget is None else budget
        self.lower, self.v_plus, self.momentum = np.zeros((d, d)), np.zeros(d), np.zeros(d)
        self.work = block(make_impact_work(d, c))

    def repeated(self, times: int) -> None:
        """Resolve the impact `times` times."""
        repeat_impact(self.mass, self.lower, self.v, self.restitution, self.columns, self.budget, self.work,
                      self.v_plus, self.momentum, times)

    def __call__(self) -> Floats:
        """Return v⁺ (d,)."""
        self.repeated(1)
        return self.v_plus


@kernel
def repeat_sweeps(  # type: ignore[no-untyped-def]
    mass_matrix, lower, v, restitution, rows, sweeps, whitened, share, impulses, v_plus, times
):
    """Solve Newton's LCP `times` times by sweeps of projected Gauss-Seidel over the contacts, as physics engines do.

    It forms no Delassus matrix: each contact reads u and corrects it. `whitened` is A (c, d); `share` holds the squared
    lengths of its rows.
    """
    c, d = rows.shape
    for _ in range(times):
        cholesky(mass_matrix, lower)
        to_whitened(lower, v, v_plus)
        for i in range(c):
            impulses[i] = share[i] = 0.0
            for k in range(d):
                rest = rows[i, k]
                for m in range(k):
                    rest -= lower[k, m] * whitened[i, m]
                whitened[i, k] = rest / lower[k, k]
                share[i] += whitened[i, k] * whitened[i, k]
        for i in range(c):  # the velocity that each contact should have afterwards
            impulses[c + i] = 0.0
            for k in range(d):
                impulses[c + i] -= restitution * rows[i, k] * v[k]
        for _sweep in range(sweeps):
            for i in range(c):
                if share[i] == 0.0:
                    continue
                closing = -impulses[c + i]
                for k in range(d):
                    closing += whitened[i, k] * v_plus[k]
                wanted = max(0.0, impulses[i] - closing / share[i])
                change = wanted - impulses[i]
                impulses[i] = wanted
                for k in range(d):
                    v_plus[k] += change * whitened[i, k]
        from_whitened(lower, v_plus, v_plus)


class SweepsCall:
    """The kernel of projected Gauss-Seidel on arrays that are allocated once."""

    def __init__(self, case: ImpactCase, sweeps: int) -> None:
        mass, rows, v = (np.ascontiguousarray(array) for array in case.arrays)
        c, d = rows.shape
        self.v_plus = np.zeros(d)
        self.given = (mass, np.zeros((d, d)), v, case.restitution, rows, sweeps, np.zeros((c, d)), np.zeros(c),
                      np.zeros(2 * c), self.v_plus)

    def repeated(self, times: int) -> None:
        """Resolve the impact `times` times."""
        repeat_sweeps(*self.given, times)

    def __call__(self) -> Floats:
        """Return v⁺ (d,)."""
        self.repeated(1)
        return self.v_plus


class LemkeCall:
    """The kernel of Lemke's method on the arrays of a case."""

    def __init__(self, case: ImpactCase) -> None:
        try:
            import_lcp_lemke()
        except ImportError as error:
            raise MissingDependencyError("quantecon", "Lemke kernel", "pip install quantecon") from error
        self.case = case

    def repeated(self, times: int) -> Floats:
        """Resolve the impact `times` times; return v⁺ (d,) of the last time."""
        from verification.cost.lemke_kernel import repeat_lemke  # brings quantecon

        found: Floats = repeat_lemke(*self.case.arrays, self.case.restitution, times)
        return found

    def __call__(self) -> Floats:
        """Return v⁺ (d,)."""
        return self.repeated(1)


def solver_call(case: ImpactCase, name: str, needs_answer: bool = False) -> Call:
    """Return a call that poses the impact as a complementarity problem in p ≥ 0 and solves it with a solver by name.

    If the solver returns no impulse, v⁺ is NaN; with `needs_answer` the call raises SolverError instead.
    """

    def call() -> Floats:
        solution = solve(ImpactProblem.from_impact(*case.arrays, case.restitution), name)
        if needs_answer and solution.impulse is None:
            raise SolverError(f"{name} gave no impulse: {solution.note}")
        return solution.velocity_plus

    return call

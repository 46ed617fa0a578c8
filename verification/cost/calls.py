"""The timed calls that resolve one impact from M, J, v to v⁺; kernels are repeated in compiled code."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb import resolve_impact
from iapb.compiled import block, kernel
from iapb.contact.kernels.impact import ImpactWork, factored_impact, rank_tolerance
from iapb.errors import MissingDependencyError, SolverError
from iapb.linalg import cholesky, from_whitened, to_whitened
from iapb.schema import zeros_of
from reference.complementarity import ImpactProblem, solve
from reference.complementarity.solvers.lemke import import_lcp_lemke
from verification.impacts import ImpactCase
from verification.methods import gram_pinv

PRINTED = "printed formula (numpy)"
Floats = NDArray[Any]
Call = Callable[[], Floats]


def random_impact(d: int, c: int, rng: np.random.Generator, restitution: float = 0.5) -> ImpactCase:
    """Return a random impact with c rows, whose rank is two thirds of d (or c, if this is less)."""
    rank = max(1, (2 * d) // 3)
    root, rows = rng.normal(size=(d, d)), rng.normal(size=(c, rank)) @ rng.normal(size=(rank, d))
    return ImpactCase(root @ root.T + np.eye(d), rows, rng.normal(size=d), restitution, rank=rank)


def engine_call(case: ImpactCase) -> Call:
    """Return a call of `resolve_impact`; it includes the checks of the arguments."""
    return lambda: resolve_impact(*case.arrays, case.restitution).velocity


def printed_call(case: ImpactCase) -> Call:
    """Return a call of formula (21) as printed, in numpy."""
    return partial(gram_pinv, *case.arrays, case.restitution)


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
        self.work = block(zeros_of(ImpactWork, velocity=d, row=c))

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


@kernel
def pose_velocity_form(mass_matrix, lower, rows, v, restitution, unit, least):  # type: ignore[no-untyped-def]
    """Write unit rows of A (c, d) and bounds b (c,) of  min ½|x|², A x ≥ b  with |b| ≤ 1; return the scale of b.

    x is the change of u = Lᵀ v, divided by the scale.
    """
    c, d = rows.shape
    cholesky(mass_matrix, lower)
    scale = 0.0
    for i in range(c):
        square = speed = 0.0
        for k in range(d):
            rest = rows[i, k]
            for m in range(k):
                rest -= lower[k, m] * unit[i, m]
            unit[i, k] = rest / lower[k, k]
            square += unit[i, k] * unit[i, k]
            speed += rows[i, k] * v[k]
        length = math.sqrt(square) if square > 0.0 else 1.0
        for k in range(d):
            unit[i, k] /= length
        least[i] = -(1.0 + restitution) * speed / length
        scale = max(scale, abs(least[i]))
    if scale == 0.0:
        scale = 1.0
    for i in range(c):
        least[i] /= scale
    return scale


DAQP_TOLERANCE = 1e-11  # 1e-13 makes daqp cycle on 9 of the 54 hard impacts, 1e-12 on 2; this one solves all


class DaqpCall:
    """Newton's LCP by DAQP, without checks: compiled code poses the problem, Python calls only the solver.

    `solver_call` also checks the arguments and forms W, and takes several times as long.
    """

    def __init__(self, case: ImpactCase) -> None:
        try:
            import daqp
        except ImportError as error:
            raise MissingDependencyError("daqp", "DAQP", "pip install 'iapb[reference]'") from error
        mass, rows, v = (np.ascontiguousarray(array) for array in case.arrays)
        c, d = rows.shape
        self.solve, self.v, self.lower, self.change = daqp.solve, v, np.zeros((d, d)), np.zeros(d)
        self.unit, self.least = np.zeros((c, d)), np.zeros(c)
        self.given = (mass, self.lower, rows, v, case.restitution, self.unit, self.least)
        self.form = np.eye(d), np.zeros(d), self.unit, np.full(c, 1e30), self.least, np.zeros(c, np.int32)

    def __call__(self) -> Floats:
        """Return v⁺ (d,)."""
        scale = pose_velocity_form(*self.given)
        x, _, flag, _ = self.solve(*self.form, primal_tol=DAQP_TOLERANCE, dual_tol=DAQP_TOLERANCE)
        if flag < 1:
            raise SolverError(f"daqp: exit flag {flag}")
        from_whitened(self.lower, x, self.change)
        return self.v + scale * self.change


def solver_call(case: ImpactCase, name: str) -> Call:
    """Return a call that poses the impact as a complementarity problem in p ≥ 0 and solves it with a solver by name.

    It includes the checks of the arguments and W. If the solver returns no impulse, v⁺ is NaN.
    """

    def call() -> Floats:
        return solve(ImpactProblem.from_impact(*case.arrays, case.restitution), name).velocity_plus

    return call

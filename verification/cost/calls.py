"""The timed calls that resolve one impact from M, J, v to v⁺; kernels are repeated in compiled
code."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np

from iapb import resolve_impact
from iapb.contact.kernels.impact import ImpactWork, factored_impacts
from iapb.errors import SolverError, name_the_extra
from iapb.numerics.compiled import block
from iapb.numerics.schema import zeros_of
from reference.complementarity import ImpactProblem, solve
from verification.impacts import ImpactCase
from verification.methods import gram_pinv

PRINTED = "printed formula (numpy)"
Call = Callable[[], Any]  # returns v⁺ (d,)


def engine_call(case: ImpactCase) -> Call:
    """Return a call of `resolve_impact`; it includes the checks of the arguments."""
    return lambda: resolve_impact(*case.arrays, case.restitution).velocity


def printed_call(case: ImpactCase) -> Call:
    """Return a call of formula (21) as printed, in numpy."""
    return partial(gram_pinv, *case.arrays, case.restitution)


def solver_call(case: ImpactCase, name: str) -> Call:
    """Return a call that poses the impact as a complementarity problem in p ≥ 0 and solves it with
    a solver by name.

    It includes the checks of the arguments and W. If the solver returns no impulse, v⁺ is NaN.
    """
    return lambda: (
        solve(ImpactProblem.from_impact(*case.arrays, case.restitution), name).velocity_plus
    )


@dataclass(frozen=True)
class KernelCall:
    """Compiled code that resolves an impact a number of times, and the v⁺ (d,) that it writes."""

    repeated: Callable[[int], Any]
    v_plus: Any

    def __call__(self) -> Any:
        """Return v⁺ (d,)."""
        self.repeated(1)
        return self.v_plus


def kernel_call(case: ImpactCase, budget: int | None = None) -> KernelCall:
    """Return a call of the engine's kernel with at most `budget` rows; it factors M and copies the
    rows."""
    mass, rows, v = map(np.ascontiguousarray, case.arrays)
    c, d = rows.shape
    work = block(zeros_of(ImpactWork, velocity=d, row=c))
    v_plus = np.zeros(d)
    clamps = np.zeros(1)
    most = d if budget is None else budget
    given = mass[None], rows.T[None].copy(), v[None], np.array([case.restitution]), most, True

    def repeat(times: int) -> None:
        factored_impacts(*given, times, work, v_plus[None], clamps)

    return KernelCall(repeat, v_plus)


def sweeps_call(case: ImpactCase, sweeps: int) -> KernelCall:
    """Return a call of projected Gauss-Seidel."""
    mass, rows, v = map(np.ascontiguousarray, case.arrays)
    c, d = rows.shape
    given = mass, np.zeros((d, d)), v, case.restitution, rows, sweeps
    scratch = (np.zeros((c, d)), np.zeros(c), np.zeros(c), np.zeros(c))
    v_plus = np.zeros(d)
    return KernelCall(partial(kernels().repeat_sweeps, *given, *scratch, v_plus), v_plus)


def lemke_call(case: ImpactCase) -> KernelCall:
    """Return a call of Lemke's method; v⁺ is NaN if it fails."""
    v_plus = np.zeros(case.coordinates)
    given = *case.arrays, case.restitution
    return KernelCall(partial(kernels().repeat_lemke, *given, v_plus), v_plus)


def kernels() -> Any:
    """Return the module of solvers that numba compiles; to import it takes a second."""
    try:
        return import_module("verification.cost.kernels")
    except ModuleNotFoundError as error:
        raise name_the_extra(error, "Lemke kernel") from error


DAQP_TOLERANCE = (
    1e-11  # 1e-13 makes daqp cycle on 9 of the 54 hard impacts, 1e-12 on 2; this one solves all
)


def daqp_call(case: ImpactCase) -> Call:
    """Return a call of DAQP without checks: compiled code poses the problem, Python calls only the
    solver.

    `solver_call` also checks the arguments and forms W, and takes several times as long.
    """
    try:
        import daqp
    except ModuleNotFoundError as error:
        raise name_the_extra(error, "DAQP") from error
    mass, rows, v = map(np.ascontiguousarray, case.arrays)
    c, d = rows.shape
    lower = np.zeros((d, d))
    unit = np.zeros((c, d))
    least = np.zeros(c)
    compiled = kernels()
    form = np.eye(d), np.zeros(d), unit, np.full(c, 1e30), least, np.zeros(c, np.int32)

    def call() -> Any:
        scale = compiled.pose_velocity_form(mass, lower, rows, v, case.restitution, unit, least)
        x, _, flag, _ = daqp.solve(*form, primal_tol=DAQP_TOLERANCE, dual_tol=DAQP_TOLERANCE)
        if flag < 1:
            raise SolverError(f"daqp: exit flag {flag}")
        v_plus = np.empty(d)
        compiled.velocity_of_form(lower, x, scale, v, v_plus)
        return v_plus

    return call

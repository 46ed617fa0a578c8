"""The timed calls that resolve one impact from M, J, v to v⁺; kernels are repeated in compiled
code."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from iapb import resolve_impact
from iapb.compiled import block, copy_into, kernel
from iapb.contact.kernels.impact import ImpactWork, factored_impact, rank_tolerance, whiten_impact
from iapb.errors import MissingDependencyError, SolverError, installing
from iapb.linalg import add_multiple, cholesky, dot_of, from_whitened, to_whitened
from iapb.schema import zeros_of
from reference.complementarity import ImpactProblem, solve
from reference.complementarity.solvers.lemke import import_lcp_lemke
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
    """A kernel on arrays that are allocated once; its last arguments are v⁺ (d,) and how often it
    resolves."""

    kernel: Callable[..., Any]
    given: tuple[Any, ...]
    v_plus: Any

    def repeated(self, times: int) -> None:
        """Resolve the impact `times` times."""
        self.kernel(*self.given, self.v_plus, times)

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
    work.mass[:], work.v[:] = mass, v
    return KernelCall(
        repeat_impact,
        (case.restitution, np.ascontiguousarray(rows.T), d if budget is None else budget, work),
        np.zeros(d),
    )


def sweeps_call(case: ImpactCase, sweeps: int) -> KernelCall:
    """Return a call of projected Gauss-Seidel."""
    mass, rows, v = map(np.ascontiguousarray, case.arrays)
    c, d = rows.shape
    return KernelCall(
        repeat_sweeps,
        (
            mass,
            np.zeros((d, d)),
            v,
            case.restitution,
            rows,
            sweeps,
            np.zeros((c, d)),
            np.zeros(c),
            np.zeros(c),
            np.zeros(c),
        ),
        np.zeros(d),
    )


def lemke_call(case: ImpactCase) -> KernelCall:
    """Return a call of Lemke's method; v⁺ is NaN if it fails."""
    try:
        import_lcp_lemke()
    except ImportError as error:
        raise MissingDependencyError(
            "quantecon", "Lemke kernel", installing("reference")
        ) from error
    from verification.cost.lemke_kernel import repeat_lemke  # brings quantecon

    return KernelCall(repeat_lemke, (*case.arrays, case.restitution), np.zeros(case.coordinates))


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
    except ImportError as error:
        raise MissingDependencyError("daqp", "DAQP", installing("reference")) from error
    mass, rows, v = map(np.ascontiguousarray, case.arrays)
    c, d = rows.shape
    lower, change, unit, least = np.zeros((d, d)), np.zeros(d), np.zeros((c, d)), np.zeros(c)
    form = np.eye(d), np.zeros(d), unit, np.full(c, 1e30), least, np.zeros(c, np.int32)

    def call() -> Any:
        scale = pose_velocity_form(mass, lower, rows, v, case.restitution, unit, least)
        x, _, flag, _ = daqp.solve(*form, primal_tol=DAQP_TOLERANCE, dual_tol=DAQP_TOLERANCE)
        if flag < 1:
            raise SolverError(f"daqp: exit flag {flag}")
        from_whitened(lower, x, change)
        return np.array(v + scale * change)

    return call


@kernel
def repeat_impact(restitution, columns, budget, work, v_plus, times):  # type: ignore[no-untyped-def]
    """Repeat `times` times: factor M, copy the rows and resolve the impact with at most `budget`
    rows."""
    d, count = columns.shape
    for _ in range(times):
        cholesky(work.mass, work.lower)
        for k in range(d):
            for i in range(count):
                work.columns[k, i] = columns[k, i]
        whiten_impact(d, count, work)
        factored_impact(d, count, restitution, rank_tolerance(work.lower), budget, True, work)
    copy_into(v_plus, work.v_plus)


@kernel
def whiten_rows(lower, rows, whitened, square):  # type: ignore[no-untyped-def]
    """Write A = J L⁻ᵀ (c, d), row by row, and the squared lengths of its rows (c,)."""
    for i in range(rows.shape[0]):
        for k in range(rows.shape[1]):
            whitened[i, k] = (rows[i, k] - dot_of(lower[k], whitened[i, :k])) / lower[k, k]
        square[i] = dot_of(whitened[i], whitened[i])


@kernel
def repeat_sweeps(  # type: ignore[no-untyped-def]
    mass_matrix,
    lower,
    v,
    restitution,
    rows,
    sweeps,
    whitened,
    share,
    impulses,
    wanted,
    v_plus,
    times,
):
    """Solve Newton's LCP `times` times by sweeps of projected Gauss-Seidel over the contacts, as
    physics engines do.

    It forms no Delassus matrix: each contact reads u and corrects it. `whitened` is A (c, d);
    `share` holds the squared lengths of its rows, `wanted` the velocity that each contact should
    have afterwards.
    """
    for _ in range(times):
        cholesky(mass_matrix, lower)
        to_whitened(lower, v, v_plus)
        whiten_rows(lower, rows, whitened, share)
        for i in range(rows.shape[0]):
            impulses[i] = 0.0
            wanted[i] = -restitution * dot_of(rows[i], v)
        for _sweep in range(sweeps):
            for i in range(rows.shape[0]):
                if share[i] > 0.0:
                    impulse = max(
                        0.0, impulses[i] - (dot_of(whitened[i], v_plus) - wanted[i]) / share[i]
                    )
                    add_multiple(v_plus, impulse - impulses[i], whitened[i])
                    impulses[i] = impulse
        from_whitened(lower, v_plus, v_plus)


@kernel
def pose_velocity_form(mass_matrix, lower, rows, v, restitution, unit, least):  # type: ignore[no-untyped-def]
    """Write unit rows of A (c, d) and bounds b (c,) of  min ½|x|², A x ≥ b  with |b| ≤ 1; return
    the scale of b.

    x is the change of u = Lᵀ v, divided by the scale.
    """
    cholesky(mass_matrix, lower)
    whiten_rows(lower, rows, unit, least)
    scale = 0.0
    for i in range(rows.shape[0]):
        length = math.sqrt(least[i]) if least[i] > 0.0 else 1.0
        for k in range(rows.shape[1]):
            unit[i, k] /= length
        least[i] = -(1.0 + restitution) * dot_of(rows[i], v) / length
        scale = max(scale, abs(least[i]))
    if scale == 0.0:
        scale = 1.0
    for i in range(rows.shape[0]):
        least[i] /= scale
    return scale

"""The impact methods that `resolve_impact` offers, all on a checked and scaled `ImpactInput`."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.contact.impact_problem import ImpactInput
from iapb.contact.kernels.impact import (
    ImpactWork,
    apply_change,
    apply_projected_change,
    factored_impact,
    make_impact_work,
    rank_tolerance,
)
from iapb.contact.kernels.projector import minimum_norm_impulses, unit_columns
from iapb.contact.kernels.unilateral import make_push_work, poisson_impact
from iapb.dense import product, solve
from iapb.errors import ArgumentError, SolverError
from iapb.mechanics.kernels.cholesky import to_whitened, whiten_columns

Floats = NDArray[np.float64]

PINV_CUTOFF = 1e-15  # numpy's classical default, the "as printed" reading of (20)
DAMPING = 1e-8  # λ as a share of the largest diagonal entry of W: half of the digits


class Whitened(NamedTuple):
    """Answer of one method, in scaled coordinates."""

    v_plus: Floats
    momentum: Floats
    impulses: Floats
    rank: int
    clamp: float
    complete: bool = True  # False where the budget ended the work with rows left


class Method(NamedTuple):
    """A method: its solver (problem, row budget, clamped, tolerance) and whether it clamps by default."""

    solve: Callable[[ImpactInput, int, bool, float | None], Whitened]
    clamped: bool


def _prepared(problem: ImpactInput) -> ImpactWork:
    work = make_impact_work(problem.coordinates, max(1, problem.contacts))
    work.columns[:, : problem.contacts] = problem.contact_jacobian.T
    return work


def _whitened_rows(problem: ImpactInput, work: ImpactWork) -> Floats:
    """Unit rows of A = J L⁻ᵀ; fills work.u, work.rows and work.length as `factored_impact` would."""
    to_whitened(problem.lower, problem.velocity, work.u)
    whiten_columns(problem.lower, work.columns, problem.contacts)
    unit_columns(work.columns, problem.contacts, work.length)
    work.rows[:] = work.columns
    return work.rows[:, : problem.contacts].T


def _tolerance(problem: ImpactInput, given: float | None) -> float:
    return float(rank_tolerance(problem.lower)) if given is None else float(given)


def factored(problem: ImpactInput, budget: int, clamped: bool, tolerance: float | None) -> Whitened:
    """(21) through an orthonormal basis of A's row space (design: factored form)."""
    work, d, c = _prepared(problem), problem.coordinates, problem.contacts
    v_plus, momentum, share = np.empty(d), np.empty(d), _tolerance(problem, tolerance)
    rank, clamp = factored_impact(problem.mass_matrix, problem.lower, problem.velocity, problem.restitution, c,
                                  share, budget, clamped, work, v_plus, momentum)
    ended_early = rank == budget < d and bool((work.size[:c] > share * share).any())
    return Whitened(v_plus, momentum, _least_norm(problem, work, rank), rank, clamp, not ended_early)


def _least_norm(problem: ImpactInput, work: ImpactWork, rank: int) -> Floats:
    """The p of least norm along the *caller's* rows with Aᵀp = Δu, in scaled rows p' = 2^−r p.

    Where row sizes differ, the least norm of p is found first, and what its rounding leaves of Δu is added by the
    least norm of p', which no difference of sizes harms.
    """
    c, size = problem.contacts, _row_size(problem)
    impulses = size * _least_norm_of(work, work.length[:c] * size, rank, work.change)
    if (size == 1.0).all():
        return impulses
    left = work.change - product(work.rows[:, :c] * work.length[:c], impulses)
    return impulses + _least_norm_of(work, work.length[:c], rank, left)


def _row_size(problem: ImpactInput) -> Floats:
    """2^−r (c,), largest 1: the caller's rows are these multiples of the scaled ones, up to one common factor."""
    present = problem.contact_jacobian.any(axis=1)
    least = np.min(problem.row_exponent, where=present, initial=np.iinfo(np.int32).max)
    exponent = np.where(present, least - problem.row_exponent, 0)
    return np.ldexp(1.0, np.maximum(exponent, -1000))  # below 2^-1000 a row is as good as absent


def _least_norm_of(work: ImpactWork, length: Floats, rank: int, change: Floats) -> Floats:
    d, c = len(change), len(length)
    impulses = np.zeros(c)
    minimum_norm_impulses(work.rows, length, c, work.basis, rank, change, impulses, work.columns, np.empty((d, d)),
                          np.empty(d))
    return impulses


def _from_impulses(problem: ImpactInput, impulses: NDArray[np.floating], rank: int, clamped: bool) -> Whitened:
    """v⁺ = v⁻ + M⁻¹Jᵀp as (9) says, for a method that computes p first."""
    work, d = _prepared(problem), problem.coordinates
    rows = _whitened_rows(problem, work)
    v_plus, momentum = np.empty(d), np.empty(d)
    work.change[:] = product((rows * work.length[: problem.contacts, None]).T, impulses)
    clamp = apply_change(problem.mass_matrix, problem.lower, problem.velocity, clamped, work, v_plus, momentum)
    return Whitened(v_plus, momentum, clamp * impulses, rank, clamp)


def _delassus(problem: ImpactInput, size: float | Floats = 1.0) -> tuple[Floats, Floats]:
    """W = J M⁻¹ Jᵀ and γ⁻ = J v⁻, of the scaled rows times `size`; by LAPACK."""
    J = problem.contact_jacobian * np.reshape(size, (-1, 1))
    return J @ np.linalg.solve(problem.mass_matrix, J.T), J @ problem.velocity


def gram_pinv(problem: ImpactInput, budget: int, clamped: bool, tolerance: float | None) -> Whitened:
    """(20)-(21) to the letter: p = −(1 + e) W† J v⁻ with numpy's pseudo-inverse, on rows of the caller's size.

    A comparison: LAPACK's last bits, which W's condition number amplifies, depend on the processor.
    """
    if problem.contacts == 0:
        return factored(problem, 0, clamped, tolerance)
    size = _row_size(problem)
    W, gamma = _delassus(problem, size)
    cutoff = PINV_CUTOFF if tolerance is None else tolerance
    singular_values = np.linalg.svd(W, compute_uv=False)
    rank = int(np.sum(singular_values > cutoff * singular_values[0]))
    impulses = -(1.0 + problem.restitution) * size * (np.linalg.pinv(W, rcond=cutoff) @ gamma)
    return _from_impulses(problem, impulses, rank, clamped)


def gram_cholesky(problem: ImpactInput, budget: int, clamped: bool, tolerance: float | None) -> Whitened:
    """(19): p = −(1 + e) W⁻¹ J v⁻ by Cholesky, for independent rows.

    A comparison: by LAPACK, whose last bits depend on the processor.
    """
    if problem.contacts == 0:
        return factored(problem, 0, clamped, tolerance)
    W, gamma = _delassus(problem)
    unit = W / np.sqrt(np.outer(np.diag(W), np.diag(W))) if np.all(np.diag(W) > 0.0) else np.zeros_like(W)
    smallest = float(np.linalg.eigvalsh(0.5 * (unit + unit.T))[0])
    # A Gram matrix of unit rows knows its smallest eigenvalue to c·ε only: below that the rows count as dependent.
    if smallest <= problem.contacts * np.finfo(float).eps * 8:
        raise ArgumentError("contact_jacobian", problem.contact_jacobian.shape,
                            "independent rows for method 'gram_cholesky'; use 'factored' for dependent ones")
    factor = np.linalg.cholesky(0.5 * (W + W.T))  # of rows of like size: definite, as the test above shows
    half = np.linalg.solve(factor, gamma)
    impulses = -(1.0 + problem.restitution) * np.linalg.solve(factor.T, half)
    return _from_impulses(problem, impulses, problem.contacts, clamped)


def damped(problem: ImpactInput, budget: int, clamped: bool, tolerance: float | None) -> Whitened:
    """p = −(1 + e)(W + λI)⁻¹ J v⁻: every mode keeps some of its approach, none gains energy."""
    if problem.contacts == 0:
        return factored(problem, 0, clamped, tolerance)
    work = _prepared(problem)
    rows = _whitened_rows(problem, work) * work.length[: problem.contacts, None]
    W, gamma = product(rows, rows.T), product(problem.contact_jacobian, problem.velocity)
    share = DAMPING if tolerance is None else tolerance
    regular = W + share * max(float(np.max(np.diag(W))), float(np.finfo(float).tiny)) * np.eye(len(W))
    impulses = -(1.0 + problem.restitution) * solve(regular, gamma)
    return _from_impulses(problem, impulses, problem.contacts, clamped)


def svd(problem: ImpactInput, budget: int, clamped: bool, tolerance: float | None) -> Whitened:
    """(21) with the projector from the truncated singular value decomposition of unit-scaled A.

    A comparison: by LAPACK, whose last bits depend on the processor.
    """
    work, d = _prepared(problem), problem.coordinates
    rows = _whitened_rows(problem, work)
    v_plus, momentum = np.empty(d), np.empty(d)
    _, singular_values, right = np.linalg.svd(rows, full_matrices=False)
    rank = int(np.sum(singular_values > _tolerance(problem, tolerance)))
    work.basis[:rank] = right[:rank]
    work.change[:] = -(1.0 + problem.restitution) * (right[:rank].T @ (right[:rank] @ work.u))
    clamp = apply_projected_change(problem.mass_matrix, problem.lower, problem.velocity, rank, clamped, work, v_plus,
                                   momentum)
    return Whitened(v_plus, momentum, _least_norm(problem, work, rank), rank, clamp)


def poisson(problem: ImpactInput, budget: int, clamped: bool, tolerance: float | None) -> Whitened:
    """Poisson's law for unequal restitution, by two LCPs (compression, restitution)."""
    work, d, c = _prepared(problem), problem.coordinates, problem.contacts
    v_plus, momentum, impulses = np.empty(d), np.empty(d), np.zeros(c)
    rank, clamp = poisson_impact(problem.mass_matrix, problem.lower, problem.velocity, problem.unequal, c, clamped,
                                 work, make_push_work(d, c), impulses, v_plus, momentum)
    if rank < 0:
        raise SolverError(f"Poisson's law: the active-set method did not converge on {c} contacts")
    return Whitened(v_plus, momentum, impulses, rank, clamp)

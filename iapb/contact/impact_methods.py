"""Checks and power-of-two scaling of an impact, and the methods that `resolve_impact` offers."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from numbers import Real
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.compiled import block
from iapb.contact.kernels import border
from iapb.contact.kernels.border import (
    least_norm_impulses,
    make_border_work,
    row_sizes,
    scale_impact,
    unscale_impact,
)
from iapb.contact.kernels.impact import apply_change, apply_projected_change, rank_tolerance
from iapb.contact.kernels.projector import unit_columns
from iapb.contact.kernels.unilateral import make_push_work, poisson_impact
from iapb.errors import ArgumentError, RangeError, SolverError
from iapb.linalg import product, solve, to_whitened, whiten_columns

Floats = NDArray[np.float64]
Exponents = NDArray[np.int64]
_DOUBLE = np.dtype(np.float64)
_PLURAL = {"mass_matrix": "mass_matrices", "contact_jacobian": "contact_jacobians", "velocity": "velocities"}


class Given(NamedTuple):
    """An impact in the caller's units: arrays of real numbers whose shapes agree."""

    mass_matrix: Floats  # (d, d)
    contact_jacobian: Floats  # (c, d)
    velocity: Floats  # (d,)
    restitution: float
    unequal: Floats | None  # (c,) where restitution differs between contacts


@dataclass(frozen=True)
class ImpactInput:
    """A checked impact in scaled coordinates v' = 2^−(s + k) v, M' = 2^(s + s) M, rows J' = 2^(s + r) J."""

    mass_matrix: Floats  # (d, d) scaled, symmetric to rounding
    lower: Floats  # (d, d) its Cholesky factor
    contact_jacobian: Floats  # (c, d) scaled
    velocity: Floats  # (d,) scaled
    restitution: float
    unequal: Floats | None  # (c,) where restitution differs between contacts
    coordinate_exponent: Exponents  # s (d,)
    row_exponent: Exponents  # r (c,)
    velocity_exponent: int  # k
    underflows: bool  # entries of v are so far apart that scaling rounds the small ones
    given: Given
    work: Any  # the block of `iapb.contact.kernels.border.BorderWork` that holds all this

    @property
    def coordinates(self) -> int:
        """Number of coordinates d."""
        return len(self.velocity)

    @property
    def contacts(self) -> int:
        """Number of contacts c."""
        return len(self.contact_jacobian)


def check_input(mass_matrix: ArrayLike, contact_jacobian: ArrayLike, velocity: ArrayLike,
                restitution: ArrayLike) -> ImpactInput:
    """Check shapes, finiteness, symmetry and definiteness, then scale; an ArgumentError names the wrong argument."""
    return scaled(as_given(mass_matrix, contact_jacobian, velocity, restitution))


def scaled(given: Given) -> ImpactInput:
    """Check the numbers of an impact and scale it."""
    work = block(make_border_work(len(given.velocity), len(given.contact_jacobian)))
    wrong = scale_impact(given.mass_matrix, given.contact_jacobian, given.velocity, work)
    if wrong[0]:
        raise refusal(wrong, given)
    return ImpactInput(
        mass_matrix=work.mass, lower=work.lower, contact_jacobian=np.ascontiguousarray(work.rows.T),
        velocity=work.velocity, restitution=given.restitution, unequal=given.unequal,
        coordinate_exponent=work.coordinate_exponent, row_exponent=work.row_exponent,
        velocity_exponent=int(work.velocity_exponent[0]), underflows=bool(work.underflows[0]), given=given, work=work)


class Outcome(NamedTuple):
    """An impact in the caller's units; it is exactly passive if it is clamped."""

    velocity: Floats
    momentum: Floats
    impulses: Floats
    energy_change: float
    energy_interval: tuple[float, float]
    factor: float  # scales the impulses; below 1 if rounding in the caller's units required a shorter step


def outcome(problem: ImpactInput, v_plus: Floats, momentum: Floats, impulses: Floats, clamped: bool) -> Outcome:
    """Undo the scaling; clamp the step again if this rounding raised the energy."""
    work, given = problem.work, problem.given
    work.v_plus[:], work.momentum[:], work.impulses[:] = v_plus, momentum, impulses
    results = np.empty(problem.coordinates), np.empty(problem.coordinates), np.empty(problem.contacts)
    factor, energies = unscale_impact(given.mass_matrix, given.velocity, clamped, work, *results)
    return Outcome(*results, energies[0], energies[1:], factor)


def as_given(mass_matrix: ArrayLike, contact_jacobian: ArrayLike, velocity: ArrayLike,
             restitution: ArrayLike) -> Given:
    """Check types, shapes and the range of e."""
    M = _array("mass_matrix", mass_matrix, 2)
    d = len(M)
    if d == 0 or M.shape != (d, d):
        raise ArgumentError("mass_matrix", M.shape, "a square matrix with at least one row")
    v = _array("velocity", velocity, 1)
    if v.shape != (d,):
        raise ArgumentError("velocity", v.shape, f"shape ({d},), one entry per row of mass_matrix")
    J = np.zeros((0, d)) if _is_empty(contact_jacobian) else _array("contact_jacobian", contact_jacobian, 2)
    if J.shape[1] != d:
        raise ArgumentError("contact_jacobian", J.shape, f"shape (contacts, {d})")
    return Given(M, J, v, *_checked_restitution(restitution, len(J)))


def stacked(mass_matrices: ArrayLike, contact_jacobians: ArrayLike, velocities: ArrayLike,
            restitution: ArrayLike) -> tuple[Floats, Floats, Floats, Floats]:
    """Check types, shapes and the range of e of n impacts; e becomes (n,)."""
    M, v = _array("mass_matrices", mass_matrices, 3), _array("velocities", velocities, 2)
    n, d = v.shape
    if d == 0 or M.shape != (n, d, d):
        raise ArgumentError("mass_matrices", M.shape, f"shape ({n}, {d}, {d}), one matrix per line of velocities")
    J = np.zeros((n, 0, d)) if _is_empty(contact_jacobians) else _array("contact_jacobians", contact_jacobians, 3)
    if J.shape[0] != n or J.shape[2] != d:
        raise ArgumentError("contact_jacobians", J.shape, f"shape ({n}, contacts, {d})")
    e = real_numbers(restitution)
    if e is None or e.shape not in ((), (n,)):
        raise ArgumentError("restitution", restitution, f"a real number or shape ({n},), one per impact")
    values = np.atleast_1d(e.astype(np.float64))
    wrong = np.flatnonzero(~((values >= -1.0) & (values <= 1.0)))
    if len(wrong):
        raise ArgumentError(f"restitution[{wrong[0]}]" if e.ndim else "restitution", float(values[wrong[0]]),
                            "a number in [-1, 1]")
    return M, J, v, np.ascontiguousarray(np.broadcast_to(values, n))


def refusal(wrong: tuple[int, int, int], given: Given, which: tuple[int, ...] = (),
            method: str = "factored") -> ArgumentError | RangeError:
    """Return the error for the fault that the kernel found; `which` : (number of the impact,), if there are several."""
    reason, i, j = wrong

    def name(argument: str, *place: int) -> str:
        place = (*which, *place)
        argument = _PLURAL.get(argument, argument) if which else argument
        return f"{argument}[{', '.join(map(str, place))}]" if place else argument

    M, J, v = given.mass_matrix, given.contact_jacobian, given.velocity
    entry, found = name("mass_matrix", i, j), float(M[i, j]) if reason <= border.ASYMMETRIC and i < len(M) > j else 0.0
    if reason == border.MASS_NOT_FINITE:
        return ArgumentError(entry, found, "a finite number")
    if reason == border.VELOCITY_NOT_FINITE:
        return ArgumentError(name("velocity", i), float(v[i]), "a finite number")
    if reason == border.ROWS_NOT_FINITE:
        return ArgumentError(name("contact_jacobian", i, j), float(J[i, j]), "a finite number")
    if reason == border.DIAGONAL:
        return ArgumentError(entry, found, "a positive diagonal entry")
    if reason == border.ENTRY:
        return ArgumentError(entry, found, "a positive definite matrix")
    if reason == border.ASYMMETRIC:
        return ArgumentError(entry, found, f"a symmetric matrix; entry [{j}, {i}] is {float(M[j, i])!r}")
    if reason == border.NOT_DEFINITE:
        return ArgumentError(name("mass_matrix"), M,
                             f"a positive definite matrix (pivot {i} of Cholesky is not positive)")
    if reason == border.ENERGY_RANGE:
        return RangeError(name("energy_change"), "the kinetic energy of these magnitudes is above 1.8e308")
    quantity = {border.VELOCITY_RANGE: "velocity", border.MOMENTUM_RANGE: "generalized_impulse",
                border.IMPULSE_RANGE: "impulses"}[reason]
    return RangeError(name(quantity), f"the {method} impact of these magnitudes is above 1.8e308")


def _is_empty(rows: ArrayLike) -> bool:
    """Return whether there are no rows: [] and zeros(0) have no second dimension to check."""
    if type(rows) is np.ndarray and rows.ndim >= 2:
        return False
    given = real_numbers(rows)
    return given is not None and given.shape == (0,)


def real_numbers(value: Any) -> NDArray[Any] | None:
    """Return the value as an array; None for strings, truth values, time spans, complex numbers and masked arrays."""
    try:
        given = np.asarray(value)
    except (TypeError, ValueError):
        return None
    if isinstance(value, np.ma.MaskedArray):
        return None
    if given.dtype.kind == "O":
        return given if all(isinstance(x, Real) and not isinstance(x, bool) for x in given.flat) else None
    return given if given.dtype.kind in "fiu" else None


def _array(name: str, value: Any, dimensions: int) -> Floats:
    """Return a contiguous array of doubles, without a check that they are finite."""
    if type(value) is np.ndarray and value.dtype is _DOUBLE and value.ndim == dimensions and value.flags.carray:
        return value
    given = real_numbers(value)
    if given is None:
        raise ArgumentError(name, value, "an array of real numbers")
    try:
        array = given.astype(np.float64, copy=False)
    except OverflowError:
        raise ArgumentError(name, value, "an array of finite numbers") from None
    if array.ndim != dimensions:
        raise ArgumentError(name, array.shape, f"an array of {dimensions} dimension{'s' * (dimensions > 1)}")
    return np.require(array, requirements=["C", "A"])


def _checked_restitution(restitution: ArrayLike, contacts: int) -> tuple[float, Floats | None]:
    if isinstance(restitution, float) and -1.0 <= restitution <= 1.0:
        return float(restitution), None
    e = real_numbers(restitution)
    if e is None:
        raise ArgumentError("restitution", restitution, "a real number or one per contact")
    if e.ndim == 0:
        if not -1.0 <= float(e) <= 1.0:
            raise ArgumentError("restitution", float(e), "a number in [-1, 1]")
        return float(e), None
    values = e.astype(np.float64)
    if values.shape != (contacts,):
        raise ArgumentError("restitution", values.shape, f"a scalar or shape ({contacts},), one per contact")
    if contacts == 0:
        return 0.0, None
    if np.all(values == values[0]) and -1.0 <= values[0] <= 1.0:
        return float(values[0]), None
    for i, value in enumerate(values):
        if not 0.0 <= value <= 1.0:
            raise ArgumentError(f"restitution[{i}]", float(value), "a number in [0, 1] where contacts differ")
    return 0.0, values


PINV_CUTOFF = 1e-15  # numpy's classical default, the "as printed" reading of (20)
DAMPING = 1e-8  # λ as a share of the largest diagonal entry of W: half of the digits


class Whitened(NamedTuple):
    """Result of one method, in scaled coordinates."""

    v_plus: Floats
    momentum: Floats
    impulses: Floats
    rank: int
    clamp: float
    status: str = "complete"  # "budget": rows are left over; "not solved": the law is not met


class Method(NamedTuple):
    """A method: its solver (problem, row budget, clamped, tolerance) and whether it clamps by default.

    If `solve` is None, the method is (21) in factored form, compiled as a whole (`iapb.contact.kernels.border`).
    """

    solve: Callable[[ImpactInput, int, bool, float | None], Whitened] | None
    clamped: bool


def _prepared(problem: ImpactInput) -> Any:
    """Return the scratch of the problem, with the rows of J written into its columns."""
    work = problem.work.impact
    work.columns[:, : problem.contacts] = problem.work.rows
    return work


def _whitened_rows(problem: ImpactInput, work: Any) -> Floats:
    """Return the unit rows of A = J L⁻ᵀ; write work.u, work.rows and work.length as `factored_impact` does."""
    to_whitened(problem.lower, problem.velocity, work.u)
    whiten_columns(problem.lower, work.columns, problem.contacts)
    unit_columns(work.columns, problem.contacts, work.length)
    work.rows[:] = work.columns
    return work.rows[:, : problem.contacts].T


def _tolerance(problem: ImpactInput, given: float | None) -> float:
    return float(rank_tolerance(problem.lower)) if given is None else float(given)


def _from_impulses(problem: ImpactInput, impulses: NDArray[np.floating], rank: int, clamped: bool) -> Whitened:
    """Return v⁺ = v⁻ + M⁻¹Jᵀp, equation (9), for a method that computes p first."""
    work, d = _prepared(problem), problem.coordinates
    rows = _whitened_rows(problem, work)
    v_plus, momentum = np.empty(d), np.empty(d)
    work.change[:] = product((rows * work.length[: problem.contacts, None]).T, impulses)
    clamp = apply_change(problem.mass_matrix, problem.lower, problem.velocity, clamped, work, v_plus, momentum)
    return Whitened(v_plus, momentum, clamp * impulses, rank, clamp)


def _delassus(problem: ImpactInput, size: float | Floats = 1.0) -> tuple[Floats, Floats]:
    """Return W = J M⁻¹ Jᵀ and γ⁻ = J v⁻ for the scaled rows times `size`, computed by LAPACK."""
    J = problem.contact_jacobian * np.reshape(size, (-1, 1))
    return J @ np.linalg.solve(problem.mass_matrix, J.T), J @ problem.velocity


def gram_pinv(problem: ImpactInput, budget: int, clamped: bool, tolerance: float | None) -> Whitened:
    """Apply (20)-(21) as printed: p = −(1 + e) W† J v⁻ with numpy's pseudo-inverse, on rows of the caller's size.

    For comparison only: the last bits of LAPACK depend on the processor, and W's condition number amplifies them.
    """
    row_sizes(problem.work)
    size = problem.work.size
    W, gamma = _delassus(problem, size)
    cutoff = PINV_CUTOFF if tolerance is None else tolerance
    singular_values = np.linalg.svd(W, compute_uv=False)
    rank = int(np.sum(singular_values > cutoff * singular_values[0]))
    impulses = -(1.0 + problem.restitution) * size * (np.linalg.pinv(W, rcond=cutoff) @ gamma)
    return _from_impulses(problem, impulses, rank, clamped)


def gram_cholesky(problem: ImpactInput, budget: int, clamped: bool, tolerance: float | None) -> Whitened:
    """Solve (19), p = −(1 + e) W⁻¹ J v⁻, by Cholesky; the rows must be independent.

    For comparison only: LAPACK computes it, so the last bits depend on the processor.
    """
    W, gamma = _delassus(problem)
    unit = W / np.sqrt(np.outer(np.diag(W), np.diag(W))) if np.all(np.diag(W) > 0.0) else np.zeros_like(W)
    smallest = float(np.linalg.eigvalsh(0.5 * (unit + unit.T))[0])
    # The smallest eigenvalue of a Gram matrix of unit rows is known to c·ε only: below, the rows count as dependent.
    if smallest <= problem.contacts * np.finfo(float).eps * 8:
        raise ArgumentError("contact_jacobian", problem.contact_jacobian.shape,
                            "independent rows for method 'gram_cholesky'; use 'factored' for dependent ones")
    factor = np.linalg.cholesky(0.5 * (W + W.T))  # rows of similar size: definite, as the test above shows
    half = np.linalg.solve(factor, gamma)
    impulses = -(1.0 + problem.restitution) * np.linalg.solve(factor.T, half)
    return _from_impulses(problem, impulses, problem.contacts, clamped)


def damped(problem: ImpactInput, budget: int, clamped: bool, tolerance: float | None) -> Whitened:
    """Apply p = −(1 + e)(W + λI)⁻¹ J v⁻: every mode keeps part of its approach velocity, and none gains energy."""
    work = _prepared(problem)
    rows = _whitened_rows(problem, work) * work.length[: problem.contacts, None]
    W, gamma = product(rows, rows.T), product(problem.contact_jacobian, problem.velocity)
    share = DAMPING if tolerance is None else tolerance
    regular = W + share * max(float(np.max(np.diag(W))), float(np.finfo(float).tiny)) * np.eye(len(W))
    impulses = -(1.0 + problem.restitution) * solve(regular, gamma)
    return _from_impulses(problem, impulses, problem.contacts, clamped)


def svd(problem: ImpactInput, budget: int, clamped: bool, tolerance: float | None) -> Whitened:
    """Apply (21) with the projector from the truncated singular value decomposition of unit-scaled A.

    For comparison only: LAPACK computes it, so the last bits depend on the processor.
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
    least_norm_impulses(problem.work, rank)
    return Whitened(v_plus, momentum, problem.work.impulses, rank, clamp)


# Where a contact still closes faster than this share of ‖Aᵢ‖ |u|, or the energy clamp takes more than this, the two
# LCPs were not solved. Rounding leaves 1e-13; nearly dependent rows that push against each other leave more.
_UNSOLVED = 1e-6


def poisson(problem: ImpactInput, budget: int, clamped: bool, tolerance: float | None) -> Whitened:
    """Apply Poisson's law by two LCPs (compression, restitution); the status says whether they were solved."""
    work, d, c = _prepared(problem), problem.coordinates, problem.contacts
    v_plus, momentum, impulses = np.empty(d), np.empty(d), np.zeros(c)
    rank, clamp = poisson_impact(problem.mass_matrix, problem.lower, problem.velocity, problem.unequal, c, clamped,
                                 work, make_push_work(d, c), impulses, v_plus, momentum)
    if rank < 0:
        raise SolverError(f"Poisson's law: the active-set method did not converge on {c} contacts")
    _whitened_rows(problem, _prepared(problem))
    closing = work.length[:c] * math.sqrt(sum(work.u * work.u)) * _UNSOLVED
    met = clamp >= 1.0 - _UNSOLVED and bool(np.all(product(problem.contact_jacobian, v_plus) >= -closing))
    return Whitened(v_plus, momentum, impulses, rank, clamp, "complete" if met else "not solved")

"""The impact as given, checked and scaled by powers of two, and the methods that `resolve_impact` offers on it.

Scaling every coordinate to a unit diagonal of M, every row to a largest entry near one and the velocity to a largest
entry near one is exact in binary arithmetic. So no intermediate over- or underflows, and a change of units or of
row scale by a power of two changes no bit of the result.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from numbers import Real
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.contact.kernels.impact import (
    ImpactWork,
    apply_change,
    apply_projected_change,
    factored_impact,
    make_impact_work,
    rank_tolerance,
)
from iapb.contact.kernels.passive import gain_enclosure, passive_step
from iapb.contact.kernels.projector import minimum_norm_impulses, unit_columns
from iapb.contact.kernels.unilateral import make_push_work, poisson_impact
from iapb.dense import product, solve
from iapb.double_double import kinetic_energies
from iapb.errors import ArgumentError, SolverError
from iapb.mechanics.kernels.cholesky import cholesky, to_whitened, whiten_columns

Floats = NDArray[np.float64]
Exponents = NDArray[np.int32]

# |M − Mᵀ| up to this share of √(Mᵢᵢ Mⱼⱼ) is rounding of whoever computed M: energies are those of M as given, in
# which the skew part cancels; the factor is that of the symmetric part.
_SYMMETRY_TOLERANCE = 1e-9
_LOWEST_EXPONENT = -100_000  # exponent given to zeros, so that they never decide a maximum
_EXACT = 1000  # binary exponents that an entry may lie below the largest and still be scaled exactly


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
    given_mass: Floats  # (d, d) M and
    given_velocity: Floats  # (d,) v in the caller's units
    underflows: bool  # entries of v are so far apart that scaling rounds the small ones

    @property
    def coordinates(self) -> int:
        """d."""
        return len(self.velocity)

    @property
    def contacts(self) -> int:
        """c."""
        return len(self.contact_jacobian)

    def unscale_velocity(self, v: Floats) -> Floats:
        """Velocity in the caller's units."""
        return _ldexp(v, self.coordinate_exponent + self.velocity_exponent)

    def scale_velocity(self, v: Floats) -> Floats:
        """Velocity in scaled coordinates."""
        return _ldexp(v, -(self.coordinate_exponent + self.velocity_exponent))

    def unscale_momentum(self, momentum: Floats) -> Floats:
        """Generalized impulse in the caller's units."""
        return _ldexp(momentum, self.velocity_exponent - self.coordinate_exponent)

    def unscale_impulses(self, p: Floats) -> Floats:
        """Impulses along the caller's rows."""
        return _ldexp(p, self.row_exponent + self.velocity_exponent)

    def unscale_energy(self, energy: float) -> float:
        """Energy in the caller's units."""
        return _times_power(energy, 2 * self.velocity_exponent)


def check_input(mass_matrix: ArrayLike, contact_jacobian: ArrayLike, velocity: ArrayLike,
                restitution: ArrayLike) -> ImpactInput:
    """Check shapes, finiteness, symmetry and definiteness, then scale; raise ArgumentError by name."""
    M = _finite("mass_matrix", mass_matrix, 2)
    d = len(M)
    if d == 0 or M.shape != (d, d):
        raise ArgumentError("mass_matrix", M.shape, "a square matrix with at least one row")
    v = _finite("velocity", velocity, 1)
    if v.shape != (d,):
        raise ArgumentError("velocity", v.shape, f"shape ({d},), one entry per row of mass_matrix")
    J = np.zeros((0, d)) if _is_empty(contact_jacobian) else _finite("contact_jacobian", contact_jacobian, 2)
    if J.shape[1] != d:
        raise ArgumentError("contact_jacobian", J.shape, f"shape (contacts, {d})")
    e, unequal = _checked_restitution(restitution, len(J))
    return _scaled(M, J, v, e, unequal)


@dataclass(frozen=True)
class Outcome:
    """An impact in the caller's units, exactly passive where it is clamped."""

    velocity: Floats
    energy_change: float
    energy_interval: tuple[float, float]
    factor: float  # of the impulses: below 1 where rounding in the caller's units needed a further step


def outcome(problem: ImpactInput, v_plus: Floats, clamped: bool) -> Outcome:
    """Velocity and energy in the caller's units; the last step again where scaling back rounded v⁺ the wrong way."""
    M, v, factor = np.ascontiguousarray(problem.given_mass), problem.given_velocity, 1.0
    velocity = problem.unscale_velocity(v_plus)
    if not np.isfinite(velocity).all():
        return Outcome(velocity, math.nan, (math.nan, math.nan), factor)
    lower, upper, exponent = gain_enclosure(M, v, velocity)
    if clamped and not upper <= 0.0:
        candidate = velocity - v
        factor = passive_step(M, v, candidate, 1.0, velocity)
        v_plus = problem.scale_velocity(velocity)
        lower, upper, exponent = gain_enclosure(M, v, velocity)
    _, change = kinetic_energies(problem.mass_matrix, problem.velocity, v_plus)
    interval = _outward(lower, exponent - 2, -math.inf), _outward(upper, exponent - 2, math.inf)
    return Outcome(velocity, min(max(problem.unscale_energy(change), interval[0]), interval[1]), interval, factor)


def _outward(value: float, exponent: int, towards: float) -> float:
    """value · 2^exponent, one step outwards for what rounding took; a bound of no gain or no loss stays one."""
    bound = math.nextafter(_times_power(value, exponent), towards)
    return min(bound, 0.0) if value <= 0.0 < towards else max(bound, 0.0) if value >= 0.0 > towards else bound


def _times_power(value: float, exponent: int) -> float:
    try:
        return math.ldexp(value, exponent)
    except OverflowError:
        return math.copysign(math.inf, value)


def _is_empty(rows: ArrayLike) -> bool:
    """[] and zeros(0) have no second dimension to check."""
    given = _real_numbers(rows)
    return given is not None and given.shape == (0,)


def _real_numbers(value: Any) -> NDArray[Any] | None:
    """The value as an array; None for strings, truth values, time spans, complex numbers and masked arrays."""
    try:
        given = np.asarray(value)
    except (TypeError, ValueError):
        return None
    if isinstance(value, np.ma.MaskedArray):
        return None
    if given.dtype.kind == "O":
        return given if all(isinstance(x, Real) and not isinstance(x, bool) for x in given.flat) else None
    return given if given.dtype.kind in "fiu" else None


def _finite(name: str, value: Any, dimensions: int) -> Floats:
    given = _real_numbers(value)
    if given is None:
        raise ArgumentError(name, value, "an array of real numbers")
    try:
        array = given.astype(np.float64, copy=False)
    except OverflowError:
        raise ArgumentError(name, value, "an array of finite numbers") from None
    if array.ndim != dimensions:
        raise ArgumentError(name, array.shape, f"an array of {dimensions} dimension{'s' * (dimensions > 1)}")
    if not np.isfinite(array).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise ArgumentError(f"{name}[{', '.join(map(str, where))}]", float(array[where]), "a finite number")
    return array


def _checked_restitution(restitution: ArrayLike, contacts: int) -> tuple[float, Floats | None]:
    if isinstance(restitution, float) and -1.0 <= restitution <= 1.0:
        return float(restitution), None
    e = _real_numbers(restitution)
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


def _exponents(array: Floats) -> Exponents:
    """Binary exponent of every entry; zeros get one that never is a maximum."""
    mantissa, exponents = np.frexp(array)
    exponents[mantissa == 0.0] = _LOWEST_EXPONENT
    return exponents


def _ldexp(array: Floats, exponent: Exponents) -> Floats:
    """array · 2^exponent; overflow becomes infinity for the caller to refuse.

    Exponents are sums of a few of doubles, far inside int32; the marks of zeros, some -1e5 each, are too.
    """
    with np.errstate(over="ignore", under="ignore"):
        return np.ldexp(array, exponent)


def scaling(diagonal: Floats, J: Floats, v: Floats) -> tuple[Exponents, Exponents, Exponents]:
    """Exponents s (..., d), r (..., c) and k (...) of `ImpactInput`, of one impact or many; `diagonal`: of M."""
    s = -(np.frexp(diagonal)[1] // 2)
    k = (_exponents(v) - s).max(axis=-1, initial=_LOWEST_EXPONENT)
    row = -(_exponents(J) + s[..., None, :]).max(axis=-1, initial=_LOWEST_EXPONENT)
    row[np.abs(row) > abs(_LOWEST_EXPONENT) // 2] = 0  # a row of zeros
    return s, row, np.where(k <= _LOWEST_EXPONENT // 2, 0, k)


def _scaled(M: Floats, J: Floats, v: Floats, e: float, unequal: Floats | None) -> ImpactInput:
    diagonal = M.diagonal()
    if not diagonal.min() > 0.0:
        k = int(np.argmin(diagonal))
        raise ArgumentError(f"mass_matrix[{k}, {k}]", float(diagonal[k]), "a positive diagonal entry")
    s, row, of_velocity = scaling(diagonal, J, v)
    mass, lower = _factored(M, _ldexp(M, s[:, None] + s))
    size, k = _exponents(v) - s, int(of_velocity)
    underflows = bool(((size < k - _EXACT) & (size > _LOWEST_EXPONENT // 2)).any())
    return ImpactInput(
        mass_matrix=mass, lower=lower, contact_jacobian=_ldexp(J, row[:, None] + s), velocity=_ldexp(v, -(s + k)),
        restitution=e, unequal=unequal, coordinate_exponent=s, row_exponent=row, velocity_exponent=k,
        given_mass=M, given_velocity=v, underflows=underflows)


def _factored(M: Floats, scaled: Floats) -> tuple[Floats, Floats]:
    """The scaled M and the Cholesky factor of its symmetric part; M as given is for messages."""
    if not (scaled.max() <= 2.0 and scaled.min() >= -2.0):  # |Mᵢⱼ| < √(Mᵢᵢ Mⱼⱼ) holds where M is positive definite
        i, j = np.unravel_index(int(np.argmax(np.abs(scaled))), M.shape)
        raise ArgumentError(f"mass_matrix[{i}, {j}]", float(M[i, j]), "a positive definite matrix")
    mass = symmetric = np.ascontiguousarray(scaled)
    if not (scaled == scaled.T).all():
        skew = np.abs(scaled - scaled.T)
        if skew.max() > _SYMMETRY_TOLERANCE:
            i, j = np.unravel_index(int(np.argmax(skew)), M.shape)
            raise ArgumentError(f"mass_matrix[{i}, {j}]", float(M[i, j]),
                                f"a symmetric matrix; entry [{j}, {i}] is {float(M[j, i])!r}")
        symmetric = np.ascontiguousarray(0.5 * (scaled + scaled.T))
    lower = np.zeros_like(symmetric)
    pivot = cholesky(symmetric, lower)
    if pivot:
        raise ArgumentError("mass_matrix", M, f"a positive definite matrix (pivot {pivot} of Cholesky is not positive)")
    return mass, lower



PINV_CUTOFF = 1e-15  # numpy's classical default, the "as printed" reading of (20)
DAMPING = 1e-8  # λ as a share of the largest diagonal entry of W: half of the digits


class Whitened(NamedTuple):
    """Answer of one method, in scaled coordinates."""

    v_plus: Floats
    momentum: Floats
    impulses: Floats
    rank: int
    clamp: float
    status: str = "complete"  # "budget" where it ended the work with rows left, "not solved" where the law is not met


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
    status = "budget" if ended_early else "complete"
    return Whitened(v_plus, momentum, _least_norm(problem, work, rank), rank, clamp, status)


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


# Where a contact still closes faster than this share of ‖Aᵢ‖ |u|, or the energy clamp takes more than this, the two
# LCPs were not solved. Rounding leaves 1e-13; nearly dependent rows that push against each other leave more.
_UNSOLVED = 1e-6


def poisson(problem: ImpactInput, budget: int, clamped: bool, tolerance: float | None) -> Whitened:
    """Poisson's law for unequal restitution, by two LCPs (compression, restitution), judged by what they leave."""
    work, d, c = _prepared(problem), problem.coordinates, problem.contacts
    v_plus, momentum, impulses = np.empty(d), np.empty(d), np.zeros(c)
    rank, clamp = poisson_impact(problem.mass_matrix, problem.lower, problem.velocity, problem.unequal, c, clamped,
                                 work, make_push_work(d, c), impulses, v_plus, momentum)
    if rank < 0:
        raise SolverError(f"Poisson's law: the active-set method did not converge on {c} contacts")
    fresh = _prepared(problem)
    _whitened_rows(problem, fresh)
    closing = fresh.length[:c] * math.sqrt(sum(fresh.u * fresh.u)) * _UNSOLVED
    met = clamp >= 1.0 - _UNSOLVED and bool(np.all(product(problem.contact_jacobian, v_plus) >= -closing))
    return Whitened(v_plus, momentum, impulses, rank, clamp, "complete" if met else "not solved")

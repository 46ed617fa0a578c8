"""Exact results for hard impacts: rational numbers, and ball arithmetic with certified radius (python-flint).

Every finite double is a rational number, so an impact given in doubles has an exact outcome of (21),
v⁺ = v − (1+e) M⁻¹Jᵀ(J M⁻¹Jᵀ)†J v = v − (1+e) M⁻¹Jₙᵀ(Jₙ M⁻¹Jₙᵀ)⁻¹Jₙ v, with Jₙ a maximal independent subset
of the rows (33). The subset is found without rounding, so redundancy is decided exactly. Rows that are redundant only
up to rounding are independent here; give fractions for exact redundancy.

For many impacts `bulk_energy_gain` judges energy in double-double arithmetic with a running error bound:
2 (KE⁺ − KE⁻) = ΔᵀMs with Δ = v⁺ − v⁻ and s = v⁺ + v⁻, which are exact double-doubles, so the energies do not cancel.
If M is not symmetric to the last bit, the formula is ½(ΔᵀMs + sᵀMΔ).
Source: Dekker, Numerische Mathematik 18 (1971); Ogita, Rump, Oishi, SIAM J. Sci. Comput. 26 (2005).
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.errors import ArgumentError, MissingDependencyError, SolverError

Floats = NDArray[np.float64]
Rational = Any  # flint.fmpq_mat; named here because flint is imported only when used

_FIRST_BALL_BITS = 256  # first working precision; doubled until the ball is narrow
_LAST_BALL_BITS = 1 << 14  # if the ball is still wide at this precision, an error is raised
_BALL_ACCURACY_BITS = 80  # narrow enough to round to the nearest double and to judge its last bit

_SPLITTER = 134217729.0  # 2^27 + 1: splits a double into two halves whose products are exact
_ROUNDING = 2.0**-100  # bound of the error of one double-double operation, which is below 2^-102
# Beyond these magnitudes the halves or the error terms leave the range of doubles; use exact arithmetic then.
_SMALLEST, _LARGEST = 1e-60, 1e60


@dataclass(frozen=True)
class ExactImpact:
    """The result of (21) for the given numbers, without rounding.

    Attributes
    ----------
    velocity : v⁺, d fractions
    generalized_impulse : M (v⁺ − v⁻), d fractions
    independent_rows : indices of the rows Jₙ
    energy_before, energy_after : kinetic energies [J]
    """

    velocity: tuple[Fraction, ...]
    generalized_impulse: tuple[Fraction, ...]
    independent_rows: tuple[int, ...]
    energy_before: Fraction
    energy_after: Fraction

    @property
    def rank(self) -> int:
        """Exact rank of the contact Jacobian."""
        return len(self.independent_rows)

    @property
    def rounded_velocity(self) -> Floats:
        """v⁺ rounded once to doubles (d,)."""
        return np.array([float(x) for x in self.velocity])


def exact_impact(
    mass_matrix: ArrayLike, contact_jacobian: ArrayLike, velocity: ArrayLike, restitution: float | Fraction
) -> ExactImpact:
    """Return the exact result of (21) for M (d, d), J (c, d), v (d,) and scalar e.

    Parameters
    ----------
    mass_matrix, contact_jacobian, velocity : doubles or `fractions.Fraction`; M must be symmetric positive definite
    restitution : e, one for all rows

    Returns
    -------
    ExactImpact
        v⁺, the generalized impulse, the rows used, and the energies before and after, all as fractions.

    Raises
    ------
    ArgumentError
        An entry is not finite, or the shapes do not fit.
    """
    mass, v = rational_matrix("mass_matrix", mass_matrix), rational_matrix("velocity", velocity)
    chosen = independent_rows(contact_jacobian)
    rows = _take_rows(rational_matrix("contact_jacobian", contact_jacobian, mass.ncols()), chosen)
    impulse = _generalized_impulse(mass, rows, v, _fmpq(Fraction(restitution)))
    v_plus = v + mass.solve(impulse)
    before, after = (_fraction((x.transpose() * mass * x)[0, 0]) / 2 for x in (v, v_plus))
    return ExactImpact(_fractions(v_plus), _fractions(impulse), chosen, before, after)


def independent_rows(contact_jacobian: ArrayLike) -> tuple[int, ...]:
    """Return the indices of the first maximal set of linearly independent rows, decided exactly."""
    jacobian = rational_matrix("contact_jacobian", contact_jacobian)
    if 0 in (jacobian.nrows(), jacobian.ncols()):
        return ()
    reduced, rank = jacobian.transpose().rref()
    return tuple(_first_nonzero(reduced, i) for i in range(rank))


def relative_energy_gain(mass_matrix: ArrayLike, v_minus: ArrayLike, v_plus: ArrayLike) -> float:
    """Return (KE⁺ − KE⁻)/KE⁻ computed exactly from the given numbers and rounded, but no gain to 0; > 0 is a gain.

    If KE⁻ = 0, the result is 0 for KE⁺ = 0 and infinity otherwise. For many impacts see `bulk_energy_gain`.
    """
    mass = rational_matrix("mass_matrix", mass_matrix)
    before, after = (
        _fraction((x.transpose() * mass * x)[0, 0])
        for x in (rational_matrix("v_minus", v_minus), rational_matrix("v_plus", v_plus))
    )
    if before == 0:
        return 0.0 if after == 0 else np.inf
    try:
        return float((after - before) / before) or 5e-324 * (after > before)
    except OverflowError:  # the gain is above 1.8e308; a loss is never below -1
        return np.inf


def ball_impact(
    mass_matrix: ArrayLike, contact_jacobian: ArrayLike, velocity: ArrayLike, restitution: float
) -> tuple[Floats, Floats]:
    """Return v⁺ of (21) as doubles (d,) and certified bounds (d,) of their error, by ball arithmetic.

    This is faster than `exact_impact` for large problems, because only the choice of independent rows is rational. The
    precision doubles until every ball's radius is at most 2⁻⁸⁰ of the largest component.

    Raises
    ------
    SolverError
        The ball is still wide at 16384 bits.
    """
    flint = _flint()
    mass, v = rational_matrix("mass_matrix", mass_matrix), rational_matrix("velocity", velocity)
    jacobian = rational_matrix("contact_jacobian", contact_jacobian, mass.ncols())
    rows, e = _take_rows(jacobian, independent_rows(contact_jacobian)), _fmpq(Fraction(restitution))
    bits, before = _FIRST_BALL_BITS, flint.ctx.prec
    try:
        while bits <= _LAST_BALL_BITS:
            flint.ctx.prec = bits
            balls = _try_balls(flint, mass, rows, v, e)
            if balls is not None:
                return balls
            bits *= 2
    finally:
        flint.ctx.prec = before
    raise SolverError(f"ball arithmetic did not narrow at {_LAST_BALL_BITS} bits")


def condition_number(mass_matrix: ArrayLike) -> float:
    """Return kappa(M) = largest / smallest eigenvalue, from the exact characteristic polynomial."""
    eigenvalues = _nonzero_eigenvalues(rational_matrix("mass_matrix", mass_matrix))
    return eigenvalues[-1] / eigenvalues[0]


def row_condition_number(mass_matrix: ArrayLike, contact_jacobian: ArrayLike) -> float:
    """Return kappa(A) of A = J L⁻ᵀ, the largest over the smallest nonzero singular value; 1 without rows.

    The singular values are the square roots of the nonzero eigenvalues of M⁻¹JᵀJ, which is rational.
    """
    mass = rational_matrix("mass_matrix", mass_matrix)
    jacobian = rational_matrix("contact_jacobian", contact_jacobian, mass.ncols())
    eigenvalues = _nonzero_eigenvalues(mass.solve(jacobian.transpose() * jacobian))
    return float(np.sqrt(eigenvalues[-1] / eigenvalues[0])) if eigenvalues else 1.0


def rational_matrix(argument: str, value: ArrayLike, columns: int | None = None) -> Rational:
    """Return `value` as a matrix of rationals, exactly; a vector becomes a column (unless `columns` is given)."""
    flint = _flint()
    array = np.array(value, dtype=object)
    if array.ndim == 1:
        array = array.reshape(-1, 1) if columns is None else array.reshape(-1, columns)
    if array.ndim != 2:
        raise ArgumentError(argument, array.shape, "a vector or a matrix")
    if columns is not None and array.shape[1] != columns:
        raise ArgumentError(argument, array.shape, f"{columns} columns")
    try:
        entries = [_fmpq(Fraction(x)) for x in array.ravel()]
    except (OverflowError, ValueError, TypeError):
        raise ArgumentError(argument, value, "finite doubles or fractions") from None
    return flint.fmpq_mat(*array.shape, entries)


def _flint() -> Any:
    try:
        import flint
    except ImportError as error:
        raise MissingDependencyError(
            "python-flint", "exact arithmetic", "pip install python-flint"
        ) from error
    return flint


def _fmpq(x: Fraction) -> Any:
    return _flint().fmpq(x.numerator, x.denominator)


def _fraction(x: Any) -> Fraction:
    return Fraction(int(x.p), int(x.q))


def _fractions(column: Rational) -> tuple[Fraction, ...]:
    return tuple(_fraction(x) for x in column.entries())


def _take_rows(matrix: Rational, rows: tuple[int, ...]) -> Rational:
    entries = [matrix[i, j] for i in rows for j in range(matrix.ncols())]
    return _flint().fmpq_mat(len(rows), matrix.ncols(), entries)


def _first_nonzero(matrix: Rational, row: int) -> int:
    return next(j for j in range(matrix.ncols()) if matrix[row, j] != 0)


def _generalized_impulse(mass: Any, rows: Any, v: Any, e: Any) -> Any:
    """Return −(1+e) Jₙᵀ (Jₙ M⁻¹ Jₙᵀ)⁻¹ Jₙ v in the arithmetic of the matrices (rationals or balls)."""
    if rows.nrows() == 0:
        return v - v
    delassus = rows * mass.solve(rows.transpose())
    return rows.transpose() * delassus.solve(rows * v) * -(1 + e)


def _try_balls(flint: Any, mass: Any, rows: Any, v: Any, e: Any) -> tuple[Floats, Floats] | None:
    ball_mass, ball_rows, ball_v = flint.arb_mat(mass), flint.arb_mat(rows), flint.arb_mat(v)
    try:
        impulse = _generalized_impulse(ball_mass, ball_rows, ball_v, flint.arb(e))
        entries = (ball_v + ball_mass.solve(impulse)).entries()
    except ZeroDivisionError:  # a pivot's ball contains zero: more bits are needed
        return None
    largest = max((float(abs(x).upper()) for x in entries), default=0.0)
    if any(float(x.rad()) > largest * 2.0**-_BALL_ACCURACY_BITS for x in entries):
        return None
    middle = np.array([float(x.mid()) for x in entries])
    bounds = [float(abs(x - flint.arb(m)).upper()) for x, m in zip(entries, middle, strict=True)]
    return middle, np.nextafter(bounds, np.inf)  # float() rounds to nearest; a bound must round up


def _nonzero_eigenvalues(matrix: Rational) -> list[float]:
    """Return the nonzero eigenvalues, ascending, of a matrix known to have real eigenvalues >= 0."""
    roots = matrix.charpoly().complex_roots()
    return sorted(float(root.real.mid()) for root, _ in roots if not root.contains(0))


def bulk_energy_gain(mass_matrix: ArrayLike, v_minus: ArrayLike, v_plus: ArrayLike) -> tuple[Floats, Floats]:
    """Return (gain, bound), each (n,): (KE⁺ − KE⁻)/KE⁻ per impact and a bound of its error.

    Shapes: M (n, d, d) or (d, d), v⁻ and v⁺ (n, d). If KE⁻ is not positive, gain is NaN and bound infinity.
    """
    before = np.atleast_2d(np.asarray(v_minus, dtype=np.float64))
    after = np.atleast_2d(np.asarray(v_plus, dtype=np.float64))
    masses = np.asarray(mass_matrix, dtype=np.float64)
    n, d = before.shape
    if after.shape != before.shape:
        raise ArgumentError("v_plus", after.shape, f"shape {before.shape}, as v_minus")
    if masses.shape not in ((d, d), (n, d, d)):
        raise ArgumentError("mass_matrix", masses.shape, f"shape ({d}, {d}) or ({n}, {d}, {d})")
    _check_magnitudes(masses, before, after)
    gain, bound = np.empty(n), np.empty(n)
    _gains(np.ascontiguousarray(np.broadcast_to(masses, (n, d, d))), before, after, gain, bound)
    return gain, bound


def _check_magnitudes(masses: Floats, before: Floats, after: Floats) -> None:
    for argument, array in (("mass_matrix", masses), ("v_minus", before), ("v_plus", after)):
        size = np.abs(array[array != 0.0])
        if not np.isfinite(array).all() or (size.size and (size.max() > _LARGEST or size.min() < _SMALLEST)):
            expected = f"magnitudes in [{_SMALLEST:g}, {_LARGEST:g}] or 0; use relative_energy_gain beyond"
            raise ArgumentError(argument, array, expected)


@numba.njit(cache=True, fastmath=False)
def _two_sum(a, b):  # type: ignore[no-untyped-def]
    """Return a + b as an exact pair (sum, error)."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@numba.njit(cache=True, fastmath=False)
def _two_product(a, b):  # type: ignore[no-untyped-def]
    """Return a b as an exact pair (product, error)."""
    p = a * b
    c = _SPLITTER * a
    a1 = c - (c - a)
    a2 = a - a1
    c = _SPLITTER * b
    b1 = c - (c - b)
    b2 = b - b1
    return p, a2 * b2 - (((p - a1 * b1) - a2 * b1) - a1 * b2)


@numba.njit(cache=True, fastmath=False)
def _add(ah, al, bh, bl):  # type: ignore[no-untyped-def]
    """Return the double-double sum, in the accurate variant that keeps both low parts."""
    sh, sl = _two_sum(ah, bh)
    th, tl = _two_sum(al, bl)
    sh, sl = _two_sum(sh, sl + th)
    return _two_sum(sh, sl + tl)


@numba.njit(cache=True, fastmath=False)
def _multiply(ah, al, bh, bl):  # type: ignore[no-untyped-def]
    """Return the double-double product."""
    ph, pl = _two_product(ah, bh)
    return _two_sum(ph, pl + (ah * bl + al * bh))


@numba.njit(cache=True, fastmath=False)
def _bilinear(mass, ah, al, bh, bl):  # type: ignore[no-untyped-def]
    """Return aᵀ M b as a double-double, and the sum of |a_i M_ij b_j|, for double-double vectors a and b."""
    high, low, size = 0.0, 0.0, 0.0
    for i in range(len(ah)):
        rh, rl = 0.0, 0.0
        for j in range(len(bh)):
            th, tl = _multiply(bh[j], bl[j], mass[i, j], 0.0)
            rh, rl = _add(rh, rl, th, tl)
            size += abs(ah[i] * th)
        th, tl = _multiply(ah[i], al[i], rh, rl)
        high, low = _add(high, low, th, tl)
    return high, low, size


@numba.njit(cache=True, fastmath=False)
def _symmetric(mass):  # type: ignore[no-untyped-def]
    for i in range(len(mass)):
        for j in range(i):
            if mass[i, j] != mass[j, i]:
                return False
    return True


@numba.njit(cache=True, fastmath=False)
def _gains(masses, before, after, gain, bound):  # type: ignore[no-untyped-def]
    """Write the relative gain and its bound for each impact."""
    n, d = before.shape
    difference, difference_low = np.empty(d), np.empty(d)
    total, total_low, zero = np.empty(d), np.empty(d), np.zeros(d)
    for k in range(n):
        for i in range(d):
            difference[i], difference_low[i] = _two_sum(after[k, i], -before[k, i])
            total[i], total_low[i] = _two_sum(after[k, i], before[k, i])
        change, low, size = _bilinear(masses[k], difference, difference_low, total, total_low)
        if not _symmetric(masses[k]):
            turned, turned_low, turned_size = _bilinear(masses[k], total, total_low, difference, difference_low)
            change, size = 0.5 * _add(change, low, turned, turned_low)[0], 0.5 * (size + turned_size)
        energy, _, energy_size = _bilinear(masses[k], before[k], zero, before[k], zero)
        if not energy > d * d * _ROUNDING * energy_size:
            gain[k], bound[k] = np.nan, np.inf
            continue
        gain[k] = change / energy
        rounding = 4.0 * abs(gain[k]) * 2.0**-53  # the final division and the dropped low parts
        bound[k] = 2.0 * d * _ROUNDING * (size + abs(gain[k]) * energy_size) / energy + rounding

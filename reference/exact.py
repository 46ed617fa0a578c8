"""Exact results for hard impacts in rational numbers (python-flint), and exact energy gains.

Every finite double is a rational number, so an impact given in doubles has an exact outcome of
(21), v⁺ = v − (1+e) M⁻¹Jᵀ(J M⁻¹Jᵀ)†J v = v − (1+e) M⁻¹Jₙᵀ(Jₙ M⁻¹Jₙᵀ)⁻¹Jₙ v, with Jₙ a maximal
independent subset of the rows (33). The subset is found without rounding, so redundancy is decided
exactly. Rows that are redundant only up to rounding are independent here; give fractions for exact
redundancy.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cache, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from iapb.errors import ArgumentError
from iapb.lazy import needed

Rational = Any  # flint.fmpq_mat; named here because flint is imported only when used
_flint = cache(partial(needed, "flint", "Exact arithmetic"))


@dataclass(frozen=True)
class ExactImpact:
    """The result of (21) for the given numbers, without rounding."""

    velocity: tuple[Fraction, ...]  #: v⁺, d fractions
    generalized_impulse: tuple[Fraction, ...]  #: M (v⁺ − v⁻), d fractions
    independent_rows: tuple[int, ...]  #: indices of the rows Jₙ
    energy_before: Fraction  #: kinetic energy [J]
    energy_after: Fraction  #: kinetic energy [J]

    @property
    def rank(self) -> int:
        """Exact rank of the contact Jacobian."""
        return len(self.independent_rows)


def exact_impact(
    mass_matrix: ArrayLike,
    contact_jacobian: ArrayLike,
    velocity: ArrayLike,
    restitution: float | Fraction,
) -> ExactImpact:
    """Return the exact result of (21) for M (d, d), J (c, d), v (d,) and scalar e.

    Parameters
    ----------
    mass_matrix, contact_jacobian, velocity : doubles or `fractions.Fraction`; M must be symmetric
        positive definite
    restitution : e, one for all rows

    Raises
    ------
    ArgumentError
        An entry is not finite, or the shapes do not fit.
    """
    mass = rational_matrix("mass_matrix", mass_matrix)
    v = rational_matrix("velocity", velocity)
    jacobian = rational_matrix("contact_jacobian", contact_jacobian, mass.ncols())
    e = rational_matrix("restitution", np.array([restitution]))[0, 0]
    chosen = independent_rows(contact_jacobian)
    impulse = v - v
    if chosen:
        rows = type(mass)(
            len(chosen), mass.ncols(), [jacobian[i, j] for i in chosen for j in range(mass.ncols())]
        )
        impulse = (
            rows.transpose() * (rows * mass.solve(rows.transpose())).solve(rows * v) * -(1 + e)
        )
    v_plus = v + mass.solve(impulse)
    before, after = (fractions_of(x.transpose() * mass * x)[0] / 2 for x in (v, v_plus))
    return ExactImpact(fractions_of(v_plus), fractions_of(impulse), chosen, before, after)


def independent_rows(contact_jacobian: ArrayLike) -> tuple[int, ...]:
    """Return the indices of the first maximal set of linearly independent rows, decided exactly."""
    jacobian = rational_matrix("contact_jacobian", contact_jacobian)
    if 0 in (jacobian.nrows(), jacobian.ncols()):
        return ()
    reduced, rank = jacobian.transpose().rref()
    return tuple(next(j for j in range(reduced.ncols()) if reduced[i, j] != 0) for i in range(rank))


_PRIME = 2**61 - 1


def exact_rank(contact_jacobian: ArrayLike) -> int:
    """Return the rank of J (c, d), decided without rounding.

    Doubles are whole numbers times one power of two. The rank of their residues is never above that
    of J, and below it only if a large prime divides a determinant, which is as good as impossible.
    """
    jacobian = np.asarray(contact_jacobian, np.float64)
    if 0 in jacobian.shape:
        return 0
    residues = whole_numbers("contact_jacobian", jacobian)[0] % _PRIME
    return int(_flint().nmod_mat(*jacobian.shape, residues.ravel().tolist(), _PRIME).rank())


def relative_energy_gain(mass_matrix: ArrayLike, v_minus: ArrayLike, v_plus: ArrayLike) -> float:
    """Return (KE⁺ − KE⁻)/KE⁻ computed exactly from the given numbers and rounded, but no gain to 0;
    > 0 is a gain.

    If KE⁻ = 0, the result is 0 for KE⁺ = 0 and infinity otherwise.
    """
    mass, _ = whole_numbers("mass_matrix", mass_matrix)
    (v, v_after), _ = whole_numbers("velocities", [v_minus, v_plus])
    # ½ and both units cancel
    before = v @ mass @ v
    after = v_after @ mass @ v_after
    if before == 0:
        return 0.0 if after == 0 else np.inf
    try:
        return float((after - before) / before) or 5e-324 * (after > before)
    except OverflowError:  # the gain is above 1.8e308; a loss is never below -1
        return np.inf


def whole_numbers(name: str, values: Any) -> tuple[Any, int]:
    """Return Python integers of any length and one exponent such that values = integers ·
    2^exponent exactly."""
    given = np.asarray(values, np.float64)
    if not np.isfinite(given).all():
        raise ArgumentError(name, given, "finite numbers")
    mantissas, exponents = np.frexp(given)
    whole = (mantissas * 2.0**53).astype(np.int64)
    least = int(exponents[whole != 0].min(initial=2000))
    shifts = np.maximum(exponents - least, 0)
    return whole.astype(object) << shifts.astype(object), least - 53


def condition_number(mass_matrix: ArrayLike) -> float:
    """Return kappa(M) = largest / smallest eigenvalue, from the exact characteristic polynomial."""
    eigenvalues = _nonzero_eigenvalues(rational_matrix("mass_matrix", mass_matrix))
    return eigenvalues[-1] / eigenvalues[0]


def row_condition_number(mass_matrix: ArrayLike, contact_jacobian: ArrayLike) -> float:
    """Return kappa(A) of A = J L⁻ᵀ, the largest over the smallest nonzero singular value; 1 without
    rows.

    The singular values are the square roots of the nonzero eigenvalues of M⁻¹JᵀJ, which is
    rational.
    """
    mass = rational_matrix("mass_matrix", mass_matrix)
    jacobian = rational_matrix("contact_jacobian", contact_jacobian, mass.ncols())
    eigenvalues = _nonzero_eigenvalues(mass.solve(jacobian.transpose() * jacobian))
    return float(np.sqrt(eigenvalues[-1] / eigenvalues[0])) if eigenvalues else 1.0


def rational_matrix(argument: str, value: ArrayLike, columns: int | None = None) -> Rational:
    """Return `value` as a matrix of rationals, exactly; a vector becomes a column (unless `columns`
    is given)."""
    flint = _flint()
    array = np.array(value, dtype=object)
    if array.ndim == 1:
        array = array.reshape(-1, 1) if columns is None else array.reshape(-1, columns)
    if array.ndim != 2 or columns not in (None, array.shape[1]):
        raise ArgumentError(
            argument, array.shape, f"{columns} columns" if columns else "a vector or a matrix"
        )
    try:
        fractions = [Fraction(x) for x in array.ravel()]
    except (OverflowError, ValueError, TypeError):
        raise ArgumentError(argument, value, "finite doubles or fractions") from None
    return flint.fmpq_mat(*array.shape, [flint.fmpq(x.numerator, x.denominator) for x in fractions])


def fractions_of(matrix: Rational) -> tuple[Fraction, ...]:
    """Return the entries of a rational matrix."""
    return tuple(Fraction(int(x.p), int(x.q)) for x in matrix.entries())


def _nonzero_eigenvalues(matrix: Rational) -> list[float]:
    """Return the nonzero eigenvalues, ascending, of a matrix known to have real eigenvalues >=
    0."""
    roots = matrix.charpoly().complex_roots()
    return sorted(float(root.real.mid()) for root, _ in roots if not root.contains(0))

"""The printed formula (21) in rational arithmetic: the Moore-Penrose inverse of a rational Delassus matrix.

W = C R, where C has the independent columns and R is the reduced echelon form; W† = Rᵀ(R Rᵀ)⁻¹(CᵀC)⁻¹Cᵀ.
Source: Ben-Israel and Greville, Generalized Inverses (2003), theorem 1.5 (MacDuffee).
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from numpy.typing import ArrayLike

from reference.exact import rational_matrix


def pseudo_inverse_velocity(
    mass_matrix: ArrayLike, contact_jacobian: ArrayLike, velocity: ArrayLike, restitution: Fraction
) -> tuple[Fraction, ...]:
    """Return v⁺ = v − (1+e) M⁻¹Jᵀ(J M⁻¹Jᵀ)†J v in rational arithmetic."""
    mass, v = rational_matrix("mass_matrix", mass_matrix), rational_matrix("velocity", velocity)
    rows = rational_matrix("contact_jacobian", contact_jacobian, mass.ncols())
    inverse = pseudo_inverse(rows * mass.solve(rows.transpose()))
    change = mass.solve(rows.transpose() * inverse * (rows * v))
    factor = 1 + restitution
    return tuple(
        _fraction(a) - factor * _fraction(b) for a, b in zip(v.entries(), change.entries(), strict=True)
    )


def pseudo_inverse(matrix: Any) -> Any:
    """Return W† of a rational matrix that is not zero."""
    reduced, rank = matrix.rref()
    pivots = [next(j for j in range(matrix.ncols()) if reduced[i, j] != 0) for i in range(rank)]
    make = type(matrix)
    columns = make(matrix.nrows(), rank, [matrix[i, j] for i in range(matrix.nrows()) for j in pivots])
    echelon = make(rank, matrix.ncols(), [reduced[i, j] for i in range(rank) for j in range(matrix.ncols())])
    left = (columns.transpose() * columns).solve(columns.transpose())
    return echelon.transpose() * (echelon * echelon.transpose()).solve(left)


def _fraction(x: Any) -> Fraction:
    return Fraction(int(x.p), int(x.q))

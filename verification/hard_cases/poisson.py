"""Poisson's law for a few contacts in rational arithmetic: both LCPs by trying every set of pushing contacts."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from iapb.errors import SolverError

Vector = list[Fraction]
Matrix = list[Vector]


def exact_poisson(
    mass_matrix: ArrayLike, contact_jacobian: ArrayLike, velocity: ArrayLike, restitution: ArrayLike
) -> tuple[tuple[Fraction, ...], int]:
    """Return v⁺ exactly and the number of contacts that push.

    Compression `0 ≤ p_c ⟂ γ_c ≥ 0`, then restitution `0 ≤ p_e − E p_c ⟂ γ⁺ ≥ 0` (docs/theory.md).
    """
    M, J = fractions(mass_matrix), fractions(contact_jacobian)
    v, e = fractions(velocity), fractions(restitution)
    columns = [solve(M, row) for row in J]  # M⁻¹Jᵀ, one column per contact
    W = [[dot(row, column) for column in columns] for row in J]
    gamma = [dot(row, v) for row in J]
    compression = _lcp(W, gamma)
    returned = [p + share * p for p, share in zip(compression, e, strict=True)]
    extra = _lcp(W, [g + dot(w, returned) for g, w in zip(gamma, W, strict=True)])
    impulse = [p + q for p, q in zip(returned, extra, strict=True)]
    v_plus = tuple(x + dot(impulse, [column[k] for column in columns]) for k, x in enumerate(v))
    return v_plus, sum(p > 0 for p in impulse)


def _lcp(W: Matrix, q: Vector) -> Vector:
    """0 ≤ p ⟂ W p + q ≥ 0 by enumeration; W a Delassus matrix, so a set of independent contacts solves it."""
    n = len(q)
    for size in range(n + 1):
        for chosen in combinations(range(n), size):
            p = _try_set(W, q, chosen)
            if p is not None:
                return p
    raise SolverError("the complementarity problem has no solution among sets of independent contacts")


def _try_set(W: Matrix, q: Vector, chosen: tuple[int, ...]) -> Vector | None:
    try:
        active = solve([[W[i][j] for j in chosen] for i in chosen], [-q[i] for i in chosen])
    except ZeroDivisionError:  # dependent contacts: another set has the same effect
        return None
    p = [Fraction(0)] * len(q)
    for i, value in zip(chosen, active, strict=True):
        p[i] = value
    if min(p, default=Fraction(0)) < 0 or any(dot(row, p) + b < 0 for row, b in zip(W, q, strict=True)):
        return None
    return p


def solve(matrix: Matrix, right: Vector) -> Vector:
    """Gauss elimination; ZeroDivisionError where the matrix is singular."""
    n = len(right)
    rows = [[*matrix[i], right[i]] for i in range(n)]
    for k in range(n):
        pivot = next((i for i in range(k, n) if rows[i][k] != 0), k)
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [x / rows[k][k] for x in rows[k]]
        for i in range(n):
            if i != k and rows[i][k] != 0:
                rows[i] = [x - rows[i][k] * y for x, y in zip(rows[i], rows[k], strict=True)]
    return [row[n] for row in rows]


def dot(a: Vector, b: Vector) -> Fraction:
    """Sum of products."""
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def fractions(array: ArrayLike) -> Any:
    """A vector or a matrix as lists of fractions, exactly."""
    given = np.array(array, dtype=object)
    if given.ndim == 1:
        return [Fraction(x) for x in given]
    return [[Fraction(x) for x in row] for row in given]

"""Exact outcomes in rational arithmetic: Poisson's law at a few contacts, Newton's law with friction at one contact.

Poisson's law: both LCPs are solved by trying every set of pushing contacts. Friction: a tangential impulse α p_t is
added to Newton's normal impact; it changes no normal velocity. p_t sticks, or has size μ p_n against the slip after the
impact. α is the largest factor in [0, 1] without a gain of energy. It is rational except for one square root, which
ball arithmetic encloses. Sources: Kane and Levinson (1985) for the gain of energy; the module
`iapb.contact.kernels.impact_friction` for the split of the impulse.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from iapb.errors import SolverError

Vector = list[Fraction]
Matrix = list[Vector]
_ROOT_BITS = 400  # the error of α is at most 2⁻³⁸⁰, far below the precision of doubles


def exact_poisson(
    mass_matrix: ArrayLike, contact_jacobian: ArrayLike, velocity: ArrayLike, restitution: ArrayLike
) -> tuple[tuple[Fraction, ...], int]:
    """Return v⁺ exactly and the number of contacts that push.

    The two LCPs are compression, `0 ≤ p_c ⟂ γ_c ≥ 0`, and restitution, `0 ≤ p_e − E p_c ⟂ γ⁺ ≥ 0` (docs/theory.md).
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
    """Solve 0 ≤ p ⟂ W p + q ≥ 0 by enumeration; for a Delassus matrix W some set of independent contacts solves it."""
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
    except ZeroDivisionError:  # dependent contacts: an independent set has the same effect
        return None
    p = [Fraction(0)] * len(q)
    for i, value in zip(chosen, active, strict=True):
        p[i] = value
    if min(p, default=Fraction(0)) < 0 or any(dot(row, p) + b < 0 for row, b in zip(W, q, strict=True)):
        return None
    return p


def solve(matrix: Matrix, right: Vector) -> Vector:
    """Solve a linear system by Gauss elimination; a singular matrix raises ZeroDivisionError."""
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
    """Return the scalar product."""
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def fractions(array: ArrayLike) -> Any:
    """Return a vector or a matrix as lists of exact fractions."""
    given = np.array(array, dtype=object)
    if given.ndim == 1:
        return [Fraction(x) for x in given]
    return [[Fraction(x) for x in row] for row in given]


class FrictionalImpact:
    """v⁺ = v + (normal part) + α p_t b, where b is the change of velocity by a unit of tangential impulse."""

    def __init__(
        self, mass_matrix: ArrayLike, normal: ArrayLike, tangent: ArrayLike, velocity: ArrayLike,
        restitution: float, friction: float,
    ) -> None:  # fmt: skip
        self.mass, self.v = fractions(mass_matrix), fractions(velocity)
        (n,), (t,) = fractions(normal), fractions(tangent)
        self.e, mu = Fraction(restitution), Fraction(friction)
        to_n, to_t = solve(self.mass, n), solve(self.mass, t)  # M⁻¹ nᵀ, M⁻¹ tᵀ
        self.w, self.gamma = dot(n, to_n), dot(n, self.v)
        across = dot(n, to_t) / self.w
        p_n = -(1 + self.e) * self.gamma / self.w
        self.normal = [p_n * x for x in to_n]
        self.b = [x - across * y for x, y in zip(to_t, to_n, strict=True)]
        slip = dot(t, self.v) + dot(t, self.normal)
        self.p_t = _coulomb(slip, dot(t, self.b), p_n, across, mu)

    def velocity(self, share: Fraction) -> tuple[Fraction, ...]:
        """Return v⁺ with this share of the tangential impulse."""
        parts = zip(self.v, self.normal, self.b, strict=True)
        return tuple(v + x + share * self.p_t * y for v, x, y in parts)

    def passive_share(self) -> Fraction:
        """Return the largest α in [0, 1] such that the impact gains no energy.

        α satisfies ½ s α² + a α <= loss of the normal part; s = `square`, a = `along`.
        """
        metric = [dot(row, self.b) for row in self.mass]
        square, along = self.p_t**2 * dot(metric, self.b), self.p_t * dot(metric, self.v)
        lost = (1 - self.e**2) * self.gamma**2 / (2 * self.w)
        if square / 2 + along <= lost:
            return Fraction(1)
        return (_certified_root(along**2 + 2 * square * lost) - along) / square


def _coulomb(slip: Fraction, inertia: Fraction, p_n: Fraction, across: Fraction, mu: Fraction) -> Fraction:
    """Return p_t: the sticking impulse if it lies in the friction cone, else μ p_n against the remaining slip."""
    stick = -slip / inertia
    if abs(stick) <= mu * (p_n - across * stick):
        return stick
    for sign in (1, -1):  # p_t = −sign μ p_n(p_t)
        p_t = -sign * mu * p_n / (1 - sign * mu * across)
        if (slip + inertia * p_t) * sign > 0 and p_n - across * p_t > 0:
            return p_t
    raise ArithmeticError("the contact neither sticks nor slips: this exact law has no solution here")


def _certified_root(square: Fraction) -> Fraction:
    """Return the square root as the midpoint of a ball with a certified radius."""
    import flint

    before = flint.ctx.prec
    try:
        flint.ctx.prec = _ROOT_BITS
        ball: Any = flint.arb(flint.fmpq(square.numerator, square.denominator)).sqrt()
        if not ball.rel_accuracy_bits() > _ROOT_BITS - 20:
            raise ArithmeticError(f"the interval of the square root is too wide at {_ROOT_BITS} bits")
        mantissa, exponent = ball.mid().man_exp()
    finally:
        flint.ctx.prec = before
    return Fraction(int(mantissa)) * Fraction(2) ** int(exponent)

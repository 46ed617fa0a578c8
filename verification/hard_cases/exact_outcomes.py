"""Exact outcomes in rational arithmetic: Poisson's law at a few contacts, Newton's law with
friction at one contact.

Poisson's law: both LCPs are solved by trying every set of pushing contacts. Friction: a tangential
impulse α p_t is added to Newton's normal impact; it changes no normal velocity. p_t sticks, or has
size μ p_n against the slip after the impact. α is the largest factor in [0, 1] without a gain of
energy. It is rational except for one square root, of which 400 bits are computed. Sources: Kane and
Levinson (1985) for the gain of energy; the module `iapb.contact.kernels.impact_friction` for the
split of the impulse.
"""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import combinations
from typing import Any

from numpy.typing import ArrayLike

from iapb.errors import SolverError
from reference.exact import Rational, fractions_of, rational_matrix

_ROOT_BITS = 400  # far below the precision of doubles


def exact_poisson(
    mass_matrix: ArrayLike, contact_jacobian: ArrayLike, velocity: ArrayLike, restitution: ArrayLike
) -> tuple[tuple[Fraction, ...], int]:
    """Return v⁺ exactly and the number of contacts that push.

    The two LCPs are compression, `0 ≤ p_c ⟂ γ_c ≥ 0`, and restitution, `0 ≤ p_e − E p_c ⟂ γ⁺ ≥ 0`
    (docs/theory.md).
    """
    M = rational_matrix("mass_matrix", mass_matrix)
    J = rational_matrix("contact_jacobian", contact_jacobian)
    v = rational_matrix("velocity", velocity)
    e = rational_matrix("restitution", restitution).entries()
    columns = M.solve(J.transpose())  # M⁻¹Jᵀ, one column per contact
    W = J * columns
    gamma = J * v
    compression = _lcp(W, gamma)
    returned = _column(
        J, [p + share * p for p, share in zip(compression.entries(), e, strict=True)]
    )
    impulse = returned + _lcp(W, gamma + W * returned)
    return fractions_of(v + columns * impulse), sum(p > 0 for p in impulse.entries())


def _column(like: Rational, entries: list[Any]) -> Rational:
    return type(like)(len(entries), 1, entries)


def _lcp(W: Rational, q: Rational) -> Rational:
    """Solve 0 ≤ p ⟂ W p + q ≥ 0 by enumeration; for a Delassus matrix W some set of independent
    contacts solves it."""
    n = q.nrows()
    make = type(W)
    for chosen in (chosen for size in range(n + 1) for chosen in combinations(range(n), size)):
        p = [0 * q[0, 0]] * n
        size = len(chosen)
        if chosen:
            try:
                block = make(size, size, [W[i, j] for i in chosen for j in chosen])
                active = block.solve(_column(W, [-q[i, 0] for i in chosen])).entries()
            except ZeroDivisionError:  # dependent contacts: an independent set has the same effect
                continue
            for i, value in zip(chosen, active, strict=True):
                p[i] = value
        if min(p) >= 0 and min((W * _column(W, p) + q).entries()) >= 0:
            return _column(W, p)
    raise SolverError(
        "the complementarity problem has no solution among sets of independent contacts"
    )


class FrictionalImpact:
    """v⁺ = v + (normal part) + α p_t b, where b is the change of velocity by a unit of tangential
    impulse."""

    def __init__(
        self,
        mass_matrix: ArrayLike,
        normal: ArrayLike,
        tangent: ArrayLike,
        velocity: ArrayLike,
        restitution: float,
        friction: float,
    ) -> None:
        self.mass = rational_matrix("mass_matrix", mass_matrix)
        self.v = rational_matrix("velocity", velocity)
        n = rational_matrix("normal", normal)
        t = rational_matrix("tangent", tangent)
        self.e, mu = rational_matrix("coefficients", [restitution, friction]).entries()
        to_n = self.mass.solve(n.transpose())
        to_t = self.mass.solve(t.transpose())
        self.w = (n * to_n)[0, 0]
        self.gamma = (n * self.v)[0, 0]
        across = (n * to_t)[0, 0] / self.w
        p_n = -(1 + self.e) * self.gamma / self.w
        self.normal = to_n * p_n
        self.b = to_t - to_n * across
        self.p_t = _coulomb((t * (self.v + self.normal))[0, 0], (t * self.b)[0, 0], p_n, across, mu)

    def velocity(self, share: Any) -> tuple[Fraction, ...]:
        """Return v⁺ with this share of the tangential impulse."""
        return fractions_of(self.v + self.normal + self.b * (share * self.p_t))

    def passive_share(self) -> Any:
        """Return the largest α in [0, 1] such that the impact gains no energy.

        α satisfies ½ s α² + a α <= loss of the normal part; s = `square`, a = `along`.
        """
        metric = (self.mass * self.b).transpose()
        square = self.p_t**2 * (metric * self.b)[0, 0]
        along = self.p_t * (metric * self.v)[0, 0]
        lost = (1 - self.e**2) * self.gamma**2 / (2 * self.w)
        if square / 2 + along <= lost:
            return 1
        return (_root(along**2 + 2 * square * lost) - along) / square


def _coulomb(slip: Any, inertia: Any, p_n: Any, across: Any, mu: Any) -> Any:
    """Return p_t: the sticking impulse if it lies in the friction cone, else μ p_n against the
    remaining slip."""
    stick = -slip / inertia
    if abs(stick) <= mu * (p_n - across * stick):
        return stick
    for sign in (1, -1):  # p_t = −sign μ p_n(p_t)
        p_t = -sign * mu * p_n / (1 - sign * mu * across)
        if (slip + inertia * p_t) * sign > 0 and p_n - across * p_t > 0:
            return p_t
    raise ArithmeticError(
        "the contact neither sticks nor slips: this exact law has no solution here"
    )


def _root(square: Any) -> Any:
    """Return the square root of a rational number p / q, rounded down to a multiple of
    2⁻⁴⁰⁰ / q."""
    p = int(square.p)
    q = int(square.q)
    return type(square)(math.isqrt(p * q << 2 * _ROOT_BITS), q << _ROOT_BITS)

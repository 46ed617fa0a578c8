"""A hard case with Coulomb friction at one contact, and its truth: rational but for one root, which a ball certifies.

The law is Newton's normal impact plus a tangential impulse p_t (stick, or slip against the motion after it at
μ p_n) whose effect keeps every normal velocity; the whole is reduced by the largest α in [0, 1] that gains no energy.
Source: Kane and Levinson (1985) for the gain; `iapb.contact.impact_laws` for the split.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

from verification.hard_cases.case import Floats, HardCase, Truth
from verification.hard_cases.poisson import dot, fractions, solve

_ROOT_BITS = 400  # α is known to 2⁻³⁸⁰ or better: far below what a double can tell


@dataclass(frozen=True)
class FrictionalCase(HardCase):
    """One contact with its tangent row (1, d) and coefficient μ."""

    tangent: Floats = field(kw_only=True)
    friction: float = field(kw_only=True)
    law = "Newton's law with Coulomb friction, reduced to no gain: rational arithmetic, the root by ball arithmetic"

    @cached_property
    def truth(self) -> Truth:
        """Exact v⁺ up to the certified root."""
        from reference.exact import condition_number, row_condition_number

        found = _Split(self)
        velocity = found.velocity(found.passive_share())
        both = np.vstack([self.contact_jacobian, self.tangent])  # friction is as sensitive as both rows together
        conditions = condition_number(self.mass_matrix), row_condition_number(self.mass_matrix, both)
        return Truth(velocity, 1, *conditions)

    def newton_with_coulomb(self) -> tuple[Fraction, ...]:
        """v⁺ without the reduction: what Kane and Levinson's equations say."""
        return _Split(self).velocity(Fraction(1))


class _Split:
    """v⁺ = v + (normal part) + α p_t b, with b the motion that one unit of tangential impulse adds."""

    def __init__(self, case: FrictionalCase) -> None:
        self.mass, self.v = fractions(case.mass_matrix), fractions(case.velocity)
        (n,), (t,) = fractions(case.contact_jacobian), fractions(case.tangent)
        self.e, mu = Fraction(float(case.restitution)), Fraction(case.friction)
        to_n, to_t = solve(self.mass, n), solve(self.mass, t)  # M⁻¹ nᵀ, M⁻¹ tᵀ
        self.w, self.gamma = dot(n, to_n), dot(n, self.v)
        across = dot(n, to_t) / self.w
        p_n = -(1 + self.e) * self.gamma / self.w
        self.normal = [p_n * x for x in to_n]
        self.b = [x - across * y for x, y in zip(to_t, to_n, strict=True)]
        slip = dot(t, self.v) + dot(t, self.normal)
        self.p_t = _coulomb(slip, dot(t, self.b), p_n, across, mu)

    def velocity(self, share: Fraction) -> tuple[Fraction, ...]:
        """v⁺ with that share of the tangential impulse."""
        parts = zip(self.v, self.normal, self.b, strict=True)
        return tuple(v + x + share * self.p_t * y for v, x, y in parts)

    def passive_share(self) -> Fraction:
        """Largest α in [0, 1] with ½ s α² + a α <= loss of the normal part."""
        metric = [dot(row, self.b) for row in self.mass]
        square, along = self.p_t**2 * dot(metric, self.b), self.p_t * dot(metric, self.v)
        lost = (1 - self.e**2) * self.gamma**2 / (2 * self.w)
        if square / 2 + along <= lost:
            return Fraction(1)
        return (_certified_root(along**2 + 2 * square * lost) - along) / square


def _coulomb(slip: Fraction, inertia: Fraction, p_n: Fraction, across: Fraction, mu: Fraction) -> Fraction:
    """p_t: stick where the cone allows, else slip against the motion that is left."""
    stick = -slip / inertia
    if abs(stick) <= mu * (p_n - across * stick):
        return stick
    for sign in (1, -1):  # p_t = −sign μ p_n(p_t)
        p_t = -sign * mu * p_n / (1 - sign * mu * across)
        if (slip + inertia * p_t) * sign > 0 and p_n - across * p_t > 0:
            return p_t
    raise ArithmeticError("neither stick nor slip: not a case of this law")


def _certified_root(square: Fraction) -> Fraction:
    """The square root, as the middle of a ball whose radius is certified."""
    import flint

    before = flint.ctx.prec
    try:
        flint.ctx.prec = _ROOT_BITS
        ball: Any = flint.arb(flint.fmpq(square.numerator, square.denominator)).sqrt()
        if not ball.rel_accuracy_bits() > _ROOT_BITS - 20:
            raise ArithmeticError("the root's ball is wide")
        mantissa, exponent = ball.mid().man_exp()
    finally:
        flint.ctx.prec = before
    return Fraction(int(mantissa)) * Fraction(2) ** int(exponent)

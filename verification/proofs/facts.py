"""What a proof may assume or conclude: equations and non-negativity, each a plain record with its own name."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from verification.proofs.algebra import Expression, Operand, expression


@dataclass(frozen=True)
class Equation:
    """lhs = rhs, for all values of the letters that satisfy the other facts."""

    name: str
    lhs: Expression
    rhs: Expression

    @cached_property
    def difference(self) -> Expression:
        return self.lhs - self.rhs

    @cached_property
    def T(self) -> Equation:
        """The transposed equation, as good as the equation itself."""
        return Equation(f"({self.name})ᵀ", self.lhs.T, self.rhs.T)

    @property
    def expressions(self) -> tuple[Expression, ...]:
        return (self.lhs, self.rhs)


@dataclass(frozen=True)
class NonNegative:
    """value >= 0: a commuting scalar or a 1 x 1 product as a number, a square matrix in the Loewner order
    (x' value x >= 0 for every x)."""

    name: str
    value: Expression

    @property
    def expressions(self) -> tuple[Expression, ...]:
        return (self.value,)


@dataclass(frozen=True)
class Definite:
    """x' value x > 0 for every x other than 0."""

    name: str
    value: Expression

    @property
    def expressions(self) -> tuple[Expression, ...]:
        return (self.value,)


@dataclass(frozen=True)
class Entrywise:
    """Every entry of a vector or matrix is >= 0 (impulses that only push, restitution between 0 and 1, ...)."""

    name: str
    value: Expression

    @property
    def expressions(self) -> tuple[Expression, ...]:
        return (self.value,)


@dataclass(frozen=True)
class Nonzero:
    """A commuting scalar is not 0."""

    name: str
    value: Expression

    @property
    def expressions(self) -> tuple[Expression, ...]:
        return (self.value,)


Fact = Equation | NonNegative | Definite | Entrywise | Nonzero


def equation(name: str, lhs: Operand, rhs: Operand) -> Equation:
    """An equation whose sides may be plain numbers (multiples of the identity, or zero)."""
    return Equation(name, expression(lhs), expression(rhs))

"""The free algebra in which operator identities are checked.

An `Expression` is a finite sum  coefficient * scalars * word.  A word is a product of letters, which do not commute
(matrices of a *named* size such as c x d, never a number); the scalars (e, alpha, ...) commute. Two expressions are
equal only if they have the same terms; no simplifier, numeric size or sample is used. A product with unequal inner
sizes raises an error, and so does a sum of different shapes.

One rule goes beyond the free algebra: a 1 x 1 product equals its own transpose, so `canonical` brings words of that
shape to one order.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

from iapb.errors import ArgumentError

ANY = "*"  # the size of a multiple of the identity, which fits every square shape


class Letter(NamedTuple):
    """A matrix (or vector) as a letter: its name, the names of its sizes, and whether it is transposed."""

    name: str
    rows: str
    cols: str
    flipped: bool = False

    @property
    def transposed(self) -> Letter:
        return Letter(self.name, self.cols, self.rows, not self.flipped)


Word = tuple[Letter, ...]
Scalars = tuple[str, ...]  # a commutative monomial: its factors sorted, each as often as it occurs
Term = tuple[Scalars, Word]


@dataclass(frozen=True, eq=False)
class Expression:
    """Sum of terms of one shape; `terms` maps (scalars, word) to a nonzero rational coefficient."""

    terms: dict[Term, Fraction]
    rows: str = ANY
    cols: str = ANY

    def __add__(self, other: Operand) -> Expression:
        other = expression(other)
        rows, cols = _common_shape(self, other)
        total: defaultdict[Term, Fraction] = defaultdict(Fraction)
        for part in (self.terms, other.terms):
            for term, coefficient in part.items():
                total[term] += coefficient
        return Expression({t: k for t, k in total.items() if k}, rows, cols)

    def __mul__(self, other: Operand) -> Expression:
        other = expression(other)
        rows, cols = _product_shape(self, other)
        total: defaultdict[Term, Fraction] = defaultdict(Fraction)
        for (scalars, word), k in self.terms.items():
            for (more_scalars, more_word), factor in other.terms.items():
                total[tuple(sorted(scalars + more_scalars)), word + more_word] += k * factor
        return Expression({t: k for t, k in total.items() if k}, rows, cols)

    def __neg__(self) -> Expression:
        return expression(-1) * self

    def __sub__(self, other: Operand) -> Expression:
        return self + (-expression(other))

    def __rsub__(self, other: Operand) -> Expression:
        return expression(other) - self

    def __radd__(self, other: Operand) -> Expression:
        return self + other

    def __rmul__(self, other: Operand) -> Expression:
        return expression(other) * self

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Expression | int | Fraction) and expression(other).terms == self.terms

    def __hash__(self) -> int:
        return hash(frozenset(self.terms.items()))

    @property
    def T(self) -> Expression:
        """The transpose: every word is reversed and every letter flipped."""
        flipped = {(scalars, transposed(word)): k for (scalars, word), k in self.terms.items()}
        return Expression(flipped, self.cols, self.rows)

    @property
    def is_scalar(self) -> bool:
        return self.rows == self.cols == "1"

    @property
    def letters(self) -> set[Letter]:
        return {letter for _, word in self.terms for letter in word}

    def canonical(self) -> Expression:
        """Return the same value with every 1 x 1 word replaced by the smaller of itself and its transpose."""
        if not self.is_scalar:
            return self
        parts = ({(s, min(w, transposed(w))): k} for (s, w), k in self.terms.items())
        return sum((Expression(part, "1", "1") for part in parts), Expression({}, "1", "1"))

    def vanishes(self) -> bool:
        """Whether the expression is zero in the free algebra, with 1 x 1 words equal to their transposes."""
        return not self.canonical().terms

    def ordered(self) -> Iterator[tuple[Term, Fraction]]:
        """Return the terms in a fixed order for printing, short words first."""
        return iter(sorted(self.terms.items(), key=lambda item: (len(item[0][1]), item[0][0], item[0][1])))


Operand = Expression | int | Fraction


def expression(value: Operand) -> Expression:
    """Return an expression unchanged, or a rational number as a multiple of the identity."""
    if isinstance(value, Expression):
        return value
    if isinstance(value, int | Fraction):
        return Expression({((), ()): Fraction(value)} if value else {})
    raise ArgumentError("value", value, "an Expression, an int or a Fraction; floats are not exact")


def matrix(name: str, rows: str, cols: str) -> Expression:
    """Return a letter of shape rows x cols; both sizes are names such as "c" and "d", or "1"."""
    return word_expression((Letter(name, rows, cols),))


def vector(name: str, size: str) -> Expression:
    """Return a column vector of the named size."""
    return matrix(name, size, "1")


def scalar(name: str) -> Expression:
    """Return a commuting real unknown."""
    return Expression({((name,), ()): Fraction(1)})


def word_expression(word: Word, scalars: Scalars = (), coefficient: Fraction = Fraction(1)) -> Expression:
    """Return an expression of one term; the first and the last letter of the word give its shape."""
    rows, cols = (word[0].rows, word[-1].cols) if word else (ANY, ANY)
    return Expression({(scalars, word): coefficient}, rows, cols)


def names_in(value: Expression) -> set[str]:
    """Return the names of all letters and scalars in the expression."""
    return {letter.name for letter in value.letters} | {name for scalars, _ in value.terms for name in scalars}


def transposed(word: Word) -> Word:
    """Return the transpose of a word: the reversed word with each letter flipped."""
    return tuple(letter.transposed for letter in reversed(word))


def _product_shape(left: Expression, right: Expression) -> tuple[str, str]:
    if left.cols == ANY:
        return right.rows, right.cols
    if right.rows == ANY:
        return left.rows, left.cols
    if left.cols != right.rows:
        shapes = f"{left.rows}x{left.cols} times {right.rows}x{right.cols}"
        raise ArgumentError("product", shapes, "inner sizes that agree")
    return left.rows, right.cols


def _common_shape(left: Expression, right: Expression) -> tuple[str, str]:
    shapes = [(part.rows, part.cols) for part in (left, right) if part.rows != ANY]
    lone_identity = len(shapes) == 1 and shapes[0][0] != shapes[0][1] and left.terms and right.terms
    if len(set(shapes)) > 1 or lone_identity:
        raise ArgumentError("sum", f"{left.rows}x{left.cols} + {right.rows}x{right.cols}", "equal shapes")
    return shapes[0] if shapes else (ANY, ANY)


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
        """The transposed equation, which is equivalent to the equation."""
        return Equation(f"({self.name})ᵀ", self.lhs.T, self.rhs.T)

    @property
    def expressions(self) -> tuple[Expression, ...]:
        return (self.lhs, self.rhs)


@dataclass(frozen=True)
class _About:
    """A fact about one expression."""

    name: str
    value: Expression

    @property
    def expressions(self) -> tuple[Expression, ...]:
        return (self.value,)


@dataclass(frozen=True)
class NonNegative(_About):
    """value >= 0: a commuting scalar or a 1 x 1 product as a number, a square matrix in the Loewner order
    (x' value x >= 0 for every x)."""


@dataclass(frozen=True)
class Definite(_About):
    """x' value x > 0 for every x other than 0."""


@dataclass(frozen=True)
class Entrywise(_About):
    """Every entry of a vector or matrix is >= 0 (impulses that only push, restitution between 0 and 1, ...)."""


@dataclass(frozen=True)
class Nonzero(_About):
    """A commuting scalar is not 0."""


Fact = Equation | NonNegative | Definite | Entrywise | Nonzero


def equation(name: str, lhs: Operand, rhs: Operand) -> Equation:
    """Return an equation; its sides may be plain numbers (multiples of the identity, or zero)."""
    return Equation(name, expression(lhs), expression(rhs))

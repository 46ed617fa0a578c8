"""Words of matrix letters, facts about them, and the reader of formulas as text.

An `Expression` is a finite sum  coefficient * scalars * word.  A word is a product of letters,
which do not commute (matrices of a *named* size such as c x d, never a number); the scalars (e, α,
...) commute. Two expressions are equal only if they have the same terms; no simplifier, numeric
size or sample is used. A product with unequal inner sizes raises an error, and so does a sum of
different shapes.

One rule goes beyond the free algebra: a 1 x 1 product equals its own transpose (`vanishes`).
"""

from __future__ import annotations

import re
from collections import defaultdict, deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, reduce
from itertools import groupby
from typing import NamedTuple

from iapb.errors import ArgumentError

ANY = "*"  # the size of a multiple of the identity, which fits every square shape
_POWERS = "⁰¹²³⁴⁵⁶⁷⁸⁹"
_RAISED = str.maketrans("0123456789", _POWERS)


class Letter(NamedTuple):
    """A matrix (or vector) as a letter: its name, the names of its sizes, and whether it is
    transposed."""

    name: str
    rows: str
    cols: str
    flipped: bool = False


Word = tuple[Letter, ...]
Scalars = tuple[str, ...]  # a commutative monomial: its factors sorted, each as often as it occurs
Term = tuple[Scalars, Word]


@dataclass(frozen=True)
class Expression:
    """Sum of terms of one shape; `terms` maps (scalars, word) to a nonzero rational coefficient."""

    terms: dict[Term, Fraction]
    rows: str = ANY
    cols: str = ANY

    def __add__(self, other: Expression) -> Expression:
        shapes = {(part.rows, part.cols) for part in (self, other) if part.terms}
        sized = shapes - {(ANY, ANY)}
        if len(sized) > 1 or (len(shapes) > 1 and any(rows != cols for rows, cols in sized)):
            raise ArgumentError(
                "sum", f"{self.rows}x{self.cols} + {other.rows}x{other.cols}", "equal shapes"
            )
        return _collected(
            [*self.terms.items(), *other.terms.items()], *next(iter(sized), (ANY, ANY))
        )

    def __mul__(self, other: Expression) -> Expression:
        if ANY not in (self.cols, other.rows) and self.cols != other.rows:
            shapes = f"{self.rows}x{self.cols} times {other.rows}x{other.cols}"
            raise ArgumentError("product", shapes, "inner sizes that agree")
        terms = [
            ((tuple(sorted(scalars + more)), word + next_word), k * factor)
            for (scalars, word), k in self.terms.items()
            for (more, next_word), factor in other.terms.items()
        ]
        return _collected(
            terms,
            other.rows if self.rows == ANY else self.rows,
            self.cols if other.cols == ANY else other.cols,
        )

    def __neg__(self) -> Expression:
        return number(-1) * self

    def __sub__(self, other: Expression) -> Expression:
        return self + -other

    @cached_property
    def T(self) -> Expression:
        """The transpose: every word is reversed and every letter flipped."""
        return Expression(
            {(s, transposed(w)): k for (s, w), k in self.terms.items()}, self.cols, self.rows
        )

    @property
    def is_number(self) -> bool:
        """Whether it is a commuting scalar or a 1 x 1 product."""
        return self.rows == self.cols and self.rows in ("1", ANY)

    def vanishes(self) -> bool:
        """Whether it is zero in the free algebra, with 1 x 1 words equal to their transposes."""
        return not (self + self.T if self.rows == self.cols == "1" else self).terms

    def ordered(self) -> list[tuple[Term, Fraction]]:
        """Return the terms in a fixed order, short words first."""
        return sorted(
            self.terms.items(), key=lambda item: (len(item[0][1]), item[0][0], item[0][1])
        )

    def __str__(self) -> str:
        """Return the sum as text on one line, which the reader reads again."""
        pieces: list[str] = []
        # a bare number among matrices is a multiple of the identity
        unit = [] if self.rows in (ANY, "1") else ["I"]
        for (scalars, word), coefficient in self.ordered():
            counts = [(name, len(list(group))) for name, group in groupby(scalars)]
            factors = [name + str(power).translate(_RAISED) * (power > 1) for name, power in counts]
            factors += [each.name + "ᵀ" * each.flipped for each in word] or unit
            size = [] if abs(coefficient) == 1 and factors else [str(abs(coefficient))]
            sign = "−" if coefficient < 0 else "+" if pieces else ""
            pieces.append((f" {sign} " if pieces else sign) + " ".join(size + factors))
        return "".join(pieces) or "0"


def _collected(terms: Iterable[tuple[Term, Fraction]], rows: str, cols: str) -> Expression:
    total: defaultdict[Term, Fraction] = defaultdict(Fraction)
    for term, coefficient in terms:
        total[term] += coefficient
    return Expression({term: k for term, k in total.items() if k}, rows, cols)


def number(value: Fraction | int) -> Expression:
    """Return a multiple of the identity."""
    return Expression({((), ()): Fraction(value)} if value else {})


ONE = number(1)


def letter(name: str, rows: str = ANY, cols: str = ANY) -> Expression:
    """Return a letter of shape rows x cols, or a commuting scalar if no sizes are given."""
    return of_word((), (name,)) if rows == ANY else of_word((Letter(name, rows, cols),))


def of_word(word: Word, scalars: Scalars = (), coefficient: Fraction = Fraction(1)) -> Expression:
    """Return an expression of one term; the first and the last letter of the word give its
    shape."""
    return Expression(
        {(scalars, word): coefficient}, *((word[0].rows, word[-1].cols) if word else (ANY, ANY))
    )


def product(factors: Iterable[Expression]) -> Expression:
    """Return the product of the factors, in their order."""
    return reduce(Expression.__mul__, factors, ONE)


def transposed(word: Word) -> Word:
    """Return the word reversed, with every letter flipped."""
    return tuple(
        Letter(each.name, each.cols, each.rows, not each.flipped) for each in reversed(word)
    )


def names_in(value: Expression) -> set[str]:
    """Return the names of all letters and scalars in the expression."""
    return {
        name for scalars, word in value.terms for name in (*scalars, *(each.name for each in word))
    }


@dataclass(frozen=True)
class Fact:
    """A relation for all values of the letters that satisfy the other facts; all but an equation
    compare with 0.

    = equal, ≠ not 0 (of a matrix: some entry is not 0), ≥ a number or every entry of a matrix is not negative, ⪰ x'
    value x >= 0 for every x, ≻ the same with > for every x other than 0.
    """

    name: str
    lhs: Expression
    relation: str
    rhs: Expression = number(0)

    @cached_property
    def difference(self) -> Expression:
        return self.lhs - self.rhs

    @cached_property
    def T(self) -> Fact:
        """The transposed equation, which is equivalent to the equation."""
        return Fact(f"({self.name})ᵀ", self.lhs.T, self.relation, self.rhs.T)

    @property
    def entrywise(self) -> bool:
        return self.relation == "≥" and not self.difference.is_number

    def __str__(self) -> str:
        # then 1 stands for the identity matrix
        identity = self.rhs == ONE and self.lhs.rows not in (ANY, "1")
        return f"{self.lhs} {self.relation} {'I' if identity else self.rhs}"


_RELATION = re.compile(r"\s*([=≠≤≥⪯⪰≻])\s*")
_SIGNS = {"+": 1, "−": -1, "-": -1}
_ENDS = (")", "]", "=", "")
Product = tuple[Expression | Fact, ...]


class Reader:
    """Reads formulas whose names are letters, scalars or abbreviations, each given by its
    expression.

    A product is written without a sign, ᵀ transposes, I is the identity; [a = b] in a product
    stands for a − b.
    """

    def __init__(self, names: Mapping[str, Expression]) -> None:
        self.names = {"I": ONE, **names}
        words = "|".join(re.escape(name) for name in sorted(self.names, key=len, reverse=True))
        self._token = re.compile(rf"\s*({words}|\d+(?:/0*[1-9]\d*)?|\S)")

    def expression(self, text: str) -> Expression:
        """Return the value of a sum."""
        return _total(self.products(text))

    def fact(self, text: str, name: str = "") -> Fact:
        """Return the fact; its name is by default its text."""
        parts = _RELATION.split(text.strip())
        if len(parts) != 3:
            raise ArgumentError("formula", text, "two sides and one of = ≠ ≤ ≥ ⪯ ⪰ ≻")
        left = self.expression(parts[0])
        relation = parts[1]
        right = self.expression(parts[2])
        if relation != "=":
            left = right - left if relation in "≤⪯" else left - right
            right = number(0)
            relation = {"≤": "≥", "⪯": "⪰"}.get(relation, relation)
        if relation in "⪰≻" and left.rows != left.cols:
            raise ArgumentError("formula", text, "a square matrix")
        return Fact(name or text.strip(), left, relation, right)

    def products(self, text: str) -> list[Product]:
        """Return the terms of a sum, each as the factors of its product."""
        return self._sum(deque([*self._token.findall(text), ""]), "")

    def _sum(self, tokens: deque[str], end: str) -> list[Product]:
        """Read up to the token `end`."""
        found: list[Product] = []
        while True:
            sign = _SIGNS[tokens.popleft()] if tokens[0] in _SIGNS else 0
            factors: list[Expression | Fact] = []
            while tokens[0] not in _ENDS and tokens[0] not in _SIGNS:
                factors += self._factor(tokens)
            if not factors or (found and not sign):
                raise ArgumentError("formula", tokens[0], "a sum of products")
            found.append((*[-ONE] * (sign < 0), *factors))
            if tokens[0] in _ENDS:
                if (token := tokens.popleft()) != end:
                    raise ArgumentError("formula", token, f"{end or 'the end'} there")
                return found

    def _factor(self, tokens: deque[str]) -> list[Expression | Fact]:
        token = tokens.popleft()
        if token == "[":
            return [Fact("", _total(self._sum(tokens, "=")), "=", _total(self._sum(tokens, "]")))]
        if token == "(":
            value = _total(self._sum(tokens, ")"))
        elif token in self.names:
            value = self.names[token]
        elif token[0].isdecimal():
            value = number(Fraction(token))
        else:
            raise ArgumentError("formula", token, f"one of {' '.join(self.names)}")
        while tokens[0] == "ᵀ":
            tokens.popleft()
            value = value.T
        power = ""
        while tokens[0] and tokens[0] in _POWERS:
            power += str(_POWERS.index(tokens.popleft()))
        if power.startswith("0"):
            raise ArgumentError("formula", f"the power {power}", "a power of at least 1")
        return [value] * int(power or 1)


def _total(products: Iterable[Product]) -> Expression:
    parts = (
        product(x.difference if isinstance(x, Fact) else x for x in factors) for factors in products
    )
    return reduce(Expression.__add__, parts)

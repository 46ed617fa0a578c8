"""The permitted proof steps. Expansion or exact arithmetic checks each step.

Identity      claim.lhs - claim.rhs = sum of  left * (equation.lhs - equation.rhs) * right   (cofactor certificate)
Positivity    claim.value = sum of non-negative terms + cofactors                            (sum of squares)
Cancelling    N' G N = 0 (or <= 0) with G positive definite, hence N = 0
Dominating    q x >= x² with q >= 0, hence x >= 0
Exact         a relation between two rational numbers

A step raises `Refused` if its certificate does not expand to zero, or if it uses a fact that is not established yet.
"""

from __future__ import annotations

import operator
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

from iapb.errors import IapbError
from verification.proofs.algebra import (
    Definite,
    Entrywise,
    Equation,
    Expression,
    Fact,
    NonNegative,
    Nonzero,
    Operand,
    Scalars,
    Word,
    expression,
    transposed,
    word_expression,
)

RELATIONS = {"=": operator.eq, "≠": operator.ne, "<": operator.lt, "≤": operator.le, ">": operator.gt, "≥": operator.ge}


class Refused(IapbError):
    """Error: a step does not follow from its certificate."""


@dataclass(frozen=True)
class Cofactor:
    """One term  left * (equation.lhs - equation.rhs) * right  of a certificate; the equation makes it zero."""

    left: Expression
    equation: Equation
    right: Expression

    @property
    def value(self) -> Expression:
        return self.left * self.equation.difference * self.right


@dataclass(frozen=True)
class Square:
    """half' core half, which is non-negative if the core is (without a core: the identity)."""

    half: Expression
    core: Definite | NonNegative | None = None

    @property
    def value(self) -> Expression:
        core = expression(1) if self.core is None else self.core.value
        return self.half.T * core * self.half

    @property
    def facts(self) -> tuple[Fact, ...]:
        return () if self.core is None else (self.core,)


@dataclass(frozen=True)
class Pairing:
    """left' core right, which is non-negative if all three are so entrywise (without a core: the identity)."""

    left: Entrywise
    right: Entrywise
    core: Entrywise | None = None

    @property
    def value(self) -> Expression:
        core = expression(1) if self.core is None else self.core.value
        return self.left.value.T * core * self.right.value

    @property
    def facts(self) -> tuple[Fact, ...]:
        return (self.left, self.right) + (() if self.core is None else (self.core,))


@dataclass(frozen=True)
class Term:
    """weight * (product of non-negative scalars) * form; the weight is a positive rational."""

    weight: Fraction | int
    factors: tuple[NonNegative, ...] = ()
    form: Square | Pairing | NonNegative | None = None

    @property
    def value(self) -> Expression:
        product = expression(self.weight)
        for factor in self.factors:
            product = product * factor.value
        return product if self.form is None else product * self.form.value

    @property
    def facts(self) -> tuple[Fact, ...]:
        if isinstance(self.form, NonNegative):
            return (*self.factors, self.form)
        return self.factors if self.form is None else self.factors + self.form.facts


class Known:
    """The facts that a proof may use so far, and the names of those that it has used."""

    def __init__(self, facts: Iterable[Fact]) -> None:
        self._facts = list(facts)
        self.used: set[str] = set()

    def add(self, fact: Fact) -> None:
        self._facts.append(fact)

    def require(self, wanted: Fact) -> None:
        """Mark `wanted` as used; raise Refused unless it or its transpose is established."""
        for fact in self._facts:
            if fact == wanted or (isinstance(fact, Equation) and fact.T == wanted):
                self.used.add(fact.name)
                return
        raise Refused(f"the step uses '{wanted.name}', which no earlier step proves")


@dataclass(frozen=True)
class Identity:
    """An equation that follows from others by a cofactor certificate."""

    claim: Equation
    cofactors: tuple[Cofactor, ...] = ()
    because: str = ""

    def verify(self, known: Known) -> None:
        """Expand claim - sum of cofactors in the free algebra; raise Refused if the result is not zero."""
        for cofactor in self.cofactors:
            known.require(cofactor.equation)
        _require_zero(self.claim.name, self.claim.difference, self.cofactors)


@dataclass(frozen=True)
class Positivity:
    """value >= 0, because it is a sum of non-negative terms and of cofactors, which are zero."""

    claim: NonNegative
    terms: tuple[Term, ...]
    cofactors: tuple[Cofactor, ...] = ()
    because: str = ""

    def verify(self, known: Known) -> None:
        """Check that every term is non-negative, and that the terms and cofactors add up to the claim."""
        remainder = self.claim.value
        for term in self.terms:
            if term.weight <= 0:
                raise Refused(f"'{self.claim.name}': the weight {term.weight} is not positive")
            if any(factor.value.rows != "*" for factor in term.factors):
                raise Refused(f"'{self.claim.name}': a factor that is not a commuting scalar")
            if isinstance(term.form, Pairing) and not term.form.value.is_scalar:
                raise Refused(f"'{self.claim.name}': entrywise products only prove that a scalar is not negative")
            for fact in term.facts:
                known.require(fact)
            remainder = remainder - term.value
        for cofactor in self.cofactors:
            known.require(cofactor.equation)
        _require_zero(self.claim.name, remainder, self.cofactors)


@dataclass(frozen=True)
class Cancelling:
    """N = 0, because N' G N = 0 or -N' G N >= 0 with G positive definite (without a G: the identity)."""

    claim: Equation
    square: Equation | NonNegative
    definite: Definite | None = None
    because: str = "a positive definite form vanishes only at zero"

    def verify(self, known: Known) -> None:
        known.require(self.square)
        if self.definite is not None:
            known.require(self.definite)
        form = Square(self.claim.difference, self.definite).value
        value = self.square.difference if isinstance(self.square, Equation) else -self.square.value
        if not (form - value).vanishes():
            raise Refused(f"'{self.claim.name}': the square does not match")


@dataclass(frozen=True)
class Dividing:
    """N = 0, because s N = 0 and the scalar s is not zero."""

    claim: Equation
    product: Equation
    divisor: Nonzero
    because: str = "a non-zero scalar may be divided out"

    def verify(self, known: Known) -> None:
        known.require(self.product)
        known.require(self.divisor)
        if not (self.divisor.value * self.claim.difference - self.product.difference).vanishes():
            raise Refused(f"'{self.claim.name}': the product does not match")


@dataclass(frozen=True)
class Dominating:
    """x >= 0, because q x - x² >= 0 with q >= 0 (all scalars)."""

    claim: NonNegative
    factor: NonNegative
    product: NonNegative
    because: str = "x < 0 would make q x ≤ 0 < x²"

    def verify(self, known: Known) -> None:
        known.require(self.factor)
        known.require(self.product)
        q, x = self.factor.value, self.claim.value
        if not (q.rows == x.rows == "*" and (q * x - x * x - self.product.value).vanishes()):
            raise Refused(f"'{self.claim.name}': the product does not match")


@dataclass(frozen=True)
class Exact:
    """A relation between two computed rationals; `says` describes the comparison."""

    says: str
    left: Fraction
    relation: str
    right: Fraction
    claim: None = field(default=None, init=False)
    because: str = ""

    @property
    def is_true(self) -> bool:
        return bool(RELATIONS[self.relation](self.left, self.right))

    def verify(self, known: Known) -> None:
        del known
        if not self.is_true:
            raise Refused(f"'{self.says}': {self.left} {self.relation} {self.right} is false")


Step = Identity | Positivity | Cancelling | Dividing | Dominating | Exact


def _require_zero(name: str, value: Expression, cofactors: Iterable[Cofactor]) -> None:
    for cofactor in cofactors:
        value = value - cofactor.value
    if not value.vanishes():
        raise Refused(f"'{name}': {len(value.canonical().terms)} terms remain after the certificate is expanded")


MOST_REPLACEMENTS = 2000  # a proof needs some dozens; beyond this limit the rules run in a circle


def rewritten(value: Expression, rules: Sequence[Equation]) -> tuple[Expression, tuple[Cofactor, ...]]:
    """Apply the rules until none matches; return rest and cofactors with value = rest + sum of cofactors."""
    cofactors: list[Cofactor] = []
    for _ in range(MOST_REPLACEMENTS):
        cofactor = _first_match(value, rules)
        if cofactor is None:
            return value, tuple(cofactors)
        cofactors.append(cofactor)
        value = value - cofactor.value
    raise Refused(f"the rewriting rules form a cycle: more than {MOST_REPLACEMENTS} replacements")


def identity(
    name: str,
    lhs: Operand,
    rhs: Operand,
    rules: Sequence[Equation] = (),
    because: str = "",
    first: Sequence[Cofactor] = (),
) -> Identity:
    """Return the step lhs = rhs: subtract the cofactors `first`, given by hand, then rewrite the rest by `rules`."""
    claim = Equation(name, expression(lhs), expression(rhs))
    remainder = claim.difference
    for cofactor in first:
        remainder = remainder - cofactor.value
    rest, cofactors = _reduced(remainder, rules)
    if not rest.vanishes():
        raise Refused(f"'{name}': {len(rest.canonical().terms)} terms remain after rewriting")
    return Identity(claim, (*first, *cofactors), because)


def positivity(
    name: str,
    value: Operand,
    terms: Sequence[Term],
    rules: Sequence[Equation] = (),
    because: str = "",
    first: Sequence[Cofactor] = (),
) -> Positivity:
    """Return the step value >= 0: subtract `terms` and the cofactors `first`, then rewrite the rest by `rules`."""
    claim = NonNegative(name, expression(value))
    remainder = claim.value
    for term in terms:
        remainder = remainder - term.value
    for cofactor in first:
        remainder = remainder - cofactor.value
    rest, cofactors = _reduced(remainder, rules)
    if not rest.vanishes():
        raise Refused(f"'{name}': {len(rest.canonical().terms)} terms remain after rewriting")
    return Positivity(claim, tuple(terms), (*first, *cofactors), because)


def _reduced(value: Expression, rules: Sequence[Equation]) -> tuple[Expression, tuple[Cofactor, ...]]:
    """Rewrite the value; for a 1 x 1 value, also transpose a word if its transpose rewrites to a smaller word.

    A number equals its own transpose, so xᵀ W y and yᵀ W x become equal if W is symmetric.
    """
    rest, cofactors = rewritten(value, rules)
    if rest.is_scalar:
        for (scalars, word), coefficient in tuple(rest.ordered()):
            turned, more = rewritten(word_expression(transposed(word), scalars, coefficient), rules)
            if len(turned.terms) == 1 and next(iter(turned.terms))[1] < word:
                rest = rest - word_expression(word, scalars, coefficient) + turned
                cofactors += more
    return rest, cofactors


def _first_match(value: Expression, rules: Sequence[Equation]) -> Cofactor | None:
    for (scalars, word), coefficient in value.ordered():
        for rule in rules:
            start = _occurrence(scalars, word, rule)
            if start is not None:
                return _cofactor(scalars, word, coefficient, start, rule)
    return None


def _occurrence(scalars: Scalars, word: Word, rule: Equation) -> int | None:
    ((pattern_scalars, pattern),) = rule.lhs.terms
    if any(scalars.count(s) < pattern_scalars.count(s) for s in pattern_scalars):
        return None
    span = len(pattern)
    return next((i for i in range(len(word) - span + 1) if word[i : i + span] == pattern), None)


def _cofactor(scalars: Scalars, word: Word, coefficient: Fraction, start: int, rule: Equation) -> Cofactor:
    (((pattern_scalars, pattern), unit),) = rule.lhs.terms.items()
    left_over = list(scalars)
    for name in pattern_scalars:
        left_over.remove(name)
    left = word_expression(word[:start], tuple(left_over), coefficient / unit)
    return Cofactor(left, rule, word_expression(word[start + len(pattern) :]))

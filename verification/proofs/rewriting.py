"""Finds cofactor certificates by rewriting, for proofs whose certificate is too long to write by hand.

Each equation is read from left to right: its left side must be one word, and every occurrence of that word is replaced
by the right side. What is replaced is recorded as a cofactor. Nothing here is trusted: the certificate that comes
out is expanded again by `steps.Identity` or `steps.Positivity`.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from verification.proofs.algebra import (
    Expression,
    Operand,
    Scalars,
    Word,
    expression,
    transposed,
    word_expression,
)
from verification.proofs.facts import Equation, NonNegative
from verification.proofs.steps import Cofactor, Identity, Positivity, Refused, Term

MOST_REPLACEMENTS = 2000  # a proof here needs some dozens; beyond this the rules run in a circle


def rewritten(value: Expression, rules: Sequence[Equation]) -> tuple[Expression, tuple[Cofactor, ...]]:
    """Apply the rules until none fits. Returns what is left and the cofactors: value = rest + sum of cofactors."""
    cofactors: list[Cofactor] = []
    for _ in range(MOST_REPLACEMENTS):
        cofactor = _first_match(value, rules)
        if cofactor is None:
            return value, tuple(cofactors)
        cofactors.append(cofactor)
        value = value - cofactor.value
    raise Refused("the rewriting rules run in a circle")


def identity(
    name: str,
    lhs: Operand,
    rhs: Operand,
    rules: Sequence[Equation] = (),
    because: str = "",
    first: Sequence[Cofactor] = (),
) -> Identity:
    """lhs = rhs: take away the cofactors `first`, written by hand, then rewrite what is left by `rules`."""
    claim = Equation(name, expression(lhs), expression(rhs))
    remainder = claim.difference
    for cofactor in first:
        remainder = remainder - cofactor.value
    rest, cofactors = _reduced(remainder, rules)
    if not rest.vanishes():
        raise Refused(f"'{name}': rewriting leaves {len(rest.canonical().terms)} terms")
    return Identity(claim, (*first, *cofactors), because)


def positivity(
    name: str, value: Operand, terms: Sequence[Term], rules: Sequence[Equation] = (), because: str = ""
) -> Positivity:
    """value >= 0 as the sum of `terms`, up to what rewriting by `rules` takes away."""
    claim = NonNegative(name, expression(value))
    remainder = claim.value
    for term in terms:
        remainder = remainder - term.value
    rest, cofactors = _reduced(remainder, rules)
    if not rest.vanishes():
        raise Refused(f"'{name}': rewriting leaves {len(rest.canonical().terms)} terms")
    return Positivity(claim, tuple(terms), cofactors, because)


def _reduced(value: Expression, rules: Sequence[Equation]) -> tuple[Expression, tuple[Cofactor, ...]]:
    """Rewrite; then, for a 1 x 1 value, turn words over (a number is its own transpose) where that rewrites to a
    smaller word, so that xᵀ W y and yᵀ W x meet when W is symmetric."""
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

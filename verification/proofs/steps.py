"""The permitted proof steps. The kernel searches a certificate by rewriting, then checks it by expansion alone.

sum        claim.lhs − claim.rhs = sum of non-negative terms + sum of  left * (equation.lhs − equation.rhs) * right;
           an equation has no such terms
cancel     N = 0, since N' X N = 0 (or ≤ 0) with X positive definite (or without an X)
divide     N = 0, since s N = 0 and the scalar s is not 0
dominate   x ≥ 0, since q x − x² ≥ 0 and q ≥ 0 (scalars)
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import reduce

from iapb.errors import IapbError
from verification.proofs.words import (
    ANY,
    ONE,
    Expression,
    Fact,
    Scalars,
    Word,
    number,
    of_word,
    product,
    transposed,
)

MOST_REPLACEMENTS = 2000  # a proof needs some dozens; beyond this limit the rules run in a circle
Cofactor = tuple[Expression, Fact, Expression]
Factors = tuple[Expression, ...]


class Refused(IapbError):
    """Error: a step does not follow."""


@dataclass(frozen=True)
class Step:
    """A claim and its certificate: non-negative terms (each the factors of a product), and cofactors, which are zero;
    for `cancel`, `divide` and `dominate` the two facts that it follows from."""

    claim: Fact
    terms: tuple[Factors, ...] = ()
    cofactors: tuple[Cofactor, ...] = ()
    sources: tuple[Fact, ...] = ()


@dataclass
class Known:
    """The facts that a proof may use so far, and the names of those that it has used."""

    facts: list[Fact]
    used: set[str] = field(default_factory=set)

    def equation(self, wanted: Fact) -> Fact:
        """Return the established equation that is `wanted` or its transpose."""
        for fact in self.facts:
            if fact.relation == "=" and wanted.difference in (fact.difference, fact.T.difference):
                self.used.add(fact.name)
                return fact if fact.difference == wanted.difference else fact.T
        raise Refused(f"the step uses '{wanted.name}', which no earlier step proves")

    def about(self, value: Expression, relations: str, *, entrywise: bool = False) -> Fact | None:
        return next((fact for fact in self.facts if fact.relation in relations and fact.difference == value
                     and fact.entrywise is entrywise), None)  # fmt: skip

    def rules(self, apart: Iterable[Fact]) -> list[Fact]:
        """Return the equations, and their transposes, that replace a word by smaller or earlier ones, long words first;
        those `apart` and their transposes are left out."""
        used = {value for fact in apart for value in (fact.difference, fact.T.difference)}
        both = [rule for fact in self.facts if fact.relation == "=" and fact.difference not in used
                for rule in (fact, fact.T)]  # fmt: skip
        return sorted(filter(_is_rule, both), key=lambda rule: -max(len(word) for _, word in rule.lhs.terms))


def prove(claim: Fact, known: Known, terms: Sequence[Factors] = (), cofactors: Sequence[Cofactor] = ()) -> Step:
    """Return the step whose certificate has these terms and cofactors; rewriting by the other equations finds the rest.

    Raises
    ------
    Refused
        If the claim does not follow this way.
    """
    cofactors = [(left, known.equation(fact), right) for left, fact, right in cofactors]
    found = reduced(_rest(claim, terms, cofactors), known.rules(fact for _, fact, _ in cofactors))[1]
    step = Step(claim, tuple(terms), (*cofactors, *found))
    check(step, known)
    return step


def infer(claim: Fact, method: str, known: Known) -> Step:
    """Return the step by `cancel`, `divide` or `dominate`; Refused if no known facts fit."""
    for source in known.facts:
        for other in (None, *known.facts):
            if _follows(method, claim, source, other):
                sources = (source,) if other is None else (source, other)
                known.used.update(fact.name for fact in sources)
                return Step(claim, sources=sources)
    raise Refused(f"'{claim.name}': no square or product matches")


def check(step: Step, known: Known) -> None:
    """Check a certificate by expansion: every fact is known, no term is negative, nothing remains."""
    claim = step.claim
    if not (claim.relation in "≥⪰" and not claim.entrywise) and (step.terms or claim.relation != "="):
        raise Refused(f"'{claim.name}': terms show only that a number or a form is not negative")
    for factors in step.terms:
        known.used.update(fact.name for fact in reasons(factors, known))
    for _, fact, _ in step.cofactors:
        known.equation(fact)
    rest = _rest(claim, step.terms, step.cofactors)
    if not rest.vanishes():
        raise Refused(f"'{claim.name}': {len(rest.terms)} terms remain after the certificate is expanded")


def reasons(factors: Factors, known: Known) -> list[Fact]:
    """Return the facts for which a product is not negative: scalars, then a square, a pairing or a known form."""
    scalars = [factor for factor in factors if factor.rows == ANY]
    matrices = [factor for factor in factors if factor.rows != ANY]
    facts: list[Fact] = []
    weight = Fraction(1)
    while scalars:
        first = scalars.pop(0)
        if set(first.terms) <= {((), ())}:
            weight *= sum(first.terms.values(), Fraction(0))
        elif fact := known.about(first, "≥"):
            facts.append(fact)
        elif first in scalars:  # a square
            scalars.remove(first)
        else:
            raise Refused(f"no earlier step proves that {_words(first)} is not negative")
    if weight <= 0:
        raise Refused(f"the weight {weight} is not positive")
    return facts + (_form(matrices, known) if matrices else [])


def _form(factors: list[Expression], known: Known) -> list[Fact]:
    whole, core = product(factors), factors[1:-1]
    if fact := known.about(whole, "≥⪰≻"):
        return [fact]
    if len(factors) in (2, 3) and factors[0] == factors[-1].T:
        facts = [known.about(each, "⪰≻") for each in core]
    elif len(factors) in (2, 3) and whole.is_number:
        facts = [known.about(each, "≥", entrywise=True) for each in (factors[0].T, factors[-1], *core)]
    else:
        facts = [None]
    if None in facts:
        raise Refused(f"no earlier step proves that {_words(whole)} is not negative")
    return [fact for fact in facts if fact]


def _words(value: Expression) -> str:
    return " + ".join(" ".join((*scalars, *(each.name for each in word))) for scalars, word in value.terms)


def _follows(method: str, claim: Fact, source: Fact, other: Fact | None) -> bool:
    """Whether the claim follows from `source` (a square or product) and the sign of `other`."""
    x, value, kind = claim.difference, source.difference, "" if other is None else other.relation
    core = ONE if other is None else other.difference
    if method == "cancel" and claim.relation == "=" and source.relation in "=≥⪰":
        return (other is None or (kind == "≻" and core.rows == x.rows)) and _same(
            x.T * core * x, value if source.relation == "=" else -value)
    if method == "divide" and claim.relation == source.relation == "=":
        return kind == "≠" and _same(core * x, value)
    return (method == "dominate" and claim.relation == source.relation == kind == "≥" and x.rows == core.rows == ANY
            and _same(core * x - x * x, value))  # fmt: skip


def _same(one: Expression, other: Expression) -> bool:
    return (one.rows, one.cols) == (other.rows, other.cols) and (one - other).vanishes()


def _rest(claim: Fact, terms: Iterable[Factors], cofactors: Iterable[Cofactor]) -> Expression:
    parts = [*map(product, terms), *(left * fact.difference * right for left, fact, right in cofactors)]
    return claim.difference - reduce(Expression.__add__, parts, number(0))


def _is_rule(rule: Fact) -> bool:
    """Whether the left side is one word and each word of the right side lacks one of its letters or is smaller."""
    if len(rule.lhs.terms) != 1:
        return False
    ((scalars, word),) = rule.lhs.terms
    letters = {*scalars, *(each.name for each in word)}
    size = len(scalars) + len(word), sum(each.flipped for each in word)
    return bool(letters) and all(
        letters - {*more, *(each.name for each in other)}
        or (len(more) + len(other), sum(each.flipped for each in other)) < size
        for more, other in rule.rhs.terms)


def reduced(value: Expression, rules: Sequence[Fact]) -> tuple[Expression, list[Cofactor]]:
    """Rewrite the value; return rest and cofactors with value = rest + sum of cofactors (up to 1 x 1 transposes).

    In a 1 x 1 value also transpose a word if its transpose rewrites to a smaller word: a number equals its own
    transpose, so xᵀ W y and yᵀ W x become equal if W is symmetric.
    """
    rest, cofactors = _rewritten(value, rules)
    if rest.rows == rest.cols == "1":
        for (scalars, word), coefficient in tuple(rest.ordered()):
            turned, more = _rewritten(of_word(transposed(word), scalars, coefficient), rules)
            if len(turned.terms) == 1 and next(iter(turned.terms))[1] < word:
                rest = rest - of_word(word, scalars, coefficient) + turned
                cofactors += more
    return rest, cofactors


def _rewritten(value: Expression, rules: Sequence[Fact]) -> tuple[Expression, list[Cofactor]]:
    cofactors: list[Cofactor] = []
    while (match := _first_match(value, rules)) is not None:
        if len(cofactors) == MOST_REPLACEMENTS:
            raise Refused(f"the rewriting rules form a cycle: more than {MOST_REPLACEMENTS} replacements")
        cofactors.append(match)
        value = value - product((match[0], match[1].difference, match[2]))
    return value, cofactors


def _first_match(value: Expression, rules: Sequence[Fact]) -> Cofactor | None:
    for (scalars, word), coefficient in value.ordered():
        for rule in rules:
            (((pattern_scalars, pattern), unit),) = rule.lhs.terms.items()
            start = _occurrence(scalars, word, pattern_scalars, pattern)
            if start is not None:
                left_over = list(scalars)
                for name in pattern_scalars:
                    left_over.remove(name)
                left = of_word(word[:start], tuple(left_over), coefficient / unit)
                return left, rule, of_word(word[start + len(pattern) :])
    return None


def _occurrence(scalars: Scalars, word: Word, pattern_scalars: Scalars, pattern: Word) -> int | None:
    if any(scalars.count(name) < pattern_scalars.count(name) for name in pattern_scalars):
        return None
    span = len(pattern)
    return next((i for i in range(len(word) - span + 1) if word[i : i + span] == pattern), None)

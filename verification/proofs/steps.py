"""The permitted proof steps. The kernel searches a certificate by rewriting, then checks it by
expansion alone.

sum        claim.lhs − claim.rhs = sum of non-negative terms
           + sum of  left * (equation.lhs − equation.rhs) * right;
           an equation has no non-negative terms
cancelling N = 0, since N' X N = 0 (or ≤ 0) with X positive definite (or without an X)
dividing   N = 0, since s N = 0 and the number s is not 0
dominating x ≥ 0, since q x − x² ≥ 0 and q ≥ 0 (scalars)

docs/proofs.md lists what each step needs, with a statement that lacks it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import product as pairs

from iapb.errors import IapbError
from verification.proofs.words import (
    ANY,
    ONE,
    Expression,
    Fact,
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
    """A claim and its certificate: non-negative terms (each the factors of a product), and
    cofactors, which are zero; for the other rules the two facts that it follows from."""

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
            for side in (fact, fact.T) if fact.relation == "=" else ():
                if side.difference == wanted.difference:
                    self.used.add(fact.name)
                    return side
        raise Refused(f"the step uses '{wanted.name}', which no earlier step proves")

    def about(self, value: Expression, relations: str, *, entrywise: bool = False) -> Fact | None:
        return next(
            (
                fact
                for fact in self.facts
                if fact.relation in relations
                and fact.difference == value
                and fact.entrywise is entrywise
            ),
            None,
        )

    def rules(self, apart: Iterable[Cofactor]) -> list[Fact]:
        """Return the equations, and their transposes, that replace a word by smaller or earlier
        ones, long words first; those `apart` and their transposes are left out."""
        used = [side.difference for _, fact, _ in apart for side in (fact, fact.T)]
        both = [
            rule
            for fact in self.facts
            if fact.relation == "=" and fact.difference not in used
            for rule in (fact, fact.T)
        ]
        return sorted(
            filter(_is_rule, both), key=lambda rule: -max(len(word) for _, word in rule.lhs.terms)
        )


def prove(
    claim: Fact, known: Known, terms: Sequence[Factors] = (), cofactors: Sequence[Cofactor] = ()
) -> Step:
    """Return the step whose certificate has these terms and cofactors; rewriting by the other
    equations finds the rest.

    Raises
    ------
    Refused
        If the claim does not follow this way.
    """
    cofactors = [(left, known.equation(fact), right) for left, fact, right in cofactors]
    found = reduced(_rest(Step(claim, tuple(terms), tuple(cofactors))), known.rules(cofactors))
    step = Step(claim, tuple(terms), (*cofactors, *found))
    check(step, known)
    return step


def infer(claim: Fact, method: str, known: Known) -> Step:
    """Return the step by `cancelling`, `dividing` or `dominating`; Refused if no known facts fit."""
    for source, other in pairs(known.facts, (None, *known.facts)):
        if _follows(method, claim, source, other):
            sources = (source,) if other is None else (source, other)
            known.used.update(fact.name for fact in sources)
            return Step(claim, sources=sources)
    raise Refused(f"'{claim.name}': no square or product matches")


def check(step: Step, known: Known) -> None:
    """Check a certificate by expansion: every fact is known, no term is negative, nothing
    remains."""
    claim = step.claim
    if not (claim.relation in "≥⪰" and not claim.entrywise) and (
        step.terms or claim.relation != "="
    ):
        raise Refused(f"'{claim.name}': terms show only that a number or a form is not negative")
    for factors in step.terms:
        known.used.update(fact.name for fact in reasons(factors, known))
    for _, fact, _ in step.cofactors:
        known.equation(fact)
    if not (rest := _rest(step)).vanishes():
        raise Refused(
            f"'{claim.name}': {len(rest.terms)} terms remain after the certificate is expanded"
        )


def reasons(factors: Factors, known: Known) -> list[Fact]:
    """Return the facts for which a product is not negative: scalars, then a square, a pairing or a
    known form."""
    scalars = [factor for factor in factors if factor.rows == ANY]
    matrices = [factor for factor in factors if factor.rows != ANY]
    facts: list[Fact | None] = []
    while scalars:
        first = scalars.pop(0)
        if fact := known.about(first, "≥"):
            facts.append(fact)
        elif first in scalars:  # a square
            scalars.remove(first)
        elif not (set(first.terms) == {((), ())} and min(first.terms.values()) > 0):
            facts.append(None)
    if fact := known.about(product(matrices), "≥⪰≻"):
        facts.append(fact)
    elif len(matrices) in (2, 3) and matrices[0] == matrices[-1].T:
        facts += [known.about(each, "⪰≻") for each in matrices[1:-1]]
    elif len(matrices) in (2, 3) and product(matrices).is_number:
        ends = matrices[0].T, matrices[-1]
        facts += [known.about(each, "≥", entrywise=True) for each in (*ends, *matrices[1:-1])]
    elif matrices:
        facts.append(None)
    if None in facts:
        raise Refused(f"no earlier step proves that {product(factors)} is not negative")
    return [fact for fact in facts if fact]


def _follows(method: str, claim: Fact, source: Fact, other: Fact | None) -> bool:
    """Whether the claim follows from `source` (a square or product) and the sign of `other`."""
    x = claim.difference
    value = source.difference
    kind = "" if other is None else other.relation
    core = ONE if other is None else other.difference
    if method == "cancelling" and claim.relation == "=" and source.relation in "=≥⪰":
        return (other is None or (kind == "≻" and core.rows == x.rows)) and _same(
            x.T * core * x, value if source.relation == "=" else -value
        )
    if method == "dividing" and claim.relation == source.relation == "=":
        return kind == "≠" and core.is_number and _same(core * x, value)
    return (
        method == "dominating"
        and claim.relation == source.relation == kind == "≥"
        and x.rows == core.rows == ANY
        and _same(core * x - x * x, value)
    )


def _same(one: Expression, other: Expression) -> bool:
    return (one.rows, one.cols) == (other.rows, other.cols) and (one - other).vanishes()


def _rest(step: Step) -> Expression:
    """Return the claim's difference minus its certificate."""
    parts = [
        *map(product, step.terms),
        *(left * fact.difference * right for left, fact, right in step.cofactors),
    ]
    return step.claim.difference - sum(parts, number(0))


def _is_rule(rule: Fact) -> bool:
    """Whether the left side is one word and each word of the right side lacks one of its letters or
    is smaller."""
    if len(rule.lhs.terms) != 1:
        return False
    ((scalars, word),) = rule.lhs.terms
    letters = {*scalars, *(each.name for each in word)}
    size = len(scalars) + len(word), sum(each.flipped for each in word)
    return bool(letters) and all(
        letters - {*more, *(each.name for each in other)}
        or (len(more) + len(other), sum(each.flipped for each in other)) < size
        for more, other in rule.rhs.terms
    )


def reduced(value: Expression, rules: Sequence[Fact]) -> list[Cofactor]:
    """Rewrite the value by the rules as far as possible and return the cofactors of the
    replacements.

    In a 1 x 1 value also transpose a word if its transpose rewrites to a smaller word: a number
    equals its own transpose, so xᵀ W y and yᵀ W x become equal if W is symmetric.
    """
    rest, cofactors = _rewritten(value, rules)
    for (scalars, word), coefficient in rest.ordered() if rest.rows == rest.cols == "1" else ():
        turned, more = _rewritten(of_word(transposed(word), scalars, coefficient), rules)
        if len(turned.terms) == 1 and next(iter(turned.terms))[1] < word:
            cofactors += more
    return cofactors


def _rewritten(value: Expression, rules: Sequence[Fact]) -> tuple[Expression, list[Cofactor]]:
    """Return rest and cofactors with value = rest + sum of cofactors."""
    cofactors: list[Cofactor] = []
    while (match := _first_match(value, rules)) is not None:
        if len(cofactors) == MOST_REPLACEMENTS:
            raise Refused(
                f"the rewriting rules form a cycle: more than {MOST_REPLACEMENTS} replacements"
            )
        cofactors.append(match)
        value = value - match[0] * match[1].difference * match[2]
    return value, cofactors


def _first_match(value: Expression, rules: Sequence[Fact]) -> Cofactor | None:
    for ((scalars, word), coefficient), rule in pairs(value.ordered(), rules):
        (((taken, pattern), unit),) = rule.lhs.terms.items()
        span = len(pattern)
        start = next(
            (i for i in range(len(word) - span + 1) if word[i : i + span] == pattern), None
        )
        if start is not None and Counter(taken) <= Counter(scalars):
            left_over = tuple(sorted((Counter(scalars) - Counter(taken)).elements()))
            return (
                of_word(word[:start], left_over, coefficient / unit),
                rule,
                of_word(word[start + span :]),
            )
    return None

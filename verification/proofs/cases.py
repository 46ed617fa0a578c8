"""Exact values for the letters of a statement, and what holds there, by rational arithmetic alone
(python-flint).

A `Case` gives every letter a rational matrix and every scalar a 1 x 1 matrix. Cases refute false
variants of statements and show that hypotheses are needed.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from functools import reduce
from typing import Any, NamedTuple

from flint import fmpq, fmpq_mat

from iapb.errors import ArgumentError
from verification.proofs.words import Expression, Fact, Reader, names_in

Case = dict[str, fmpq_mat]
_RELATIONS = {
    "=": operator.eq,
    "<": operator.lt,
    "≤": operator.le,
    ">": operator.gt,
    "≥": operator.ge,
}
# a number is never the identity
_COMPARISON = re.compile(r"([^=<≤>≥I]+)([=<≤>≥])([^=<≤>≥I]+)")
_VALUE = re.compile(r"(\S+?)=(\[[^\]]*\]|\S+)")


class Comparison(NamedTuple):
    """A relation between two computed rationals; `says` describes it."""

    says: str
    left: Any
    relation: str
    right: Any

    @property
    def is_true(self) -> bool:
        return bool(_RELATIONS[self.relation](self.left, self.right))


def read_comparison(says: str, formula: str) -> Comparison:
    """Return a comparison of numbers, written as a formula without letters.

    Raises
    ------
    ArgumentError
        The formula is none.
    """
    parts = _COMPARISON.fullmatch(formula)
    if parts is None:
        raise ArgumentError(
            "numbers", formula, "two sides without letters, and one of = < ≤ > ≥ between them"
        )
    left, relation, right = parts.groups()
    reader = Reader({})
    low, high = (value_of(reader.expression(side), {})[0, 0] for side in (left, right))
    return Comparison(says, low, relation, high)


def read_case(text: str, names: Iterable[str], base: Mapping[str, fmpq_mat] | None = None) -> Case:
    """Return the case `M=[1 0; 0 1/2] e=−1 ...`; a letter that it leaves out has its value in
    `base`."""
    rows = {
        name: value.strip("[]").replace("−", "-").split(";") for name, value in _VALUE.findall(text)
    }
    if _VALUE.sub("", text).strip() or not set(rows) <= set(names):
        raise ArgumentError("case", text, f"values of {' '.join(names)}")
    return {
        **(base or {}),
        **{name: matrix_of([row.split() for row in value]) for name, value in rows.items()},
    }


def refuse_sizes(case: Case, shapes: Mapping[str, tuple[str, ...]]) -> None:
    """Raise ArgumentError if the values give a size two values, or the size 1 another one."""
    found = {("1", 1)}
    for name, value in case.items():
        found.update(zip(shapes[name] or ("1", "1"), (value.nrows(), value.ncols()), strict=True))
    if len(dict(found)) < len(found):
        raise ArgumentError("case", sorted(found), "one value for each size")


def matrix_of(rows: Sequence[Sequence[Fraction | float | str]]) -> fmpq_mat:
    """Return the rational matrix of python-flint."""
    return fmpq_mat([[fmpq(*Fraction(entry).as_integer_ratio()) for entry in row] for row in rows])


def value_of(value: Expression, case: Case) -> fmpq_mat:
    """Return the rational matrix of an expression. Commuting scalars alone give a 1 x 1 matrix."""
    if missing := names_in(value) - set(case):
        raise ArgumentError("case", sorted(case), f"a value for {', '.join(sorted(missing))}")
    products = []
    multiple = fmpq(0)  # of the identity
    for (scalars, word), coefficient in value.terms.items():
        scale = fmpq(*coefficient.as_integer_ratio())
        for name in scalars:
            scale *= case[name][0, 0]
        factors = [
            case[each.name].transpose() if each.flipped else case[each.name] for each in word
        ]
        if factors:
            products.append(reduce(operator.mul, factors) * scale)
        else:
            multiple += scale
    total = sum(products[1:], products[0]) if products else fmpq_mat(1, 1)
    if multiple:
        for k in range(total.nrows()):
            total[k, k] += multiple
    return total


def completed(case: Case, definitions: Iterable[Fact]) -> Case:
    """Return the case in which each defined letter (left side) has the value of its definition
    (right side)."""
    values = dict(case)
    for definition in definitions:
        (name,) = names_in(definition.lhs)
        values[name] = value_of(definition.rhs, values)
    return values


def holds(fact: Fact, case: Case) -> bool:
    """Whether a fact holds in a case, by exact arithmetic."""
    value = value_of(fact.difference, case)
    if fact.relation in "=≠":
        return any(value.entries()) is (fact.relation == "≠")
    if fact.entrywise:
        return all(entry >= 0 for entry in value.entries())
    return definite(value, strict=fact.relation == "≻")


def all_hold(facts: Iterable[Fact], case: Case) -> bool:
    return all(holds(fact, case) for fact in facts)


def definite(value: fmpq_mat, *, strict: bool) -> bool:
    """Whether x' A x >= 0 (strict: > 0) for every x other than 0.

    All roots of the characteristic polynomial p of A + Aᵀ are real. By Descartes' rule none is
    negative if no coefficient of ±p(−λ) is, and none is 0, either, if all are positive.
    """
    coefficients = (value + value.transpose()).charpoly().coeffs()
    signed = [(-1) ** k * each for k, each in enumerate(reversed(coefficients))]
    return all(each > 0 or (each == 0 and not strict) for each in signed)

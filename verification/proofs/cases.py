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
from verification.proofs.words import ANY, Expression, Fact, Reader, names_in

Case = dict[str, fmpq_mat]
_RELATIONS = {
    "=": operator.eq,
    "<": operator.lt,
    "≤": operator.le,
    ">": operator.gt,
    "≥": operator.ge,
}
_SIDES = re.compile(r"\s*([=<≤>≥])\s*")
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
    """Return a comparison of numbers, written as a formula without letters."""
    left, relation, right = _SIDES.split(formula)
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


def matrix_of(rows: Sequence[Sequence[Fraction | int | str]]) -> fmpq_mat:
    """Return the rational matrix of python-flint."""
    return fmpq_mat([[fmpq(*Fraction(entry).as_integer_ratio()) for entry in row] for row in rows])


def value_of(value: Expression, case: Case) -> fmpq_mat:
    """Return the rational matrix of an expression. Commuting scalars alone give a 1 x 1 matrix."""
    if missing := names_in(value) - set(case):
        raise ArgumentError("case", sorted(case), f"a value for {', '.join(sorted(missing))}")
    sizes = {"1": 1, ANY: 1}
    for letter in {each for _, word in value.terms for each in word}:
        rows, cols = (letter.cols, letter.rows) if letter.flipped else (letter.rows, letter.cols)
        sizes |= {rows: case[letter.name].nrows(), cols: case[letter.name].ncols()}
    identity = fmpq_mat(
        [[int(i == j) for j in range(sizes[value.rows])] for i in range(sizes[value.rows])]
    )
    total = fmpq_mat(sizes[value.rows], sizes[value.cols])
    for (scalars, word), coefficient in value.terms.items():
        factors = [
            case[each.name].transpose() if each.flipped else case[each.name] for each in word
        ]
        scale = reduce(
            operator.mul,
            [case[name][0, 0] for name in scalars],
            fmpq(*coefficient.as_integer_ratio()),
        )
        total += reduce(operator.mul, factors or [identity]) * scale
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
    """Whether x' A x >= 0 (strict: > 0) for every x other than 0, by exact elimination on the
    symmetric part of A."""
    a = (value + value.transpose()).tolist()
    for k, row in enumerate(a):
        if row[k] < 0 or (row[k] == 0 and (strict or any(row[k:]))):
            return False
        for other in a[k + 1 :] if row[k] else ():
            other[:] = [x - other[k] / row[k] * y for x, y in zip(other, row, strict=True)]
    return True


def pseudo_inverse(matrix: Any) -> Any:
    """Return the Moore-Penrose inverse of a rational matrix of python-flint.

    A = C R, where C has the independent columns and R is the reduced echelon form; A† = Rᵀ(R
    Rᵀ)⁻¹(CᵀC)⁻¹Cᵀ. Source: Ben-Israel and Greville, Generalized Inverses (2003), theorem 1.5
    (MacDuffee).
    """
    reduced, rank = matrix.rref()
    if rank == 0:
        return matrix.transpose()
    rows = reduced.tolist()[:rank]
    pivots = [next(j for j, entry in enumerate(row) if entry) for row in rows]
    echelon = fmpq_mat(rows)
    columns = fmpq_mat([[row[j] for j in pivots] for row in matrix.tolist()])
    left = (columns.transpose() * columns).solve(columns.transpose())
    return echelon.transpose() * (echelon * echelon.transpose()).solve(left)

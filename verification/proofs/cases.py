"""Exact values for the letters of a statement, and what holds there, by rational arithmetic alone (python-flint).

A `Case` gives every letter a rational matrix and every scalar a 1 x 1 matrix. Cases refute false variants of statements
and show that hypotheses are needed.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

from iapb.errors import ArgumentError
from verification.proofs.words import ANY, Expression, Fact

Matrix = tuple[tuple[Fraction, ...], ...]
Case = dict[str, Matrix]
_RELATIONS = {"=": operator.eq, "<": operator.lt, "≤": operator.le, ">": operator.gt, "≥": operator.ge}
_VALUE = re.compile(r"(\S+?)=(\[[^\]]*\]|\S+)")


class Comparison(NamedTuple):
    """A relation between two computed rationals; `says` describes it."""

    says: str
    left: Fraction
    relation: str
    right: Fraction

    @property
    def is_true(self) -> bool:
        return bool(_RELATIONS[self.relation](self.left, self.right))


def read_case(text: str, names: Iterable[str], base: Mapping[str, Matrix] | None = None) -> Case:
    """Return the case `M=[1 0; 0 1/2] e=−1 ...`; a letter that it leaves out has its value in `base`."""
    values = {name: _matrix(value) for name, value in _VALUE.findall(text)}
    rest = _VALUE.sub("", text).strip()
    if rest or not set(values) <= set(names):
        raise ArgumentError("case", text, f"values of {' '.join(names)}")
    return {**(base or {}), **values}


def _matrix(text: str) -> Matrix:
    rows = text.strip("[]").replace("−", "-").split(";")
    return tuple(tuple(Fraction(entry) for entry in row.split()) for row in rows)


def flint(rows: Sequence[Sequence[Fraction | int]]) -> Any:
    """Return the rational matrix of python-flint."""
    from flint import fmpq, fmpq_mat

    entries = [Fraction(entry) for row in rows for entry in row]
    return fmpq_mat(len(rows), len(rows[0]), [fmpq(each.numerator, each.denominator) for each in entries])


def exact(matrix: Any) -> Matrix:
    """Return the rows of a matrix of python-flint."""
    return tuple(tuple(Fraction(int(x.p), int(x.q)) for x in row) for row in matrix.tolist())


def value_of(value: Expression, case: Case) -> Matrix:
    """Return the rational matrix of an expression. Commuting scalars alone give a 1 x 1 matrix."""
    sizes = {"1": 1, ANY: 1}
    for letter in {each for _, word in value.terms for each in word}:
        rows = _of(case, letter.name)
        names = (letter.cols, letter.rows) if letter.flipped else (letter.rows, letter.cols)
        for name, size in zip(names, (len(rows), len(rows[0])), strict=True):
            if sizes.setdefault(name, size) != size:
                raise ArgumentError(letter.name, (len(rows), len(rows[0])), f"size {name} = {sizes[name]}")
    total = flint([[0] * sizes[value.cols]] * sizes[value.rows])
    for (scalars, word), coefficient in value.terms.items():
        for name in scalars:
            coefficient *= _of(case, name)[0][0]
        product = None
        for letter in word:
            factor = flint(_of(case, letter.name))
            factor = factor.transpose() if letter.flipped else factor
            product = factor if product is None else product * factor
        if product is None:
            product = flint([[i == j for j in range(sizes[value.cols])] for i in range(sizes[value.rows])])
        total = total + product * flint([[coefficient]])[0, 0]
    return exact(total)


def _of(case: Case, name: str) -> Matrix:
    if name not in case:
        raise ArgumentError("case", sorted(case), f"a value for {name}")
    return case[name]


def completed(case: Case, definitions: Iterable[Fact]) -> Case:
    """Return the case in which each defined letter (left side) has the value of its definition (right side)."""
    values = dict(case)
    for definition in definitions:
        (((scalars, word), _),) = definition.lhs.terms.items()
        values[word[0].name if word else scalars[0]] = value_of(definition.rhs, values)
    return values


def holds(fact: Fact, case: Case) -> bool:
    """Whether a fact holds in a case, by exact arithmetic."""
    rows = value_of(fact.difference, case)
    entries = [entry for row in rows for entry in row]
    if fact.relation == "=":
        return not any(entries)
    if fact.relation == "≠":
        return any(entries)
    return all(entry >= 0 for entry in entries) if fact.entrywise else definite(rows, strict=fact.relation == "≻")


def all_hold(facts: Iterable[Fact], case: Case) -> bool:
    return all(holds(fact, case) for fact in facts)


def definite(rows: Matrix, *, strict: bool) -> bool:
    """Whether x' A x >= 0 (strict: > 0) for every x other than 0, by exact elimination on the symmetric part of A."""
    size = len(rows)
    a = [[(rows[i][j] + rows[j][i]) / 2 for j in range(size)] for i in range(size)]
    for k in range(size):
        if a[k][k] < 0 or (a[k][k] == 0 and (strict or any(a[k][k:]))):
            return False
        for i in range(k + 1, size):
            ratio = a[i][k] / a[k][k] if a[k][k] else Fraction(0)
            a[i] = [x - ratio * y for x, y in zip(a[i], a[k], strict=True)]
    return True


def pseudo_inverse(matrix: Any) -> Any:
    """Return the Moore-Penrose inverse of a rational matrix of python-flint.

    A = C R, where C has the independent columns and R is the reduced echelon form; A† = Rᵀ(R Rᵀ)⁻¹(CᵀC)⁻¹Cᵀ.
    Source: Ben-Israel and Greville, Generalized Inverses (2003), theorem 1.5 (MacDuffee).
    """
    reduced, rank = matrix.rref()
    if rank == 0:
        return matrix.transpose()
    rows = exact(reduced)[:rank]
    pivots = [next(j for j, entry in enumerate(row) if entry) for row in rows]
    columns, echelon = flint([[row[j] for j in pivots] for row in exact(matrix)]), flint(rows)
    left = (columns.transpose() * columns).solve(columns.transpose())
    return echelon.transpose() * (echelon * echelon.transpose()).solve(left)

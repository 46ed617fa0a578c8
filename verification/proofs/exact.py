"""Exact values for the letters of a statement: rational matrices of python-flint and, as a cross-check, of sympy.

An `Instance` gives every letter a rational matrix and every scalar a rational number. `holds` then decides a fact by
rational arithmetic alone. This refutes false variants of statements and shows that hypotheses are needed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from iapb.errors import ArgumentError
from verification.proofs.algebra import (
    ANY,
    Definite,
    Entrywise,
    Equation,
    Expression,
    Fact,
    NonNegative,
    Nonzero,
)

Number = int | str | Fraction
Rows = Sequence[Any]  # rows of numbers, or the numbers of a column
Matrix = tuple[tuple[Fraction, ...], ...]


@dataclass(frozen=True)
class Instance:
    """Exact values by letter name; a scalar is stored as a plain Fraction."""

    values: Mapping[str, Matrix | Fraction]

    def with_values(self, values: Mapping[str, Any] | None = None, /, **changed: Any) -> Instance:
        """Return a copy of the instance with some letters changed."""
        return Instance({**self.values, **instance(values, **changed).values})


def instance(values: Mapping[str, Any] | None = None, /, **named: Any) -> Instance:
    """Return an Instance from numbers (scalars), lists of numbers (columns) and lists of rows; "1/3" is a third."""
    return Instance({name: _exact(name, value) for name, value in {**(values or {}), **named}.items()})


def _exact(name: str, value: Any) -> Matrix | Fraction:
    if isinstance(value, int | str | Fraction):
        return Fraction(value)
    if isinstance(value, float):
        raise ArgumentError(name, value, "an exact number (int, Fraction or a string such as '1/3')")
    rows = [row if isinstance(row, list | tuple) else [row] for row in value]
    return tuple(tuple(Fraction(entry) for entry in row) for row in rows)


class FlintBackend:
    """Rational matrices of python-flint."""

    name = "python-flint"

    @staticmethod
    def matrix(rows: Sequence[Sequence[Fraction]]) -> Any:
        from flint import fmpq, fmpq_mat

        flat = [fmpq(entry.numerator, entry.denominator) for row in rows for entry in row]
        return fmpq_mat(len(rows), len(rows[0]), flat)

    @staticmethod
    def number(value: Fraction) -> Any:
        from flint import fmpq

        return fmpq(value.numerator, value.denominator)

    @staticmethod
    def rows(value: Any) -> Matrix:
        return tuple(tuple(Fraction(int(x.p), int(x.q)) for x in row) for row in value.tolist())


class SympyBackend:
    """Rational matrices of sympy."""

    name = "sympy"

    @staticmethod
    def matrix(rows: Sequence[Sequence[Fraction]]) -> Any:
        import sympy

        return sympy.Matrix([[SympyBackend.number(entry) for entry in row] for row in rows])

    @staticmethod
    def number(value: Fraction) -> Any:
        import sympy

        return sympy.Rational(value.numerator, value.denominator)

    @staticmethod
    def rows(value: Any) -> Matrix:
        return tuple(tuple(Fraction(int(x.p), int(x.q)) for x in value.row(i)) for i in range(value.rows))


def identity_rows(size: int) -> Matrix:
    return tuple(tuple(Fraction(int(i == j)) for j in range(size)) for i in range(size))


def evaluate(value: Expression, given: Instance, backend: Any = FlintBackend) -> Matrix:
    """Return the rational matrix of an expression on an instance. Commuting scalars alone give a 1 x 1 matrix."""
    sizes = _sizes(value, given)
    shape = (1, 1) if value.rows == ANY else (sizes[value.rows], sizes[value.cols])
    total = backend.matrix([[Fraction(0)] * shape[1]] * shape[0])
    for (scalars, word), coefficient in value.terms.items():
        for name in scalars:
            coefficient *= _value(given, name)
        product = None
        for letter in word:
            rows = _value(given, letter.name)
            factor = backend.matrix(list(zip(*rows, strict=True)) if letter.flipped else rows)
            product = factor if product is None else product * factor
        if product is None:
            product = backend.matrix(identity_rows(shape[0]))
        total = total + product * backend.number(coefficient)
    return backend.rows(total)


def completed(given: Instance, definitions: Iterable[Equation]) -> Instance:
    """Return the instance in which each defined letter (left side) has the value of its definition (right side)."""
    values = dict(given.values)
    for definition in definitions:
        (((scalars, word), _),) = definition.lhs.terms.items()
        value = evaluate(definition.rhs, Instance(values))
        values[word[0].name if word else scalars[0]] = value if word else value[0][0]
    return Instance(values)


def _value(given: Instance, name: str) -> Any:
    if name not in given.values:
        raise ArgumentError("instance", sorted(given.values), f"a value for {name}")
    return given.values[name]


def _sizes(value: Expression, given: Instance) -> dict[str, int]:
    sizes = {"1": 1}
    for letter in value.letters:
        rows = _value(given, letter.name)
        names = (letter.cols, letter.rows) if letter.flipped else (letter.rows, letter.cols)
        for name, size in zip(names, (len(rows), len(rows[0])), strict=True):
            if sizes.setdefault(name, size) != size:
                raise ArgumentError(letter.name, (len(rows), len(rows[0])), f"size {name} = {sizes[name]}")
    return sizes


def holds(fact: Fact, given: Instance, backend: Any = FlintBackend) -> bool:
    """Whether a fact holds on an instance, by exact arithmetic."""
    match fact:
        case Equation():
            return all(entry == 0 for row in evaluate(fact.difference, given, backend) for entry in row)
        case Entrywise():
            return all(entry >= 0 for row in evaluate(fact.value, given, backend) for entry in row)
        case Nonzero():
            return evaluate(fact.value, given, backend)[0][0] != 0
        case NonNegative():
            return signature_allows(evaluate(fact.value, given, backend), strict=False)
        case Definite():
            return signature_allows(evaluate(fact.value, given, backend), strict=True)


def all_hold(facts: Iterable[Fact], given: Instance) -> bool:
    return all(holds(fact, given) for fact in facts)


def signature_allows(rows: Matrix, *, strict: bool) -> bool:
    """Whether x' A x >= 0 (strict: > 0) for every x other than 0, by exact elimination on the symmetric part of A."""
    size = len(rows)
    a = [[(rows[i][j] + rows[j][i]) / 2 for j in range(size)] for i in range(size)]
    for k in range(size):
        if a[k][k] < 0 or (strict and a[k][k] == 0):
            return False
        if a[k][k] == 0:
            if any(a[k][j] for j in range(k, size)):
                return False
            continue
        for i in range(k + 1, size):
            ratio = a[i][k] / a[k][k]
            for j in range(k, size):
                a[i][j] -= ratio * a[k][j]
    return True


def exact_rows(rows: Rows) -> Matrix:
    """Return a matrix of Fractions from any exact entries."""
    return instance(rows=rows).values["rows"]  # type: ignore[return-value]


def inverse(rows: Rows) -> Matrix:
    """Return the exact inverse; raise ZeroDivisionError if there is none."""
    return FlintBackend.rows(FlintBackend.matrix(exact_rows(rows)).inv())


def rank(rows: Rows) -> int:
    return FlintBackend.matrix(exact_rows(rows)).rref()[1]


def pseudo_inverse(rows: Rows) -> Matrix:
    """Return the exact Moore-Penrose inverse by full-rank factorisation: A = B C, A† = Cᵀ (C Cᵀ)⁻¹ (Bᵀ B)⁻¹ Bᵀ."""
    a = FlintBackend.matrix(exact_rows(rows))
    reduced, size = a.rref()
    if size == 0:
        return FlintBackend.rows(a.transpose())
    table = FlintBackend.rows(reduced)
    pivots = [next(j for j, entry in enumerate(row) if entry) for row in table[:size]]
    b: Any = FlintBackend.matrix([[row[j] for j in pivots] for row in exact_rows(rows)])
    c: Any = FlintBackend.matrix(table[:size])
    left = c.transpose() * (c * c.transpose()).inv()
    right = (b.transpose() * b).inv() * b.transpose()
    return FlintBackend.rows(left * right)


def delassus(mass: Rows, jacobian: Rows) -> Matrix:
    """Return J M⁻¹ Jᵀ."""
    j = FlintBackend.matrix(exact_rows(jacobian))
    return FlintBackend.rows(j * FlintBackend.matrix(inverse(mass)) * j.transpose())


def impact_case(mass: Rows, jacobian: Rows, velocity: list[Any], **scalars: Any) -> Instance:
    """Return an impact with M, M⁻¹, J, G = (J M⁻¹ Jᵀ)† and v; scalars such as e are given by name."""
    values = {"M": mass, "M⁻¹": inverse(mass), "J": jacobian, "v": velocity}
    return instance({**values, "G": pseudo_inverse(delassus(mass, jacobian))}, **scalars)

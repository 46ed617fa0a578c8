"""SymPy as a second kernel: it expands every certificate with non-commutative symbols, without the kit's algebra.

A letter becomes a non-commutative symbol, its transpose another symbol, and a scalar a commuting symbol. SymPy computes
products and sums; the kit supplies only single terms. A certificate holds if SymPy expands

    claim.lhs - claim.rhs - sum of  left * (equation.lhs - equation.rhs) * right

to zero; for a sum of squares, claim minus terms must expand to zero. One rule goes beyond the free algebra: a number
(a 1 x 1 word) equals its own transpose. Only the kit checks that each equation was established before its use, and that
no term is negative.
"""

from __future__ import annotations

import time
from typing import Any

import sympy

from verification.proofs.algebra import Equation, Expression, NonNegative
from verification.proofs.second_tool import SecondOpinion
from verification.proofs.statement import Statement
from verification.proofs.steps import (
    RELATIONS,
    Cancelling,
    Dividing,
    Dominating,
    Exact,
    Identity,
    Pairing,
    Positivity,
    Step,
    Term,
)

_TRANSPOSED = "ᵀ"


def sympy_opinion(statement: Statement) -> SecondOpinion:
    """Let SymPy expand every certificate of a statement; the verdict is "skipped" if no step has a certificate."""
    started, expanded = time.perf_counter(), 0
    for step in statement.steps:
        left = remainder(step)
        if left is None:
            continue
        if left != 0:
            words = f"'{step.says if isinstance(step, Exact) else step.claim.name}': SymPy leaves {left}"
            return SecondOpinion(statement.name, "refused", words, time.perf_counter() - started)
        expanded += 1
    if not expanded:
        return SecondOpinion(statement.name, "skipped", "no step has a certificate to expand")
    return SecondOpinion(statement.name, "accepted", f"{expanded} certificates expanded to zero",
                         time.perf_counter() - started)


def remainder(step: Step) -> Any:
    """Return the remainder of a step's certificate in SymPy: 0 if it holds, None if the step has no certificate."""
    if isinstance(step, Exact):
        holds = RELATIONS[step.relation](sympy.Rational(str(step.left)), sympy.Rational(str(step.right)))
        return sympy.Integer(0 if holds else 1)
    if isinstance(step, Identity):
        value, number = _difference(step.claim), step.claim.difference.is_scalar
    elif isinstance(step, Positivity):
        value = _of(step.claim.value) - sum((_term(term) for term in step.terms), sympy.Integer(0))
        number = step.claim.value.is_scalar
    elif isinstance(step, Cancelling):
        residual, form = _difference(step.claim), step.square
        core = _of(step.definite.value) if step.definite is not None else sympy.Integer(1)
        rest = _difference(form) if isinstance(form, Equation) else -_of(form.value)
        return _canonical(_transposed(residual) * core * residual - rest, _is_number(form))
    elif isinstance(step, Dividing):
        value = _of(step.divisor.value) * _difference(step.claim) - _difference(step.product)
        return _canonical(value, step.claim.difference.is_scalar)
    elif isinstance(step, Dominating):
        x = _of(step.claim.value)
        return sympy.expand(_of(step.factor.value) * x - x**2 - _of(step.product.value))
    else:
        return None
    for cofactor in step.cofactors:
        value -= _of(cofactor.left) * _difference(cofactor.equation) * _of(cofactor.right)
    return _canonical(value, number)


def _is_number(fact: Any) -> bool:
    return bool((fact.difference if isinstance(fact, Equation) else fact.value).is_scalar)


def _difference(equation: Equation) -> Any:
    return _of(equation.lhs) - _of(equation.rhs)


def _of(value: Expression) -> Any:
    """Convert the kit's sum of terms to SymPy, term by term."""
    total = sympy.Integer(0)
    for (scalars, word), coefficient in value.terms.items():
        product = sympy.Rational(coefficient.numerator, coefficient.denominator)
        for name in scalars:
            product *= sympy.Symbol(name)
        for letter in word:
            product *= _letter(letter.name + (_TRANSPOSED if letter.flipped else ""))
        total += product
    return total


def _letter(name: str) -> Any:
    return sympy.Symbol(name, commutative=False)


def _term(term: Term) -> Any:
    """Return a non-negative term in SymPy: weight times scalar factors times form."""
    product = sympy.Rational(str(term.weight))
    for factor in term.factors:
        product *= _of(factor.value)
    form = term.form
    if form is None:
        return product
    if isinstance(form, Pairing):
        core = sympy.Integer(1) if form.core is None else _of(form.core.value)
        return product * _transposed(_of(form.left.value)) * core * _of(form.right.value)
    if isinstance(form, NonNegative):
        return product * _of(form.value)
    half, core = _of(form.half), sympy.Integer(1) if form.core is None else _of(form.core.value)
    return product * _transposed(half) * core * half


def _words(value: Any) -> list[tuple[Any, tuple[Any, ...]]]:
    """Return the coefficients and words of the expanded sum."""
    found = []
    for term in sympy.Add.make_args(sympy.expand(value)):
        scalars, letters = term.args_cnc()
        word: list[Any] = []
        for factor in letters:
            base, power = factor.as_base_exp()
            word += [base] * int(power)
        found.append((sympy.Mul(*scalars), tuple(word)))
    return found


def _reversed(word: tuple[Any, ...]) -> tuple[Any, ...]:
    names = [x.name for x in reversed(word)]
    return tuple(_letter(n.removesuffix(_TRANSPOSED) if n.endswith(_TRANSPOSED) else n + _TRANSPOSED) for n in names)


def _transposed(value: Any) -> Any:
    return sympy.Add(*(scale * sympy.Mul(*_reversed(word)) for scale, word in _words(value)))


def _canonical(value: Any, number: bool) -> Any:
    """Return the expanded value; for a number, replace each word by the first of itself and its transpose, by name."""
    terms = []
    for scale, word in _words(value):
        if number:
            word = min(word, _reversed(word), key=lambda letters: [x.name for x in letters])
        terms.append(scale * sympy.Mul(*word))
    return sympy.expand(sympy.Add(*terms))

"""SymPy as a second kernel: it reads the text of a statement by itself and checks the whole proof
again.

It shares no formula code with the kernel. SymPy's own reader parses the formulas; a letter becomes
a non-commutative symbol, a scalar a commuting symbol. From the kernel it takes only the printed
certificate of each step, as text, and reads that too: every equation in square brackets must be one
that stands before, every term must be seen not to be negative, and SymPy must expand the claim
minus all of them to zero. One rule goes beyond the free algebra: a number (a 1 x 1 word) equals its
own transpose.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from itertools import product
from typing import Any, NamedTuple

import sympy

from iapb.errors import ArgumentError
from verification.proofs.cases import Case, Comparison
from verification.proofs.layout import Block

_SIGNS = {
    "−": "-",
    "·": "*",
    "[": "(",
    "]": ")",
    "I": "1",
    "²": "**2",
    "³": "**3",
    "⁴": "**4",
    "ᵀ": ".transpose()",
}
# between two factors
_BETWEEN = re.compile(r"(?<=[\w)])\s*(?<!transpose)(?=\()|(?<=\))\s*(?=\w)|(?<=\w)\s+(?=\w)")


_NUMBER = r"([\d\s()/+−·²³⁴]+)"
_COMPARISON = re.compile(f"{_NUMBER}([=<≤>≥]){_NUMBER}")


class Relation(NamedTuple):
    """value relation 0, where the relation is one of = ≠ ≥ ⪰ ≻, or "entries": every entry is ≥
    0."""

    value: Any
    relation: str


class Text:
    """The formulas of one block, over SymPy's symbols."""

    def __init__(self, block: Block) -> None:
        self.shapes = block.shapes
        abbreviations = dict(block.abbreviations)
        self.codes = {
            name: f"x{number}" for number, name in enumerate((*self.shapes, *abbreviations))
        }
        marks = sorted([*self.codes, *_SIGNS], key=len, reverse=True)
        self.token = re.compile("|".join(map(re.escape, marks)))
        self.values = {
            self.codes[name]: sympy.Symbol(
                name, **{"commutative": False} if shape else {"real": True}
            )
            for name, shape in self.shapes.items()
        }
        for name, formula in abbreviations.items():
            self.values[self.codes[name]] = self.read(formula)

    def read(self, formula: str) -> Any:
        """Return the value of a formula, written as Python: codes for names, and a * between
        neighbours."""
        spaced = self.token.sub(
            lambda m: f" {self.codes[m[0]]} " if m[0] in self.codes else _SIGNS[m[0]], formula
        )
        return sympy.sympify(
            _BETWEEN.sub("*", re.sub(r"\s+(?=\*\*|\.)", "", spaced.strip())), locals=self.values
        )

    def relation(self, formula: str) -> Relation:
        left, sign, right = re.split(r"([=≠≤≥⪯⪰≻])", formula)
        low, high = (right, left) if sign in "=≠≥⪰≻" else (left, right)
        value = self.read(high) - self.read(low)
        sign = {"≤": "≥", "⪯": "⪰"}.get(sign, sign)
        shape = self.shape(value)
        if not shape or (sign in "⪰≻" and shape[0] != shape[1]):
            raise ArgumentError("formula", formula, "fitting sizes for SymPy, square for ⪰ and ≻")
        return Relation(value, sign if sign != "≥" or shape == ("1", "1") else "entries")

    def is_number(self, value: Any) -> bool:
        """Whether each product of the sum has one row and one column."""
        return self.shape(value) == ("1", "1")

    def shape(self, value: Any) -> tuple[str, str] | None:
        """Return the names of the numbers of rows and columns; None if the products and the sum do
        not fit. A scalar has the shape of what it stands beside."""
        shapes = set()
        words = [word for _, word in _words(value)]
        for word in filter(None, words):
            sizes = [self._size(letter, side) for letter in word for side in (0, 1)]
            if sizes[1:-1:2] != sizes[2::2]:
                return None
            shapes.add((sizes[0], sizes[-1]))
        rows, columns = shape = next(iter(shapes), ("1", "1"))
        return shape if len(shapes) < 2 and (rows == columns or all(words)) else None

    def refuse_assumption(self, formula: str, taken: set[Any]) -> None:
        """Raise ArgumentError unless the formula defines a letter that is not in `taken`; add its
        letters."""
        left, sign, right = re.split(r"([=≠≤≥⪯⪰≻])", formula)
        letter = self.read(left)
        value = self.read(right)
        used = taken | value.free_symbols
        scalar = letter.is_commutative and not self.is_number(value)
        if sign != "=" or not letter.is_Symbol or letter in used or scalar:
            raise ArgumentError("where", formula, "the definition of a letter for SymPy")
        taken |= used | {letter}

    def _size(self, letter: Any, side: int) -> str:
        """Return the name of the number of rows (0) or columns (1)."""
        return (
            self.shapes[letter.name][side]
            if letter.is_Symbol
            else self.shapes[letter.args[0].name][1 - side]
        )

    def compares(self, formula: str) -> bool:
        """Whether a comparison of numbers is true."""
        parts = _COMPARISON.fullmatch(formula)
        sides = [self.read(parts[side]) for side in (1, 3)] if parts else []
        if not parts or not all(side.is_Rational for side in sides):
            raise ArgumentError("numbers", formula, "a comparison of two numbers for SymPy")
        return Comparison(formula, sides[0], parts[2], sides[1]).is_true

    def same(self, one: Any, other: Any) -> bool:
        """Whether the values are equal; a number may be transposed."""
        rest = sympy.expand(one - other)
        return bool(sympy.expand(rest + rest.transpose() if self.is_number(rest) else rest) == 0)


def refusal(block: Block, certificates: Sequence[Sequence[str]]) -> str:
    """Return why SymPy refuses a step of the statement with these printed certificates; empty if it
    accepts all.

    A certificate has a line for each term and each cofactor; a step by cancelling, dividing or
    dominating has none.
    """
    text = Text(block)
    defined: set[Any] = set()
    for entry in block.all("where"):
        for each in entry.formula.split(";"):
            text.refuse_assumption(each, defined)
    known = [
        text.relation(each)
        for entry in block.all("given", "where")
        for each in entry.formula.split(";")
    ]
    steps = [
        (entry, [rule.formula for rule in block.entries[i + 1 : i + 2] if rule.key == "by"])
        for i, entry in enumerate(block.entries)
        if entry.key in ("lemma", "show")
    ]
    for (entry, rule), lines in zip(steps, certificates, strict=True):
        claim = text.relation(entry.formula)
        name = entry.words or entry.formula
        if rule and rule[0] in ("cancelling", "dividing", "dominating"):
            if not any(
                _follows(rule[0], text, claim, *both) for both in product(known, (*known, None))
            ):
                return f"'{name}': SymPy finds no facts from which it follows by {rule[0]}"
        elif claim.relation not in ("=", "≥", "⪰"):
            return f"'{name}': a certificate shows no such relation"
        else:
            rest = claim.value
            for factors in (line.split(" · ") for line in lines):
                values = [text.read(factor) for factor in factors]
                equations = [
                    value for factor, value in zip(factors, values, strict=True) if factor[0] == "["
                ]
                if not (
                    _is_known(equations[0], known, "=")
                    or _is_known(equations[0].transpose(), known, "=")
                    if equations
                    else claim.relation != "=" and _not_negative(text, values, known)
                ):
                    return f"'{name}': SymPy knows no fact for {' · '.join(factors)}"
                rest -= sympy.Mul(*values)
            if not text.same(rest, 0):
                return f"'{name}': SymPy leaves {sympy.expand(rest)}"
        known.append(claim)
    for entry in block.all("numbers", "false"):
        if entry.formula and text.compares(entry.formula) is (entry.key == "false"):
            return f"'{entry.words}': SymPy finds the opposite"
    return ""


def holds(block: Block, formula: str, case: Case) -> bool:
    """Whether a formula holds in a case, by SymPy's rational matrices."""
    text = Text(block)
    value, relation = text.relation(formula)
    exact = {
        name: sympy.Matrix(
            [[sympy.Rational(int(x.p), int(x.q)) for x in row] for row in matrix.tolist()]
        )
        for name, matrix in case.items()
    }
    parts = []
    for scale, word in _words(value):
        factors = [exact[x.name] if x.is_Symbol else exact[x.args[0].name].T for x in word]
        parts.append(
            (scale.subs({x: exact[x.name][0, 0] for x in scale.free_symbols}), sympy.prod(factors))
        )
    shape = next((part.shape for _, part in parts if part != 1), (1, 1))
    matrix = sympy.zeros(*shape)
    for scale, part in parts:
        matrix += scale * (sympy.eye(shape[0]) if part == 1 else part)
    if relation in "=≠":
        return bool(matrix.is_zero_matrix) is (relation == "=")
    if relation in ("≥", "entries"):
        return all(entry >= 0 for entry in matrix)
    symmetric = matrix + matrix.T
    return bool(
        symmetric.is_positive_definite if relation == "≻" else symmetric.is_positive_semidefinite
    )


def _words(value: Any) -> list[tuple[Any, list[Any]]]:
    """Return the coefficients and words of the expanded sum."""
    found = []
    for term in sympy.Add.make_args(sympy.expand(value)):
        scalars, factors = term.args_cnc()
        powers = (factor.as_base_exp() for factor in factors)
        found.append(
            (sympy.Mul(*scalars), [letter for letter, power in powers for _ in range(power)])
        )
    return found


def _is_known(value: Any, known: Iterable[Relation], *relations: str) -> bool:
    return any(
        fact.relation in relations and sympy.expand(fact.value - value) == 0 for fact in known
    )


def _not_negative(text: Text, factors: list[Any], known: Sequence[Relation]) -> bool:
    """Whether a product is a known form, a square or a pairing of entries, times known scalars and
    squares of them."""
    scalars, matrices = ([x for x in factors if x.is_commutative is kind] for kind in (True, False))
    while scalars:
        first = scalars.pop(0)
        if first in scalars:
            scalars.remove(first)
        elif not (first.is_positive or _is_known(first, known, "≥")):
            return False
    if not matrices or _is_known(sympy.Mul(*matrices), known, "≥", "⪰", "≻"):
        return True
    if len(matrices) not in (2, 3):
        return False
    first, *core, last = matrices
    if sympy.expand(first.transpose() - last) == 0:
        return all(_is_known(each, known, "⪰", "≻") for each in core)
    return text.is_number(sympy.Mul(*matrices)) and all(
        _is_known(each, known, "entries") for each in (first.transpose(), last, *core)
    )


def _follows(
    rule: str, text: Text, claim: Relation, source: Relation, other: Relation | None
) -> bool:
    """Whether the claim follows by the rule from `source` (a square or product) and the sign of
    `other`."""
    x = claim.value
    value = source.value
    kind = other and other.relation
    core = other.value if other else sympy.Integer(1)
    if (
        rule == "cancelling"
        and claim.relation == "="
        and source.relation in ("=", "≥", "⪰")
        and kind in (None, "≻")
    ):
        return text.same(x.transpose() * core * x, value if source.relation == "=" else -value)
    if rule == "dividing" and claim.relation == source.relation == "=" and kind == "≠":
        return text.is_number(core) and text.same(core * x, value)
    return (
        rule == "dominating"
        and claim.relation == source.relation == kind == "≥"
        and bool(x.is_commutative and core.is_commutative)
        and text.same(core * x - x**2, value)
    )

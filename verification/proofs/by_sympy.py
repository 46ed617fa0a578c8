"""SymPy as a second kernel: it reads the text of a statement by itself and checks the whole proof again.

It shares no formula code with the kernel. Python's own grammar parses the formulas; a letter becomes a non-commutative
symbol, its transpose another symbol, a scalar a commuting symbol. From the kernel it takes only the printed certificate
of each step, as text, and reads that too: every equation in square brackets must be one that stands before, every term
must be seen not to be negative, and SymPy must expand the claim minus all of them to zero. One rule goes beyond the
free algebra: a number (a 1 x 1 word) equals its own transpose.
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import sympy

from verification.proofs.cases import Case, Comparison
from verification.proofs.layout import Block

_SIGNS = {"−": "-", "·": "*", "[": "(", "]": ")", "I": "1", "ᵀ": "**T", "²": "**2", "³": "**3", "⁴": "**4"}
_BETWEEN = re.compile(r"(?<=[\w)])\s*(?=\()|(?<=\))\s*(?=\w)|(?<=\w)\s+(?=\w)")  # between two factors
_FLIPPED = "ᵀ"


class Relation(NamedTuple):
    """value relation 0, where the relation is one of = ≠ ≥ ⪰ ≻, or "entries": every entry is ≥ 0."""

    value: Any
    relation: str


class Text:
    """The formulas of one block, over SymPy's symbols or over the exact matrices of a case."""

    def __init__(self, block: Block, case: Case | None = None) -> None:
        self.shapes, self.exact = block.shapes, case is not None
        known = [*self.shapes, *(name for name, _ in block.abbreviations)]
        self.codes = {name: f"x{number}" for number, name in enumerate(known)}
        marks = sorted([*self.codes, *_SIGNS], key=len, reverse=True)
        self.token = re.compile("|".join(map(re.escape, marks)))
        self.values: dict[str, Any] = {}
        for name, shape in self.shapes.items():
            if case is None:
                self.values[self.codes[name]] = sympy.Symbol(name, commutative=not shape)
            elif name in case:
                rows = [[sympy.Rational(x.numerator, x.denominator) for x in row] for row in case[name]]
                self.values[self.codes[name]] = sympy.Matrix(rows) if shape else rows[0][0]
        for name, formula in block.abbreviations:
            if case is None or set(re.findall(r"x\d+", self.python(formula))) <= set(self.values):
                self.values[self.codes[name]] = self.read(formula)

    def python(self, formula: str) -> str:
        """Return the formula as Python: codes for names, and a * between neighbours."""
        spaced = self.token.sub(lambda m: f" {self.codes[m[0]]} " if m[0] in self.codes else _SIGNS[m[0]], formula)
        return _BETWEEN.sub("*", re.sub(r"\s+\*\*", "**", spaced.strip()))

    def read(self, formula: str) -> Any:
        return self.value(ast.parse(self.python(formula), mode="eval").body)

    def relation(self, formula: str) -> Relation:
        left, sign, right = re.split(r"([=≠≤≥⪯⪰≻])", formula)
        low, high = (right, left) if sign in "=≠≥⪰≻" else (left, right)
        value, sign = _plus(self.read(high), -self.read(low)), {"≤": "≥", "⪯": "⪰"}.get(sign, sign)
        number = self.exact or value.is_commutative or all(self.is_number(word) for _, word in _words(value))
        return Relation(value, sign if number or sign != "≥" else "entries")

    def value(self, node: ast.AST) -> Any:
        match node:
            case ast.BinOp(left, ast.Pow(), ast.Name("T")):
                value = self.value(left)
                return value.T if isinstance(value, sympy.MatrixBase) else self.transposed(value)
            case ast.BinOp(left, operation, right):
                return _OPERATIONS[type(operation)](self.value(left), self.value(right))
            case ast.UnaryOp(ast.USub(), operand):
                return -self.value(operand)
            case ast.Name(name):
                return self.values[name]
            case ast.Constant(int() as value):
                return sympy.Integer(value)
        raise ValueError(f"no formula: {ast.dump(node)}")

    def transposed(self, value: Any) -> Any:
        return sympy.Add(*(scale * sympy.Mul(*_reversed(word)) for scale, word in _words(value)))

    def is_number(self, word: Sequence[Any]) -> bool:
        """Whether the product has one row and one column."""
        return bool(word) and self._sizes(word[0])[0] == "1" == self._sizes(word[-1])[1]

    def _sizes(self, letter: Any) -> tuple[str, ...]:
        sizes = self.shapes[letter.name.removesuffix(_FLIPPED)]
        return sizes[::-1] if letter.name.endswith(_FLIPPED) else sizes

    def canonical(self, value: Any) -> Any:
        """Return the expanded value; of a 1 x 1 word and its transpose only the first by name remains."""
        terms = []
        for scale, word in _words(value):
            if self.is_number(word):
                word = min(word, _reversed(word), key=lambda letters: [x.name for x in letters])
            terms.append(scale * sympy.Mul(*word))
        return sympy.expand(sympy.Add(*terms))

    def same(self, one: Any, other: Any) -> bool:
        return bool(self.canonical(one - other) == 0)


def refusal(block: Block, certificates: Sequence[Sequence[str]], comparisons: Iterable[Comparison] = ()) -> str:
    """Return why SymPy refuses a step of the statement with these printed certificates; empty if it accepts all.

    A certificate has a line for each term and each cofactor; a step by cancelling, dividing or dominating has none.
    """
    text = Text(block)
    known = [text.relation(each) for entry in block.all("given", "where") for each in entry.formula.split(";")]
    steps = [(entry, [rule.formula for rule in block.entries[i + 1 : i + 2] if rule.key == "by"])
             for i, entry in enumerate(block.entries) if entry.key in ("lemma", "show")]  # fmt: skip
    for (entry, rule), lines in zip(steps, certificates, strict=True):
        claim, name = text.relation(entry.formula), entry.words or entry.formula
        if rule and rule[0] in ("cancelling", "dividing", "dominating"):
            if not any(_follows(rule[0], text, claim, one, other) for one in known for other in (*known, None)):
                return f"'{name}': SymPy finds no facts from which it follows by {rule[0]}"
        elif claim.relation not in ("=", "≥", "⪰"):
            return f"'{name}': a certificate shows no such relation"
        else:
            rest = claim.value
            for factors in (line.split(" · ") for line in lines):
                values = [text.read(factor) for factor in factors]
                equations = [value for factor, value in zip(factors, values, strict=True) if factor[0] == "["]
                if not (_established(text, equations[0], known) if equations else
                        claim.relation != "=" and _not_negative(text, values, known)):  # fmt: skip
                    return f"'{name}': SymPy knows no fact for {' · '.join(factors)}"
                rest -= sympy.Mul(*values)
            if not text.same(rest, 0):
                return f"'{name}': SymPy leaves {text.canonical(rest)}"
        known.append(claim)
    false = (each.says for each in comparisons if not each._replace(left=sympy.Rational(each.left)).is_true)
    return next((f"'{says}': false for SymPy" for says in false), "")


def holds(block: Block, formula: str, case: Case) -> bool:
    """Whether a formula holds in a case, by SymPy's rational matrices."""
    value, relation = Text(block, case).relation(formula)
    matrix = value if isinstance(value, sympy.MatrixBase) else sympy.Matrix([[value]])
    if relation in "=≠":
        return bool(matrix.is_zero_matrix) is (relation == "=")
    if relation == "≥":
        return all(entry >= 0 for entry in matrix)
    symmetric = matrix + matrix.T
    return bool(symmetric.is_positive_definite if relation == "≻" else symmetric.is_positive_semidefinite)


def _plus(one: Any, other: Any) -> Any:
    """Return the sum; a number among matrices is a multiple of the identity."""
    if isinstance(one, sympy.MatrixBase) is isinstance(other, sympy.MatrixBase):
        return one + other
    matrix, scalar = (one, other) if isinstance(one, sympy.MatrixBase) else (other, one)
    return matrix + (scalar * sympy.eye(matrix.rows) if scalar else sympy.zeros(*matrix.shape))


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
    names = [x.name.removesuffix(_FLIPPED) if x.name.endswith(_FLIPPED) else x.name + _FLIPPED for x in reversed(word)]
    return tuple(sympy.Symbol(name, commutative=False) for name in names)


def _established(text: Text, value: Any, known: Iterable[Relation]) -> bool:
    return any(fact.relation == "=" and sympy.expand(value - each) == 0
               for fact in known for each in (fact.value, text.transposed(fact.value)))  # fmt: skip


def _not_negative(text: Text, factors: list[Any], known: Sequence[Relation]) -> bool:
    """Whether a product is a known form, a square or a pairing of entries, times known scalars and squares of them."""
    def one_of(value: Any, *relations: str) -> bool:
        return any(fact.relation in relations and sympy.expand(fact.value - value) == 0 for fact in known)

    scalars, matrices = ([x for x in factors if x.is_commutative is kind] for kind in (True, False))
    while scalars:
        first = scalars.pop(0)
        if first in scalars:
            scalars.remove(first)
        elif not (first.is_positive or one_of(first, "≥")):
            return False
    if not matrices or one_of(sympy.Mul(*matrices), "≥", "⪰", "≻"):
        return True
    if len(matrices) not in (2, 3):
        return False
    first, *core, last = matrices
    if sympy.expand(text.transposed(first) - last) == 0:
        return all(one_of(each, "⪰", "≻") for each in core)
    ends = (text.transposed(first), last, *core)
    return text.is_number(_words(sympy.Mul(*matrices))[0][1]) and all(one_of(each, "entries") for each in ends)


def _follows(rule: str, text: Text, claim: Relation, source: Relation, other: Relation | None) -> bool:
    """Whether the claim follows by the rule from `source` (a square or product) and the sign of `other`."""
    x, value, kind = claim.value, source.value, other and other.relation
    core = other.value if other else sympy.Integer(1)
    if rule == "cancelling" and claim.relation == "=" and source.relation in ("=", "≥", "⪰") and kind in (None, "≻"):
        return text.same(text.transposed(x) * core * x, value if source.relation == "=" else -value)
    if rule == "dividing" and claim.relation == source.relation == "=" and kind == "≠":
        return text.same(core * x, value)
    return (rule == "dominating" and claim.relation == source.relation == kind == "≥"
            and bool(x.is_commutative and core.is_commutative) and text.same(core * x - x**2, value))  # fmt: skip


_OPERATIONS: Mapping[type[ast.operator], Any] = {
    ast.Add: _plus, ast.Sub: lambda one, other: _plus(one, -other), ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: operator.pow}  # fmt: skip

"""What a mutant may change: operators of cosmic-ray that fit numerical code, and some that it lacks."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cosmic_ray.operators.number_replacer import NumberReplacer
from cosmic_ray.operators.operator import Example, Operator
from cosmic_ray.plugins import get_operator
from parso.python.tree import Keyword, Name, PythonNode
from parso.tree import Leaf

_FROM_COSMIC_RAY = (
    "ReplaceBinaryOperator_Add_Sub",
    "ReplaceBinaryOperator_Sub_Add",
    "ReplaceBinaryOperator_Mul_Div",
    "ReplaceBinaryOperator_Div_Mul",
    "ReplaceUnaryOperator_Delete_USub",
    "ReplaceUnaryOperator_Delete_Not",
    "ReplaceComparisonOperator_Lt_LtE",
    "ReplaceComparisonOperator_Lt_GtE",
    "ReplaceComparisonOperator_LtE_Lt",
    "ReplaceComparisonOperator_LtE_Gt",
    "ReplaceComparisonOperator_Gt_GtE",
    "ReplaceComparisonOperator_Gt_LtE",
    "ReplaceComparisonOperator_GtE_Gt",
    "ReplaceComparisonOperator_GtE_Lt",
    "ReplaceComparisonOperator_Eq_NotEq",
    "ReplaceComparisonOperator_NotEq_Eq",
    "ReplaceAndWithOr",
    "ReplaceOrWithAnd",
    "ReplaceTrueWithFalse",
    "ReplaceFalseWithTrue",
    "ReplaceBreakWithContinue",
    "ReplaceContinueWithBreak",
)


# Arrays of one entry, as the records of the kernels declare them: `clock: np.ndarray  # (1,) int64`.
_DECLARED = re.compile(r"^ +(\w+): np\.ndarray  # \(1,\)", re.MULTILINE)
_ENGINE = Path(__file__).resolve().parents[2] / "iapb"
ONE_ENTRY = {name for path in _ENGINE.glob("*/kernels/*.py") for name in _DECLARED.findall(path.read_text())}


def _ends_of_one(number: Any) -> bool:
    """Is this the 0 of `shape[0]`, or of an array of one entry?"""
    bracket = number.get_previous_leaf()
    of = bracket.get_previous_leaf() if number.value == "0" and bracket.value == "[" else None
    return of is not None and of.value in ONE_ENTRY | {"shape"}


def _swallows_one(number: str) -> bool:
    value = ast.literal_eval(number)
    return bool(value + 1 == value)


def _operator_of(statement: Any) -> str:
    return str(statement.children[1].get_code().strip())


class Constant(NumberReplacer):
    """A number ± 1: constants, indices and the ends of ranges.

    But the last entry of one is its first (`shape[-1]` of a vector too), and 1e300 + 1 is 1e300.
    """

    def mutation_positions(self, node: Any) -> Iterator[Any]:
        positions = list(super().mutation_positions(node))
        if positions and _swallows_one(node.value):
            return
        yield from positions[:1] if positions and _ends_of_one(node) else positions


class _OtherToken(Operator):
    """One token for another: `_OTHER` says which, `_KIND` which sort of token, the docstring of each child why."""

    _KIND: type = Leaf
    _OTHER: dict[str, str] = {}

    def mutation_positions(self, node: Any) -> Iterator[Any]:
        if isinstance(node, self._KIND) and node.value in self._OTHER:
            yield node.start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        node.value = self._OTHER[node.value]
        return node


class AugmentedSign(_OtherToken):
    """`a += b` becomes `a -= b`, and the other way round; `*=` and `/=` likewise."""

    _OTHER = {"+=": "-=", "-=": "+=", "*=": "/=", "/=": "*="}

    @classmethod
    def examples(cls) -> tuple[Example, ...]:
        return (Example("a += b", "a -= b"),)


class OtherExtreme(_OtherToken):
    """`min` becomes `max`, and the other way round."""

    _KIND = Name
    _OTHER = {"min": "max", "max": "min"}

    @classmethod
    def examples(cls) -> tuple[Example, ...]:
        return (Example("min(a, b)", "max(a, b)"),)


class DropStatement(Operator):
    """A call or an augmented assignment that stands alone on its line becomes `pass`."""

    def mutation_positions(self, node: Any) -> Iterator[Any]:
        if isinstance(node, PythonNode) and node.type == "simple_stmt":
            statement = node.children[0]
            call = statement.type == "atom_expr" and statement.children[-1].type == "trailer"
            augmented = statement.type == "expr_stmt" and statement.children[1].type in ("operator", "augassign")
            if call or (augmented and _operator_of(statement) != "="):
                yield statement.start_pos, statement.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        first = node.get_first_leaf()
        node.children[0] = Keyword("pass", first.start_pos, prefix=first.prefix)
        return node

    @classmethod
    def examples(cls) -> tuple[Example, ...]:
        return (Example("f(x)", "pass"), Example("a += b", "pass"))


OPERATORS: dict[str, Operator] = {
    **{name: get_operator(f"core/{name}")() for name in _FROM_COSMIC_RAY},
    **{kind.__name__: kind() for kind in (Constant, AugmentedSign, OtherExtreme, DropStatement)},
}

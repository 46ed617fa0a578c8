"""Functions of time in a scene file: arithmetic with t, pi and a few functions, read without
running Python code.

Their values have the same bits on every processor, because libm is not used: `iapb.numerics.elementary`
gives sines, decimal arithmetic the exponential, and multiplication powers.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable
from decimal import Decimal
from functools import cache
from threading import Lock
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator

from iapb.errors import IapbError
from iapb.scene.parts import Text, expectation

Function = Callable[[float], float]

MAX_POWER = 16
_LARGEST_EXPONENT = 709.0  # its exponential is still a double


def _sine_cosine(x: float) -> tuple[float, float]:
    from iapb.numerics.elementary import sine_cosine  # brings numba along

    return sine_cosine(x)


def _exp(x: float) -> float:
    return float(Decimal(min(x, _LARGEST_EXPONENT + 1.0)).exp()) if x > -750.0 else 0.0


def _power(base: float, exponent: float) -> float:
    if exponent != int(exponent) or not 0 <= exponent <= MAX_POWER:
        raise ValueError(f"a power is a whole number from 0 to {MAX_POWER}")
    return math.prod([base] * int(exponent))


FUNCTIONS: dict[str, tuple[Callable[..., float], int]] = {  # with the least number of arguments
    "sin": (lambda x: _sine_cosine(x)[0], 1),
    "cos": (lambda x: _sine_cosine(x)[1], 1),
    "exp": (_exp, 1),
    "sqrt": (math.sqrt, 1),
    "abs": (abs, 1),
    "step": (lambda x: 1.0 if x >= 0.0 else 0.0, 1),
    "min": (min, 2),
    "max": (max, 2),
}
_OPERATORS: dict[type, Callable[..., float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: _power,
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
}
_KNOWN = (
    f"numbers, t, pi, + - * / **, and {', '.join(FUNCTIONS)} (step(x) is 1 where x >= 0, else 0)"
)


_parsing = Lock()


def syntax_tree(source: str | bytes, mode: str = "exec") -> Any:
    """Return `ast.parse` of a source, one thread at a time.

    Python 3.11 raises SystemError where two threads parse and a callback of the garbage collector
    lets them take turns, as on a worker of dask.
    """
    with _parsing:
        return ast.parse(source, mode=mode)


@cache
def function_of(text: str) -> Function:
    """Return the function of t that a checked text describes; it raises IapbError if its value is
    not finite."""
    inner = _made(syntax_tree(text, mode="eval").body)

    def function(t: float) -> float:
        try:
            value = float(inner(t))
        except (ValueError, ArithmeticError) as error:
            raise IapbError(f"{text} has no value at t = {t:g}: {error}") from error
        if not math.isfinite(value):
            raise IapbError(f"{text} is {value} at t = {t:g}")
        return value

    return function


def _made(node: ast.expr) -> Function:
    """Turn one node into a function of t; raise SyntaxError for a node that an expression may not
    contain."""
    called: Callable[..., float] | None = None
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            number = float(value)
            return lambda t: number
        case ast.Name(id="t"):
            return lambda t: t
        case ast.Name(id="pi"):
            return lambda t: math.pi
        case ast.BinOp(left=left, op=op, right=right):
            called = _OPERATORS.get(type(op))
            given = [left, right]
        case ast.UnaryOp(operand=operand, op=op):
            called = _OPERATORS.get(type(op))
            given = [operand]
        case ast.Call(func=ast.Name(id=name), args=given, keywords=[]) if name in FUNCTIONS:
            called, least = FUNCTIONS[name]
            if len(given) != least and not (least == 2 and len(given) > 2):
                raise SyntaxError(f"{name} takes {least} number{'s or more' if least > 1 else ''}")
    if called is None:
        raise SyntaxError(f"an expression of {_KNOWN}")
    arguments = [_made(argument) for argument in given]
    return lambda t: called(*(argument(t) for argument in arguments))


def _checked(text: str) -> str:
    """Return the text if it is an expression with a finite value at t = 0."""
    try:
        function_of(text)(0.0)
    except IapbError as error:
        raise expectation(f"a finite number at t = 0: {error}") from error
    except (SyntaxError, ValueError, RecursionError, MemoryError, OverflowError) as error:
        said = (
            error.msg
            if isinstance(error, SyntaxError) and error.lineno is None
            else f"an expression of {_KNOWN}"
        )
        raise expectation(said) from error
    return text


Expression = Annotated[
    Text,
    BeforeValidator(
        lambda given: repr(given) if type(given) in (int, float) else given,
        json_schema_input_type=float | Text,
    ),
    AfterValidator(_checked),
]

"""Functions of time in a scene file: arithmetic with t, pi and a few functions, read without running Python code.

Their values have the same bits on every processor: they use decimal arithmetic in place of libm, and multiplication for
powers.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable
from decimal import Decimal, localcontext
from functools import cache
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator

from iapb.errors import IapbError
from iapb.scene.parts import Text, expectation

Function = Callable[[float], float]

MAX_POWER = 16
_DIGITS = 70  # decimals of an angle: a double has 17 digits and comes as near as 1e-19 to a multiple of pi
_NEGLIGIBLE = Decimal("1e-50")
_LARGEST_EXPONENT = 709.0  # its exponential is still a double


def _exp(x: float) -> float:
    return float(Decimal(min(x, _LARGEST_EXPONENT + 1.0)).exp()) if x > -750.0 else 0.0


@cache
def _pi(digits: int) -> Decimal:
    """Return pi to so many digits by Machin's formula 16 atan 1/5 - 4 atan 1/239, in integers with ten more digits."""
    total = 0
    for factor, n in ((16, 5), (-4, 239)):
        power, k = factor * 10 ** (digits + 10) // n, 1
        while abs(power) > 1:
            total += power // k
            power, k = -power // (n * n), k + 2
    return Decimal(total).scaleb(-digits - 10)


def _sine(x: float, odd: int = 1) -> float:
    """Return sin x, or cos x with odd = 0, by the series of x modulo 2 pi with enough digits for any double."""
    turns = max(Decimal(x).adjusted(), 0)  # digits of the whole turns in x
    with localcontext(prec=_DIGITS + turns):
        angle = Decimal(x) % (2 * _pi(_DIGITS + turns))
    with localcontext(prec=_DIGITS):
        term = total = angle if odd else Decimal(1)
        n = 1 + odd
        while abs(term) > _NEGLIGIBLE:
            term *= -angle * angle / (n * (n + 1))
            total += term
            n += 2
        return float(total)


def _power(base: float, exponent: float) -> float:
    if exponent != int(exponent) or not 0 <= exponent <= MAX_POWER:
        raise ValueError(f"a power is a whole number from 0 to {MAX_POWER}")
    return math.prod([base] * int(exponent))


NAMES = {"pi": math.pi}
FUNCTIONS: dict[str, tuple[Callable[..., float], int]] = {  # with the least number of arguments
    "sin": (_sine, 1), "cos": (lambda x: _sine(x, 0), 1), "exp": (_exp, 1),
    "sqrt": (math.sqrt, 1), "abs": (abs, 1), "step": (lambda x: 1.0 if x >= 0.0 else 0.0, 1),
    "min": (min, 2), "max": (max, 2),
}
_OPERATORS: dict[type, Callable[..., float]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv, ast.Pow: _power,
    ast.UAdd: operator.pos, ast.USub: operator.neg,
}
_KNOWN = f"numbers, t, pi, + - * / **, and {', '.join(FUNCTIONS)} (step(x) is 1 where x >= 0, else 0)"


@cache
def function_of(text: str) -> Function:
    """Return the function of t that a checked text describes; it raises IapbError if its value is not finite."""
    inner = _made(ast.parse(text, mode="eval").body)

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
    """Turn one node into a function of t; raise SyntaxError for a node that an expression may not contain."""
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            number = float(value)
            return lambda t: number
        case ast.Name(id="t"):
            return lambda t: t
        case ast.Name(id=name) if name in NAMES:
            return lambda t: NAMES[name]
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
            of, first, second = _OPERATORS[type(op)], _made(left), _made(right)
            return lambda t: of(first(t), second(t))
        case ast.UnaryOp(operand=operand, op=op) if type(op) in _OPERATORS:
            of, only = _OPERATORS[type(op)], _made(operand)
            return lambda t: of(only(t))
        case ast.Call(func=ast.Name(id=name), args=given, keywords=[]) if name in FUNCTIONS:
            called, least = FUNCTIONS[name]
            if len(given) != least and not (least == 2 and len(given) > 2):
                raise SyntaxError(f"{name} takes {least} number{'s or more' if least > 1 else ''}")
            arguments = [_made(argument) for argument in given]
            return lambda t: called(*(argument(t) for argument in arguments))
    raise SyntaxError(f"an expression of {_KNOWN}")


def _checked(text: str) -> str:
    """Return the text if it is an expression with a finite value at t = 0."""
    try:
        function_of(text)(0.0)
    except IapbError as error:
        raise expectation(f"a finite number at t = 0: {error}") from error
    except (SyntaxError, ValueError, RecursionError, MemoryError, OverflowError) as error:
        said = error.msg if isinstance(error, SyntaxError) and error.lineno is None else f"an expression of {_KNOWN}"
        raise expectation(said) from error
    return text


def _as_text(given: Any) -> Any:
    return repr(given) if isinstance(given, int | float) and not isinstance(given, bool) else given


Expression = Annotated[Text, BeforeValidator(_as_text), AfterValidator(_checked)]

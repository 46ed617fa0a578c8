"""Convert LaTeX to MathML at build time, so that formulas need no script, and format numbers in
sentences."""

from __future__ import annotations

import re

from markupsafe import Markup, escape

from reports.figures.numbers import MINUS, TIMES

_INLINE = re.compile(r"\$([^$]+)\$")
_POWER = re.compile(r"(?<![\w.])(-?\d(?:\.\d+)?)e([+-]?\d{1,3})(?!\w)")
_NEGATIVE = re.compile(r"(?<![\w.-])-(?=\d)")


def formula(latex: str, display: str = "block") -> Markup:
    """Return the MathML of a formula."""
    from latex2mathml.converter import convert

    return Markup(convert(latex, display=display))


def prose(text: str) -> Markup:
    """Return text with its ``$...$`` formulas as MathML, powers of ten as 10ⁿ, and the rest
    escaped."""
    return Markup("").join(
        formula(piece, "inline") if k % 2 else _powers(piece)
        for k, piece in enumerate(_INLINE.split(text))
    )


def _powers(text: str) -> Markup:
    """Return escaped text in which 2.0e-16 becomes 2.0 · 10⁻¹⁶, -1 gets a true minus sign, and >=
    becomes ≥."""
    signs = str(escape(text.replace(">=", "≥").replace("<=", "≤")))
    return Markup(_NEGATIVE.sub(MINUS, _POWER.sub(_power, signs)))


def _power(match: re.Match[str]) -> str:
    mantissa = match.group(1)
    exponent = int(match.group(2))
    if float(mantissa) == 0.0:
        return "0"
    mantissa = mantissa.replace("-", MINUS)
    if exponent == 0:
        return mantissa
    power = f"10<sup>{str(exponent).replace('-', chr(0x2212))}</sup>"
    return power if mantissa == "1" else f"{mantissa}{TIMES}{power}"

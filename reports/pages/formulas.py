"""Convert LaTeX to MathML at build time, so that formulas need no script, and format numbers in
sentences."""

from __future__ import annotations

import re

from markupsafe import Markup, escape

_INLINE = re.compile(r"\$([^$]+)\$")
_REFERENCE = re.compile(r"&#x([0-9A-Fa-f]+);")
_GROUP_OF_ONE = re.compile(r"<mrow>(<(m[ion])>[^<]*</\2>)</mrow>")
_POWER = re.compile(r"(?<![\w.])(-?\d(?:\.\d+)?)e([+-]?\d{1,3})(?!\w)")
_NEGATIVE = re.compile(r"(?<![\w.-])-(?=\d)")


def formula(latex: str, display: str = "block") -> Markup:
    """Return the MathML of a formula."""
    from latex2mathml.converter import convert

    return Markup(_shortened(convert(latex, display=display)))


def _shortened(mathml: str) -> str:
    """Return the same formula in half the bytes: plain characters, no groups of one element, no
    implied namespace."""
    text = _REFERENCE.sub(lambda reference: str(escape(chr(int(reference.group(1), 16)))), mathml)
    text = _GROUP_OF_ONE.sub(r"\1", text.replace(' xmlns="http://www.w3.org/1998/Math/MathML"', ""))
    return text.replace('<mspace width="0.167em" />', '<mspace width=".17em"/>')


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
    return Markup(_NEGATIVE.sub("\N{MINUS SIGN}", _POWER.sub(_power, signs)))


def _power(match: re.Match[str]) -> str:
    mantissa = match.group(1)
    exponent = int(match.group(2))
    if float(mantissa) == 0.0:
        return "0"
    mantissa = mantissa.replace("-", "\N{MINUS SIGN}")
    if exponent == 0:
        return mantissa
    power = f"10<sup>{str(exponent).replace('-', chr(0x2212))}</sup>"
    return (
        power
        if mantissa == "1"
        else f"{mantissa}\N{NARROW NO-BREAK SPACE}·\N{NARROW NO-BREAK SPACE}{power}"
    )

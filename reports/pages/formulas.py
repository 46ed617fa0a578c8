"""LaTeX to MathML, at build time: the page shows formulas without any script. And numbers in sentences."""

from __future__ import annotations

import re

from markupsafe import Markup, escape

_INLINE = re.compile(r"\$([^$]+)\$")
_POWER = re.compile(r"(?<![\w.])(-?\d(?:\.\d+)?)e([+-]?\d{1,3})(?!\w)")
_NEGATIVE = re.compile(r"(?<![\w.-])-(?=\d)")


def formula(latex: str, display: str = "block") -> Markup:
    """Return the MathML of a formula."""
    from latex2mathml.converter import convert

    return Markup(convert(latex, display=display))


def prose(text: str) -> Markup:
    """Return text with its ``$...$`` formulas as MathML, powers of ten as people write them, the rest escaped."""
    pieces = _INLINE.split(text)
    return Markup("").join(
        formula(piece, "inline") if number % 2 else _powers(piece) for number, piece in enumerate(pieces)
    )


def _powers(text: str) -> Markup:
    """Return escaped text in which 2.0e-16 reads 2.0 · 10⁻¹⁶, -1 has a true minus sign and >= is one sign."""
    signs = text.replace(">=", "≥").replace("<=", "≤")
    return Markup(_NEGATIVE.sub("\N{MINUS SIGN}", _POWER.sub(_power, str(escape(signs)))))


def _power(match: re.Match[str]) -> str:
    mantissa, exponent = match.group(1), int(match.group(2))
    if float(mantissa) == 0.0:
        return "0"
    mantissa = mantissa.replace("-", "\N{MINUS SIGN}")
    if exponent == 0:
        return mantissa
    power = f"10<sup>{str(exponent).replace('-', chr(0x2212))}</sup>"
    return power if mantissa == "1" else f"{mantissa}\N{NARROW NO-BREAK SPACE}·\N{NARROW NO-BREAK SPACE}{power}"

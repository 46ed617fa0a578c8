"""LaTeX to MathML, at build time: the page shows formulas without any script."""

from __future__ import annotations

import re

from markupsafe import Markup, escape

_INLINE = re.compile(r"\$([^$]+)\$")


def formula(latex: str, display: str = "block") -> Markup:
    """Return the MathML of a formula."""
    from latex2mathml.converter import convert

    return Markup(convert(latex, display=display))


def prose(text: str) -> Markup:
    """Return text with its ``$...$`` formulas as MathML and everything else escaped."""
    pieces = _INLINE.split(text)
    return Markup("").join(
        formula(piece, "inline") if number % 2 else escape(piece) for number, piece in enumerate(pieces)
    )

"""The swatch of a curve in a legend: its line and its marker, as a small inline SVG."""

from __future__ import annotations

from markupsafe import Markup

from reports.figures.style import PAPER, VARIABLES, LineStyle

_MARKERS = {
    "o": '<circle cx="18" cy="7" r="3.6"/>',
    "s": '<rect x="14.6" y="3.6" width="6.8" height="6.8"/>',
    "^": '<path d="M18 2.6 22 10.4 14 10.4z"/>',
    "v": '<path d="M18 11.4 22 3.6 14 3.6z"/>',
    "<": '<path d="M13.6 7 21.4 11V3z"/>',
    ">": '<path d="M22.4 7 14.6 11V3z"/>',
    "D": '<path d="M18 2.4 22.6 7 18 11.6 13.4 7z"/>',
    "P": '<path d="M16.4 3h3.2v2.4H22v3.2h-2.4V11h-3.2V8.6H14V5.4h2.4z"/>',
    "X": '<path d="M14.5 5 16 3.5l2 2 2-2L21.5 5l-2 2 2 2L20 10.5l-2-2-2 2L14.5 9l2-2z"/>',
    "|": '<path d="M17 2h2v10h-2z"/>',
    "*": '<path d="M18 2l1.4 3.4 3.6.2-2.8 2.3 1 3.6L18 9.5l-3.2 2 1-3.6L13 5.6l3.6-.2z"/>',
}


def _color(value: str) -> str:
    return f"var(--{VARIABLES[value]}, {value})"


def swatch(look: LineStyle) -> Markup:
    """Return the swatch of a style."""
    line = _line(look) if look.width else ""
    marker = _MARKERS.get(look.marker, "")
    if marker:
        fill, edge = (look.color, PAPER) if look.filled else (PAPER, look.color)
        marker = f'<g fill="{_color(fill)}" stroke="{_color(edge)}">{marker}</g>'
    return Markup(f'<svg class="swatch" viewBox="0 0 36 14" aria-hidden="true">{line}{marker}</svg>')


def _line(look: LineStyle) -> str:
    dash = f' stroke-dasharray="{" ".join(f"{1.6 * part:g}" for part in look.dash)}"' if look.dash else ""
    width = f'stroke-width="{look.width * 1.25:g}"'
    return f'<path d="M1 7H35" fill="none" stroke="{_color(look.color)}" {width}{dash}/>'

"""Figures outside of the report: one self-contained file with the panels side by side and the legend; and swatches.

Colours are the fallbacks of the page's variables.
"""

from __future__ import annotations

import re

from markupsafe import Markup, escape

from reports.figures.figure import Figure
from reports.figures.style import INK, MUTED, PAPER, LineStyle, css

_GAP, _LABEL, _LEGEND = 24.0, 26.0, 34.0  # points: between panels, above them, below them
_SWATCH = (36, 14)
_LETTER = 6.4  # points: mean width of a letter of the legend
_FONT = 'font-family="DejaVu Sans, Verdana, sans-serif" font-size="11"'
_TABLE = (
    "body { font: 14px/1.4 Verdana, sans-serif } table { border-collapse: collapse } th { font-weight: 400 } "
    "td, th { padding: .3em .6em; text-align: center; border: 2px solid #fff } small { display: block } "
    "th[scope=row], .plain * { text-align: left } .swatch { width: 36px; height: 14px } "
    ".hatched { background: repeating-linear-gradient(135deg, #ccc 0 1px, transparent 1px 5px) } "
    "li { list-style: none } .upright thead span { writing-mode: vertical-rl; rotate: 180deg }"
)
_MARKERS = {
    "o": '<circle cx="18" cy="7" r="3.6"/>',
    "s": '<rect x="14.6" y="3.6" width="6.8" height="6.8"/>',
    "^": '<path d="M18 2.6 22 10.4 14 10.4z"/>',
    "v": '<path d="M18 11.4 22 3.6 14 3.6z"/>',
    "<": '<path d="M13.6 7 21.4 11V3z"/>',
    ">": '<path d="M22.4 7 14.6 11V3z"/>',
    "D": '<path d="M18 2.4 22.6 7 18 11.6 13.4 7z"/>',
    "d": '<path d="M18 2 20.6 7 18 12 15.4 7z"/>',
    "P": '<path d="M16.4 3h3.2v2.4H22v3.2h-2.4V11h-3.2V8.6H14V5.4h2.4z"/>',
    "X": '<path d="M14.5 5 16 3.5l2 2 2-2L21.5 5l-2 2 2 2L20 10.5l-2-2-2 2L14.5 9l2-2z"/>',
    "|": '<path d="M17 2h2v10h-2z"/>',
    "*": '<path d="M18 2l1.4 3.4 3.6.2-2.8 2.3 1 3.6L18 9.5l-3.2 2 1-3.6L13 5.6l3.6-.2z"/>',
}


def swatch(look: LineStyle) -> Markup:
    """Return the line and marker of a style, for legends, as a small inline SVG."""
    line = marker = ""
    if look.width:
        dash = f' stroke-dasharray="{" ".join(f"{1.6 * part:g}" for part in look.dash)}"' if look.dash else ""
        line = f'<path d="M1 7H35" fill="none" stroke="{css(look.color)}" stroke-width="{look.width * 1.25:g}"{dash}/>'
    if look.marker in _MARKERS:
        fill, edge = (look.color, PAPER) if look.filled else (PAPER, look.color)
        marker = f'<g fill="{css(fill)}" stroke="{css(edge)}">{_MARKERS[look.marker]}</g>'
    return Markup(f'<svg class="swatch" viewBox="0 0 36 14" aria-hidden="true">{line}{marker}</svg>')


def standalone(figure: Figure) -> str:
    """Return the figure as the text of one SVG file, or of one HTML file if a panel is a table."""
    if any(panel.is_table for panel in figure.panels):
        legend = Markup("").join(Markup("<li>{} {}</li>").format(swatch(look), text) for text, look in figure.legend)
        panels = Markup("").join(Markup("<h3>{}</h3>{}").format(panel.label, Markup(panel.svg))
                                 for panel in figure.panels)  # fmt: skip
        return str(Markup('<!DOCTYPE html>\n<meta charset="utf-8"><title>{0}</title><style>{1}</style>\n<h2>{0}</h2>'
                          "<ul>{2}</ul>{3}<p>{4}</p>\n").format(figure.title, Markup(_TABLE), legend, panels,
                                                                figure.caption))  # fmt: skip
    parts, x, tallest = [], _GAP, 0.0
    for panel in figure.panels:
        width, height = (float(part) for part in re.findall(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', panel.svg)[0])
        parts.append(f'<text x="{x:g}" y="{_LABEL - 6:g}" fill="{MUTED}">{escape(panel.label)}</text>')
        place = f'<svg x="{x:g}" y="{_LABEL:g}" width="{width:g}" height="{height:g}"'
        parts.append(panel.svg.replace("<svg", place, 1))
        x, tallest = x + width + _GAP, max(tallest, height)
    whole, below = x, tallest + _LABEL + _GAP + 0.5 * _LEGEND
    steps = [_SWATCH[0] + 8 + _LETTER * len(text) + 22 for text, _ in figure.legend]
    x = (whole - sum(steps)) / 2
    for (text, look), step in zip(figure.legend, steps, strict=True):
        place = f'<svg x="{x:g}" y="{below - 11:g}" width="{_SWATCH[0]}" height="{_SWATCH[1]}"'
        parts.append(swatch(look).replace("<svg", place, 1))
        parts.append(f'<text x="{x + _SWATCH[0] + 8:g}" y="{below:g}" fill="{INK}">{escape(text)}</text>')
        x += step
    size = f"{whole:g}", f"{below + 0.5 * _LEGEND:g}"
    alt = escape(" ".join(panel.alt for panel in figure.panels))
    return "\n".join([
        f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
        f'viewBox="0 0 {size[0]} {size[1]}" width="{size[0]}" height="{size[1]}" role="img" {_FONT}>',
        f"<title>{escape(figure.title)}</title><desc>{alt}</desc>",
        f'<rect width="100%" height="100%" fill="{PAPER}"/>', *parts, "</svg>\n"])  # fmt: skip

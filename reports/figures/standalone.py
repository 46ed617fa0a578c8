"""Write a figure as one self-contained SVG file: its panels side by side, with the legend below.

It is meant for places outside of the report, such as a README. There, the fallback colours of the variables are used.
"""

from __future__ import annotations

import re
from html import escape

from reports.figures.figure import Figure, Panel
from reports.figures.legend import swatch
from reports.figures.style import INK, MUTED, PAPER

_GAP, _LABEL, _LEGEND = 24.0, 26.0, 34.0  # points: between panels, above them, below them
_SWATCH = (36.0, 14.0)
_LETTER = 6.4  # points: mean width of a letter of the legend
_FONT = 'font-family="DejaVu Sans, Verdana, sans-serif" font-size="11"'
_VIEW_BOX = re.compile(r'viewBox="0 0 ([\d.]+) ([\d.]+)"')


def standalone(figure: Figure) -> str:
    """Return the figure as the text of one SVG file."""
    sizes = [_size(panel) for panel in figure.panels]
    width = sum(size[0] for size in sizes) + _GAP * (len(sizes) + 1)
    height = max(size[1] for size in sizes) + _LABEL + _LEGEND + _GAP
    alt = escape(" ".join(panel.alt for panel in figure.panels))
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
        f'viewBox="0 0 {width:g} {height:g}" width="{width:g}" height="{height:g}" role="img" {_FONT}>',
        f"<title>{escape(figure.title)}</title><desc>{alt}</desc>",
        f'<rect width="100%" height="100%" fill="{PAPER}"/>',
        *_panels(figure, sizes),
        _legend(figure, width, height),
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


def _size(panel: Panel) -> tuple[float, float]:
    found = _VIEW_BOX.search(panel.svg)
    return (float(found.group(1)), float(found.group(2))) if found else (300.0, 220.0)


def _panels(figure: Figure, sizes: list[tuple[float, float]]) -> list[str]:
    parts, x = [], _GAP
    for panel, (width, height) in zip(figure.panels, sizes, strict=True):
        parts.append(f'<text x="{x:g}" y="{_LABEL - 6:g}" fill="{MUTED}">{escape(panel.label)}</text>')
        place = f'<svg x="{x:g}" y="{_LABEL:g}" width="{width:g}" height="{height:g}"'
        parts.append(re.sub(r"^<svg", place, panel.svg, count=1))
        x += width + _GAP
    return parts


def _legend(figure: Figure, width: float, height: float) -> str:
    """Return the legend as SVG: swatch and name of each curve, centred."""
    steps = [_SWATCH[0] + 8 + _LETTER * len(text) + 22 for text, _ in figure.legend]
    x, y = (width - sum(steps)) / 2, height - _LEGEND / 2
    parts = []
    for (text, style), step in zip(figure.legend, steps, strict=True):
        place = f'<svg x="{x:g}" y="{y - 11:g}" width="{_SWATCH[0]:g}" height="{_SWATCH[1]:g}"'
        parts.append(str(swatch(style)).replace("<svg", place, 1))
        parts.append(f'<text x="{x + _SWATCH[0] + 8:g}" y="{y:g}" fill="{INK}">{escape(text)}</text>')
        x += step
    return "\n".join(parts)

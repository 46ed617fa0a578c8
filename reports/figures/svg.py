"""Convert a matplotlib figure to an SVG string that is reproducible byte for byte and can be embedded in a page.

The SVG has no date and no metadata. Its identifiers are salted and unique in the page, coordinates are rounded to
0.01 pt, colours are variables of the page (with the colour itself as fallback), and text stays text.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from typing import Any

from reports.figures.style import VARIABLES, css

LARGEST_ENLARGEMENT = 1.35  # wider drawings would have too large letters
_NUMBER, _COMMAND = re.compile(r"-?\d+\.\d{3,}"), re.compile(r"\s*([MLCQz])\s*")
_MARKERS = r"(?:<use [^>]*/>)+</g>"


def _clipped_once(run: re.Match[str]) -> str:
    group = f'<g clip-path="{run.group(1)}">'
    return group + run.group().replace(group, "").replace("</g>", "") + "</g>"


def _styled_once(run: re.Match[str]) -> str:
    style = f' style="{run.group(1)}"'
    return f"<g{style}>{run.group().replace(style, '')}</g>"


_CLEANED: tuple[tuple[str, str | Callable[[re.Match[str]], str]], ...] = (
    # a <style> would leak into the page
    (r"(?s)(?:<metadata>.*?</metadata>|<!--.*?-->|<defs>\s*<style.*?</style>\s*</defs>)\s*", ""),
    (r'\sid="(curve|name)=([^"]*)"', r' data-\1="\2"'),  # what a gid tells the page's script
    # coordinates are inside of tags; the numbers between them are for people
    (r"<[^>]+>", lambda tag: _NUMBER.sub(lambda number: f"{float(number[0]):.2f}".rstrip("0").rstrip("."), tag[0])),
    (r'\stransform="rotate\(-?0 [^)]*\)"', ""),
    (r'\sd="[^"]*"', lambda path: " " + _COMMAND.sub(r"\1", path[0].strip())),  # letters part the numbers of a path
    (r">\s+<", "><"),
    (rf'<g clip-path="([^"]*)">{_MARKERS}(?:<g clip-path="\1">{_MARKERS})+', _clipped_once),
    (r'<use [^>]*? style="([^"]*)"/>(?:<use [^>]*? style="\1"/>)+', _styled_once),
    (r"'DejaVu Sans'[^;\"]*", "var(--sans, sans-serif)"),
    ("|".join(VARIABLES), lambda color: css(color[0])),
)


def to_svg(drawing: Any, key: str) -> str:
    """Return the figure as one `<svg>` element; `key` makes its identifiers unique in the page.

    The page sets the size, up to LARGEST_ENLARGEMENT; the viewBox keeps the proportions.
    """
    buffer = io.StringIO()
    drawing.savefig(buffer, format="svg", bbox_inches=None,
                    metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))  # fmt: skip
    head, text = buffer.getvalue().split("<svg", 1)[1].split(">", 1)
    head = re.sub(r'\s(?:width|height|version|xmlns:xlink)="[^"]*"', "", head)
    widest = LARGEST_ENLARGEMENT * round(96 * drawing.get_size_inches()[0])
    text = (f'<svg{head} xmlns:xlink="http://www.w3.org/1999/xlink" style="max-width: {widest:.0f}px">'
            f"{text}")
    for pattern, new in _CLEANED:
        text = re.sub(pattern, new, text)
    referred = dict.fromkeys(re.findall(r'(?:url\(#|href="#)([^)"]+)', text))
    names = {old: f"{key}-{number}" for number, old in enumerate(referred)}
    text = re.sub(r'\sid="([^"]+)"', lambda id: f' id="{names[id[1]]}"' if id[1] in names else "", text)
    return re.sub(r'(url\(#|href="#)([^)"]+)', lambda link: link[1] + names[link[2]], text).strip()

"""From a matplotlib figure to an SVG string that repeats byte for byte and can stand inside a page.

No date, no metadata, salted identifiers that are unique in the page, coordinates to 0.01 pt (or finer), colours as the
page's variables (with the colour itself as fallback), text as text.
"""

from __future__ import annotations

import io
import re
from typing import Any

from reports.figures.style import VARIABLES

LARGEST_ENLARGEMENT = 1.35  # beyond, the lettering would shout
_NUMBER = re.compile(r"-?\d+\.\d{3,}")
_TAG = re.compile(r"<[^>]+>")  # coordinates are inside of tags; the numbers between them are for people
_IDENTIFIER = re.compile(r'\sid="([^"]+)"')
_TOLD = re.compile(r'\sid="(curve|axis|label)=([^"]*)"')  # what a gid tells the page's script, see traces.py
_TURNED_BY_NOTHING = re.compile(r'\stransform="rotate\(-?0 [^)]*\)"')
_COMMAND = re.compile(r"\s*([MLCQz])\s*")  # of a path's data; the letters part the numbers by themselves
_PATH = re.compile(r'\sd="[^"]*"')
_MARKERS = r"(?:<use [^>]*/>)+</g>"
_SAME_CLIP = re.compile(rf'<g clip-path="([^"]*)">{_MARKERS}(?:<g clip-path="\1">{_MARKERS})+')
_SAME_STYLE = re.compile(r'<use [^>]*? style="([^"]*)"/>(?:<use [^>]*? style="\1"/>)+')
_FONT = re.compile(r"'DejaVu Sans'[^;\"]*")
_HEX = re.compile("|".join(VARIABLES))


def to_svg(drawing: Any, key: str, decimals: int = 2) -> str:
    """Return the figure as one `<svg>` element; `key` makes its identifiers unique in the page."""
    buffer = io.StringIO()
    drawing.savefig(buffer, format="svg", bbox_inches=None,
                    metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = buffer.getvalue()
    text = text[text.index("<svg"):]
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text, flags=re.S)
    text = re.sub(r"<!--.*?-->\s*", "", text, flags=re.S)
    text = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>\s*", "", text, flags=re.S)  # would leak into the page
    text = _TOLD.sub(r' data-\1="\2"', text)
    text = _TAG.sub(lambda tag: _NUMBER.sub(lambda number: _rounded(number.group(), decimals), tag.group()), text)
    return _themed(_fitted(_own_identifiers(_without_waste(text), key))).strip()


def _without_waste(text: str) -> str:
    """Drop what draws nothing: turns by zero, blanks in paths and between tags; say the style of many markers once."""
    text = _TURNED_BY_NOTHING.sub("", text)
    text = _PATH.sub(lambda path: " " + _COMMAND.sub(r"\1", path.group().strip()), text)
    text = _SAME_CLIP.sub(_clipped_once, re.sub(r">\s+<", "><", text))
    return _SAME_STYLE.sub(_styled_once, text)


def _clipped_once(run: re.Match[str]) -> str:
    group = f'<g clip-path="{run.group(1)}">'
    return group + run.group().replace(group, "").replace("</g>", "") + "</g>"


def _styled_once(run: re.Match[str]) -> str:
    style = f' style="{run.group(1)}"'
    return f"<g{style}>{run.group().replace(style, '')}</g>"


def _rounded(number: str, decimals: int) -> str:
    return f"{float(number):.{decimals}f}".rstrip("0").rstrip(".")


def _fitted(text: str) -> str:
    """Drop the fixed size: the page decides, the viewBox keeps the proportions."""
    head, rest = text.split(">", 1)
    width = re.search(r'\swidth="([\d.]+)pt"', head)
    natural = round(float(width.group(1)) * 4 / 3) if width else 400
    head = re.sub(r'\s(width|height|version|xmlns:xlink)="[^"]*"', "", head)
    head += f' xmlns:xlink="http://www.w3.org/1999/xlink" style="max-width: {natural * LARGEST_ENLARGEMENT:.0f}px"'
    return f"{head}>{rest}"


def _own_identifiers(text: str, key: str) -> str:
    """Keep only the identifiers that something refers to: the figure's key and a number."""
    referred = dict.fromkeys(re.findall(r'(?:url\(#|href="#)([^)"]+)', text))
    names = {old: f"{key}-{number}" for number, old in enumerate(referred)}

    def renamed(match: re.Match[str]) -> str:
        return f' id="{names[match.group(1)]}"' if match.group(1) in names else ""

    text = _IDENTIFIER.sub(renamed, text)
    return re.sub(r'(url\(#|href="#)([^)"]+)', lambda match: match.group(1) + names[match.group(2)], text)


def _themed(text: str) -> str:
    """Let the page choose colours and font."""
    text = _FONT.sub("var(--sans, sans-serif)", text)
    return _HEX.sub(lambda match: f"var(--{VARIABLES[match.group()]}, {match.group()})", text)

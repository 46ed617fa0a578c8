"""Convert a matplotlib figure to an SVG string that is reproducible byte for byte and can be embedded in a page.

The SVG has no date and no metadata. Its identifiers are salted and unique in the page, coordinates are rounded to
0.01 pt (or finer), colours are variables of the page (with the colour itself as fallback), and text stays text.

The page's script can read values from curves: the SVG states the frame of its axes and the name of each curve. The
script reads the values from the paths, which contain every point that is farther than TOLERANCE from a straight line
between its neighbours. Without the script, the SVG is an ordinary drawing.
"""

from __future__ import annotations

import io
import re
from typing import Any

from reports.figures.style import VARIABLES

LARGEST_ENLARGEMENT = 1.35  # wider drawings would have too large letters
TOLERANCE = 0.01  # points, 1/30000 of the width of a panel: peaks and corners stay, straight runs go
TIME, PATH = "time", "path"  # the cursor reads curves over time
_NUMBER = re.compile(r"-?\d+\.\d{3,}")
_TAG = re.compile(r"<[^>]+>")  # coordinates are inside of tags; the numbers between them are for people
_IDENTIFIER = re.compile(r'\sid="([^"]+)"')
_TOLD = re.compile(r'\sid="(curve|name)=([^"]*)"')  # what a gid tells the page's script, see `traced_svg`
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
    """Remove rotations by zero and blanks in paths and between tags; state a style shared by many markers once."""
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
    """Remove the fixed size: the page sets the size, and the viewBox keeps the proportions."""
    head, rest = text.split(">", 1)
    width = re.search(r'\swidth="([\d.]+)pt"', head)
    natural = round(float(width.group(1)) * 4 / 3) if width else 400
    head = re.sub(r'\s(width|height|version|xmlns:xlink)="[^"]*"', "", head)
    head += f' xmlns:xlink="http://www.w3.org/1999/xlink" style="max-width: {natural * LARGEST_ENLARGEMENT:.0f}px"'
    return f"{head}>{rest}"


def _own_identifiers(text: str, key: str) -> str:
    """Keep only identifiers that are referred to, and rename each to the figure's key and a number."""
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


def traced_svg(drawing: Any, key: str, kind: str = TIME) -> str:
    """Return the SVG of a drawing with one pair of axes, with the data that the script needs to read values from it."""
    import matplotlib

    (axes,) = drawing.axes
    with matplotlib.rc_context({"path.simplify_threshold": TOLERANCE}):
        for line in axes.lines:
            line.get_path().simplify_threshold = TOLERANCE
        svg = to_svg(drawing, key)
    return svg.replace("<svg ", f"<svg {_attributes(drawing, axes, kind)} ", 1)


def _attributes(drawing: Any, axes: Any, kind: str) -> str:
    """Return SVG attributes: the frame of the axes in points (left, top, right, bottom), their limits and names."""
    width, height = 72.0 * drawing.get_size_inches()
    place = axes.get_position()
    frame = (width * place.x0, height * (1.0 - place.y1), width * place.x1, height * (1.0 - place.y0))
    given = {
        "trace": kind, "frame": _spaced(frame), "x": _spaced(axes.get_xlim()), "y": _spaced(axes.get_ylim()),
        "names": f"{axes.get_xlabel()}|{axes.get_ylabel()}",
    }  # fmt: skip
    return " ".join(f'data-{name}="{value}"' for name, value in given.items())


def _spaced(values: Any) -> str:
    return " ".join(f"{value:.7g}" for value in values)

"""One drawing: axes in the report's style, and the SVG, the same bytes each time."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from types import TracebackType
from typing import Any

from reports.figures.numbers import power_of_ten
from reports.figures.style import (
    PANEL,
    VARIABLES,
    LineStyle,
    css,
    line_arguments,
)

_STYLE = Path(__file__).with_name("report.mplstyle")
LARGEST_ENLARGEMENT = 1.35  # wider drawings would have too large letters


class Plot:
    """Axes with the report's style, and their SVG after the `with` block has ended.

    Parameters
    ----------
    key : key of the panel, unique in the page; the identifiers of its SVG contain it
    size : width and height [inches]
    shape : rows and columns of axes, placed by the layout

    Attributes
    ----------
    axes, each, drawing : matplotlib's (first) axes, all of them, and the figure
    svg : the SVG of the panel
    """

    def __init__(
        self,
        key: str,
        size: tuple[float, float] = PANEL,
        *,
        shape: tuple[int, int] = (1, 1),
    ) -> None:
        self.key = key
        self.size = size
        self.shape = shape
        self.svg = ""
        self.drawing: Any
        self.axes: Any

    def __enter__(self) -> Plot:
        import matplotlib
        from matplotlib.figure import Figure

        self._style = matplotlib.rc_context(fname=_STYLE)
        self._style.__enter__()
        self.drawing = Figure(figsize=self.size, dpi=72, layout="constrained")
        self.each = list(self.drawing.subplots(*self.shape, squeeze=False).ravel())
        self.axes = self.each[0]
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if error is None:
            self.svg = to_svg(self.drawing, self.key)
        self._style.__exit__(kind, error, trace)

    def curve(
        self, points: Iterable[tuple[Any, Any]], look: LineStyle, *, marked: bool = True, **how: Any
    ) -> None:
        """Draw a curve through points (x, y); draw nothing if there are none."""
        points = list(points)
        if points:
            self.axes.plot(*zip(*points, strict=True), **line_arguments(look, marked=marked) | how)

    def marks(self, points: Iterable[tuple[Any, Any]], look: LineStyle, **how: Any) -> None:
        """Draw the marks of a style without a line."""
        self.curve(points, look, **{"linestyle": "none", **how})

    def log(self, x: str, y: str, scales: str = "xy", **limits: Any) -> None:
        """Name the axes and make those in `scales` logarithmic, with powers of ten as plain
        text."""
        from matplotlib.ticker import LogLocator, NullLocator

        self.axes.set(**{f"{axis}scale": "log" for axis in scales}, xlabel=x, ylabel=y, **limits)
        for axis in (
            axis for axis in (self.axes.xaxis, self.axes.yaxis) if axis.get_scale() == "log"
        ):
            axis.set_major_locator(LogLocator(numticks=7))
            axis.set_major_formatter(lambda value, _: power_of_ten(value))
            axis.set_minor_locator(NullLocator())


def note(
    axes: Any, point: Any, text: str, offset: tuple[float, float] = (0.0, 0.0), **how: Any
) -> None:
    """Write text at a point, moved by `offset` [points]."""
    how = {"fontsize": 9, "ha": "center", "va": "center", "zorder": 7, **how}
    axes.annotate(text, tuple(point), xytext=offset, textcoords="offset points", **how)


# SVG: without date and metadata; coordinates rounded to 0.01 pt, colours as variables of the page,
# text as text

_NUMBER = re.compile(r"-?\d+\.\d{3,}")
_COMMAND = re.compile(r"\s*([MLCQz])\s*")
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
    # coordinates are inside of tags; the numbers between them are for people
    (
        r"<[^>]+>",
        lambda tag: _NUMBER.sub(
            lambda number: f"{float(number[0]):.2f}".rstrip("0").rstrip("."), tag[0]
        ),
    ),
    (r">\s+<", "><"),
    (r"'DejaVu Sans'[^;\"]*", "var(--sans, sans-serif)"),
    ("|".join(VARIABLES), lambda color: css(color[0])),
)


def to_svg(drawing: Any, key: str) -> str:
    """Return the figure as one `<svg>` element; `key` makes its identifiers unique in the page.

    The page sets the size, up to LARGEST_ENLARGEMENT; the viewBox keeps the proportions.
    """
    buffer = io.StringIO()
    drawing.savefig(
        buffer,
        format="svg",
        bbox_inches=None,
        metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")),
    )
    head, text = buffer.getvalue().split("<svg", 1)[1].split(">", 1)
    head = re.sub(r'\s(?:width|height|version|xmlns:xlink)="[^"]*"', "", head)
    widest = LARGEST_ENLARGEMENT * round(96 * drawing.get_size_inches()[0])
    text = (
        f'<svg{head} xmlns:xlink="http://www.w3.org/1999/xlink" style="max-width: {widest:.0f}px">'
        f"{text}"
    )
    for pattern, new in _CLEANED:
        text = re.sub(pattern, new, text)
    referred = dict.fromkeys(re.findall(r'(?:url\(#|href="#)([^)"]+)', text))
    names = {old: f"{key}-{number}" for number, old in enumerate(referred)}
    text = re.sub(
        r'\sid="([^"]+)"', lambda id: f' id="{names[id[1]]}"' if id[1] in names else "", text
    )
    return re.sub(r'(url\(#|href="#)([^)"]+)', lambda link: link[1] + names[link[2]], text).strip()

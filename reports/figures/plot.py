"""One panel with axes. All curves, scatter plots and maps of the report are drawn with it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from types import TracebackType
from typing import Any

from reports.figures.labels import name_curves
from reports.figures.numbers import power_of_ten
from reports.figures.style import PANEL, LineStyle, line_arguments, styled
from reports.figures.svg import to_svg

TIME, PATH = "time", "path"  # the cursor reads curves over time
TOLERANCE = 0.01  # points, 1/30000 of the width of a panel: peaks and corners stay, straight runs go


class Plot:
    """Axes with the report's style, and their SVG after the `with` block has ended.

    Parameters
    ----------
    key : key of the panel, unique in the page; the identifiers of its SVG contain it
    size : width and height [inches]
    kind : TIME or PATH if the page's script reads values from the curves
    frame : position of the axes in the drawing (left, bottom, width, height); by default the layout decides
    bare : whether to hide the axes: a canvas for shapes, by default as large as the drawing

    Attributes
    ----------
    axes, drawing : matplotlib's axes and figure
    words : text after the name of each curve
    svg : the SVG of the panel
    """

    def __init__(self, key: str, size: tuple[float, float] = PANEL, *, kind: str = "", bare: bool = False,
                 frame: tuple[float, float, float, float] | None = None) -> None:  # fmt: skip
        self.key, self.size, self.kind, self.bare = key, size, kind, bare
        self.frame = (0.0, 0.0, 1.0, 1.0) if bare and frame is None else frame
        self.svg = ""
        self.words: dict[str, str] = {}
        self.drawing: Any
        self.axes: Any

    def __enter__(self) -> Plot:
        self._style = styled()
        new_figure = self._style.__enter__()
        if self.frame is None:
            self.drawing = new_figure(figsize=self.size, layout="constrained")
            self.axes = self.drawing.add_subplot()
        else:
            self.drawing = new_figure(figsize=self.size)
            self.axes = self.drawing.add_axes(self.frame)
        if self.bare:
            self.axes.set_axis_off()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:  # fmt: skip
        if error is None:
            name_curves(self.axes, self.words)
            self.svg = self._traced() if self.kind else to_svg(self.drawing, self.key)
        self._style.__exit__(kind, error, trace)

    def _traced(self) -> str:
        """Return the SVG with what the page's script reads values with: the frame in points, limits and names."""
        import matplotlib

        matplotlib.rcParams["path.simplify_threshold"] = TOLERANCE
        for line in self.axes.lines:
            line.get_path().simplify_threshold = TOLERANCE
        svg = to_svg(self.drawing, self.key)
        place, (width, height) = self.axes.get_position(), 72.0 * self.drawing.get_size_inches()
        frame = (width * place.x0, height * (1.0 - place.y1), width * place.x1, height * (1.0 - place.y0))
        ranges = {"frame": frame, "x": self.axes.get_xlim(), "y": self.axes.get_ylim()}
        told = {"trace": self.kind, "names": f"{self.axes.get_xlabel()}|{self.axes.get_ylabel()}",
                **{key: " ".join(f"{value:.7g}" for value in values) for key, values in ranges.items()}}
        attributes = " ".join(f'data-{key}="{value}"' for key, value in told.items())
        return svg.replace("<svg ", f"<svg {attributes} ", 1)

    def curve(self, points: Iterable[tuple[Any, Any]], look: LineStyle, *, marked: bool = True, **how: Any) -> None:
        """Draw a curve through points (x, y); draw nothing if there are none."""
        points = list(points)
        if points:
            self.axes.plot(*zip(*points, strict=True), **line_arguments(look, marked=marked) | how)

    def marks(self, points: Iterable[tuple[Any, Any]], look: LineStyle, **how: Any) -> None:
        """Draw the marks of a style without a line."""
        self.curve(points, look, **{"linestyle": "none", **how})

    def lost(self, places: Sequence[float], look: LineStyle, height: float) -> None:
        """Draw crosses at the upper rim at the x values `places` of failed cases."""
        self.axes.plot(places, [height] * len(places), "x", color=look.color, markersize=5,
                       transform=self.axes.get_xaxis_transform())  # fmt: skip

    def log(self, x: str, y: str, scales: str = "xy", **limits: Any) -> None:
        """Name the axes and make those in `scales` logarithmic, with powers of ten as plain text."""
        from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

        self.axes.set(**{f"{axis}scale": "log" for axis in scales}, xlabel=x, ylabel=y, **limits)
        for axis in (axis for axis in (self.axes.xaxis, self.axes.yaxis) if axis.get_scale() == "log"):
            axis.set_major_locator(LogLocator(numticks=7))
            axis.set_major_formatter(FuncFormatter(lambda value, _: power_of_ten(value)))
            axis.set_minor_locator(NullLocator())

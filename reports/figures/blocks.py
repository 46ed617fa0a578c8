"""Block diagrams: boxes with text, arrows with labels, on a plain canvas in arbitrary units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from reports.figures.style import INK, MUTED, PEG


def block(axes: Any, center: tuple[float, float], text: str, size: tuple[float, float] = (2.4, 1.1), *,
          filled: bool = True, dashed: bool = False) -> None:
    """Draw a box with text in it."""
    from matplotlib.patches import FancyBboxPatch

    x, y = center[0] - size[0] / 2, center[1] - size[1] / 2
    axes.add_patch(FancyBboxPatch((x, y), *size, boxstyle="round,pad=0,rounding_size=0.12", linewidth=1.1,
                                  facecolor=PEG if filled else "none", edgecolor=MUTED if dashed else INK,
                                  linestyle=(0, (4, 2)) if dashed else "-", zorder=3))
    axes.text(*center, text, ha="center", va="center", fontsize=9, zorder=4, linespacing=1.35)


def summing_point(axes: Any, center: tuple[float, float]) -> None:
    """Draw the circle in which signals are added."""
    from matplotlib.patches import Circle

    axes.add_patch(Circle(center, 0.2, facecolor="none", edgecolor=INK, linewidth=1.1, zorder=3))
    axes.text(*center, "+", ha="center", va="center", fontsize=9, zorder=4)


def wire(axes: Any, corners: Sequence[tuple[float, float]], text: str = "", at: tuple[float, float] | None = None, *,
         color: str = INK, width: float = 1.2, dash: tuple[float, ...] = (), align: str = "center") -> None:
    """Draw a signal along `corners`, an arrow head at its end, and its name at `at`."""
    xs, ys = zip(*corners, strict=True)
    style: Any = (0, dash) if dash else "-"
    axes.plot(xs[:-1] + (xs[-1],), ys, color=color, linewidth=width, linestyle=style, solid_capstyle="butt", zorder=2)
    axes.annotate("", xy=corners[-1], xytext=corners[-2], zorder=2,
                  arrowprops={"arrowstyle": "-|>", "color": color, "linewidth": 0, "mutation_scale": 10,
                              "shrinkA": 0, "shrinkB": 0, "fill": True})
    if text and at is not None:
        axes.text(*at, text, ha=align, va="center", fontsize=8.5, color=color, zorder=4)


def make_board(drawing: Any, width: float, height: float) -> Any:
    """Return axes of the given size in units, without frame; the figure has the same proportions."""
    axes = drawing.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0, width), ylim=(0, height))
    axes.set_axis_off()
    return axes

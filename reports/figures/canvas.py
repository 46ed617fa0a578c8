"""A picture of a planar scene: equal scales, no axes, walls hatched, bodies filled. Lengths in metres."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reports.figures.geometry import body_outlines, half_plane, outline
from reports.figures.style import FORCE, INK, MUTED, PEG, WALL

Floats = NDArray[np.float64]
TURNED = ("peg_",)  # scenes in the paper's frame, x to the left and y down: drawn turned by 180 degrees


def make_canvas(drawing: Any, low: Floats, high: Floats, *, turned: bool) -> Any:
    """Return axes without a frame that show at least the rectangle from `low` to `high`, at equal scales."""
    axes = drawing.add_axes((0.0, 0.0, 1.0, 1.0))
    low, high = widened(low, high, drawing.get_figwidth() / drawing.get_figheight())
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    axes.set_axis_off()
    if turned:
        axes.xaxis.set_inverted(True)
        axes.yaxis.set_inverted(True)
    return axes


def widened(low: Floats, high: Floats, proportion: float) -> tuple[Floats, Floats]:
    """Return the smallest rectangle with width / height = `proportion` around the given one, same centre."""
    width, height = np.asarray(high) - np.asarray(low)
    size = np.array([max(width, height * proportion), max(height, width / proportion)])
    center = (np.asarray(low) + np.asarray(high)) / 2
    return center - size / 2, center + size / 2


def is_turned(scene: Mapping[str, Any]) -> bool:
    """Tell whether a scene is in the paper's frame of the peg."""
    return str(scene["name"]).startswith(TURNED)


def draw_walls(axes: Any, scene: Mapping[str, Any], reach: float) -> None:
    """Fill the static world."""
    for wall in scene["walls"]:
        corners = half_plane(wall, reach) if wall["kind"] == "half_plane" else outline(wall)
        axes.fill(*corners.T, facecolor=WALL, edgecolor="none", zorder=1)


def draw_bodies(axes: Any, scene: Mapping[str, Any], coordinates: Sequence[float] | Floats | None = None, *,
                color: str = PEG, edge: str = INK, width: float = 1.1) -> None:
    """Fill the moving bodies at `coordinates`, or where the scene starts."""
    for _, corners in body_outlines(scene, coordinates):
        axes.fill(*corners.T, facecolor=color, edgecolor=edge, linewidth=width, zorder=2)


def arrow(axes: Any, tail: Any, vector: Any, *, color: str = FORCE, width: float = 1.6, head: float = 9.0) -> None:
    """Draw an arrow from `tail` along `vector` [m]."""
    tip = np.asarray(tail, dtype=float) + np.asarray(vector, dtype=float)
    axes.annotate("", xy=tuple(tip), xytext=tuple(tail), zorder=6,
                  arrowprops={"arrowstyle": "-|>", "color": color, "linewidth": width, "mutation_scale": head,
                              "shrinkA": 0, "shrinkB": 0})


def note(axes: Any, point: Any, text: str, offset: tuple[float, float] = (0.0, 0.0), **how: Any) -> None:
    """Write text at a point, moved by `offset` [points]."""
    how = {"fontsize": 9, "ha": "center", "va": "center", "zorder": 7, **how}
    axes.annotate(text, tuple(point), xytext=offset, textcoords="offset points", **how)


def scale_bar(axes: Any, start: Any, length: float, text: str, *, turned: bool) -> None:
    """Draw a bar of known length, its text above it."""
    end = np.asarray(start) + np.array([-length if turned else length, 0.0])
    axes.plot([start[0], end[0]], [start[1], end[1]], color=MUTED, linewidth=1.4, solid_capstyle="butt", zorder=7)
    note(axes, (np.asarray(start) + end) / 2, text, (0, 6), color=MUTED, fontsize=8.5)

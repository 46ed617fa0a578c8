"""Pictures of planar scenes: equal scales, no axes, filled walls and bodies. Lengths are in metres."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reports.figures.geometry import Placement, body_outlines, half_plane, outline
from reports.figures.labels import note_beside
from reports.figures.plot import Plot
from reports.figures.style import FORCE, INK, MUTED, PANEL, PEG, WALL

Floats = NDArray[np.float64]
TURNED = ("peg_",)  # scenes in the paper's frame, x to the left and y down: drawn turned by 180 degrees


class Canvas(Plot):
    """A panel without axes that shows at least the rectangle from `low` to `high`, at equal scales.

    Without a `size` the panel has the standard width and the proportions of the rectangle.
    """

    def __init__(self, key: str, low: Floats, high: Floats, size: tuple[float, float] | None = None, *,
                 turned: bool = False) -> None:  # fmt: skip
        width, height = np.asarray(high) - np.asarray(low)
        super().__init__(key, size or (PANEL[0], PANEL[0] * height / width), bare=True)
        self.low, self.high = widened(low, high, self.size[0] / self.size[1])
        self.turned = turned

    def __enter__(self) -> Canvas:
        super().__enter__()
        self.axes.set(xlim=(self.low[0], self.high[0]), ylim=(self.low[1], self.high[1]))
        if self.turned:
            invert(self.axes)
        return self


def invert(axes: Any) -> None:
    """Turn the picture by 180 degrees: x to the left, y down."""
    axes.xaxis.set_inverted(True)
    axes.yaxis.set_inverted(True)


def hand(axes: Any, scene: Mapping[str, Any], place: Placement, length: float,
         flat: Callable[[Any], Any] = lambda point: np.asarray(point, dtype=float)[:2]) -> None:  # fmt: skip
    """Draw the hand's force as an arrow of the given length [m] from the held point of its body, which is at `place`.

    Call it last, because the label is placed where nothing is drawn yet.
    """
    force = flat(scene["hand"]["force"][:3])
    if np.hypot(*force) > 0.0:
        start = flat(place.of(scene["hand"]["point"]))
        along = length * force / np.hypot(*force)
        arrow(axes, start, along)
        note_beside(axes, start, start + along, "hand", 9, color=FORCE)


def widened(low: Floats, high: Floats, proportion: float) -> tuple[Floats, Floats]:
    """Return the smallest rectangle with width / height = `proportion` around the given one, same centre."""
    width, height = np.asarray(high) - np.asarray(low)
    size = np.array([max(width, height * proportion), max(height, width / proportion)])
    center = (np.asarray(low) + np.asarray(high)) / 2
    return center - size / 2, center + size / 2


def is_turned(scene: Mapping[str, Any]) -> bool:
    """Return whether a scene uses the paper's peg frame, whose pictures are turned by 180 degrees."""
    return str(scene["name"]).startswith(TURNED)


def draw_walls(axes: Any, scene: Mapping[str, Any], reach: float) -> None:
    """Fill the static world."""
    for wall in scene["walls"]:
        corners = half_plane(wall, reach) if wall["kind"] == "half_plane" else outline(wall)
        axes.fill(*corners.T, facecolor=WALL, edgecolor="none", zorder=1)


def draw_bodies(axes: Any, scene: Mapping[str, Any], pose: Floats | None = None, *,
                color: str = PEG, edge: str = INK, width: float = 1.1) -> None:
    """Fill the moving bodies at a `pose` of a run, by default at the start of the scene."""
    for _, corners in body_outlines(scene, pose):
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
    """Draw a scale bar of the given length with its text above it."""
    end = np.asarray(start) + np.array([-length if turned else length, 0.0])
    axes.plot([start[0], end[0]], [start[1], end[1]], color=MUTED, linewidth=1.4, solid_capstyle="butt", zorder=7)
    note(axes, (np.asarray(start) + end) / 2, text, (0, 6), color=MUTED, fontsize=8.5)

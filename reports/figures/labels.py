"""Place names at marks, curves and arrows where they cover the least ink, and no other name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reports.figures.style import INK, MUTED

SIZE, NAME_SIZE = 7.0, 8.0  # points: names of marks, of curves
_NEAR = 8.0  # points: a name so close to its place needs no line to it
_CLOSE = (1.5, 3.0, 6.0)  # points: the closer another curve, the less likely a name is put there
_PALEST = 0.3  # darkness of fills, on which a name can be read
_PLACES = 40  # number of places along a curve that are tried
_ARROW, _ASIDE = 9, 8.0  # half the length of the arrow of time, in places, and its distance from the curve [points]
# directions and distances [points] of a name from its place
_WAYS = np.array([(0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, 1), (1, -1), (-1, -1)])
_AWAY = np.array([3.0, 6.0, 10.0, 20.0, 32.0, 48.0, 70.0])
_ALONG = np.linspace(0.1, 0.9, 40)  # places of the line from a name to its mark

Points = NDArray[np.float64]


def label_marks(axes: Any, names: Sequence[str], places: Any, colors: Sequence[str]) -> None:
    """Write each name beside its mark; call it last, after the limits of the axes are set."""
    sheet = _Sheet(axes)
    for name, place, color in zip(names, sheet.points(places), colors, strict=True):
        sheet.write(name, place[None], SIZE, color)


def name_curves(axes: Any, words: Mapping[str, str] = MappingProxyType({})) -> None:
    """Write the name of each curve beside it, in its colour; skip curves already named, and a single curve.

    The name of a curve comes from its `gid`, "curve=name", which `line_arguments` sets. The entry of a curve in `words`
    is written after its name.
    """
    lines = {str(line.get_gid())[6:]: line for line in axes.lines if str(line.get_gid()).startswith("curve=")}
    named = [text.get_text() for text in axes.texts]
    if len(lines) < 2:
        return
    sheet = _Sheet(axes)
    for name, line in sorted(lines.items(), key=lambda found: -len(found[0] + words.get(found[0], ""))):
        path = sheet.along(line)
        if len(path) and not any(text.startswith(name) for text in named):
            own = path[:: max(len(path) // _PLACES, 1)]
            sheet.write(name + words.get(name, ""), own, NAME_SIZE, line.get_color(), line, gid=f"name={name}")


def arrow_of_time(axes: Any) -> None:
    """Draw an arrow in the direction of time, beside the first half of the first curve."""
    sheet = _Sheet(axes)
    path = sheet.along(axes.lines[0])
    middle = len(path) // 4
    way = path[min(middle + _ARROW, len(path) - 1)] - path[max(middle - _ARROW, 0)]
    aside = _ASIDE * np.array([way[1], -way[0]]) / np.hypot(*way)
    tail, tip = (sheet.data(path[middle] + aside + share * way) for share in (-0.5, 0.5))
    look = {"arrowstyle": "-|>", "color": MUTED, "lw": 1.1, "mutation_scale": 9.0, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", tip, tail, zorder=8, arrowprops=look).arrow_patch.set_gid("name=")
    axes.annotate("time", 0.5 * (tail + tip), tuple(1.2 * aside), textcoords="offset points", fontsize=NAME_SIZE,
                  color=MUTED, ha="left" if aside[0] > 0 else "right", va="center", gid="name=")


def note_beside(axes: Any, tail: Any, tip: Any, text: str, size: float, color: str = INK) -> None:
    """Write the name of an arrow from `tail` to `tip` beside it; call it last, after the limits are set."""
    sheet = _Sheet(axes)
    sheet.write(text, sheet.points(np.linspace(tail, tip, 20)), size, color, leader=False)


class _Sheet:
    """What some axes show, as ink at each point of a drawing of 72 points per inch, from its lower left corner."""

    def __init__(self, axes: Any) -> None:
        from matplotlib.text import Text

        self.axes = axes
        axes.figure.draw_without_rendering()  # positions are known after the layout
        self.frame = axes.get_window_extent().extents.reshape(2, 2)
        self.ink = self._inked([*axes.patches, *axes.collections, *axes.lines, *axes.texts])
        self.names = np.zeros_like(self.ink)
        for text in axes.texts:
            if text.get_text():
                self._take(*np.reshape(Text.get_window_extent(text).extents, (2, 2)))

    def _inked(self, artists: Sequence[Any]) -> Points:
        """Return how dark the artists are, from 0 to 1, at each point of the drawing; pale areas are no ink."""
        from matplotlib.backends.backend_agg import RendererAgg

        renderer = RendererAgg(*self.axes.figure.bbox.size, 72.0)  # type: ignore[call-arg]
        for artist in artists:
            if getattr(artist, "is_dashed", bool)():  # a name in the gaps between dashes is struck through
                artist = copy(artist)
                artist.set_linestyle("-")
            artist.draw(renderer)
        pixels = np.asarray(renderer.buffer_rgba())[::-1] / 255.0
        dark: Points = (1.0 - pixels[..., :3].min(axis=2)) * pixels[..., 3]
        return np.where(dark > _PALEST, dark, 0.0)

    def _take(self, low: Points, high: Points) -> None:
        """Keep other names out of a box."""
        (left, bottom), (right, top) = np.maximum(low, 0.0).astype(int), np.ceil(high).astype(int)
        self.names[bottom:top, left:right] = 1.0

    def points(self, places: Any) -> Points:
        """Return data coordinates as points of the drawing."""
        return np.asarray(self.axes.transData.transform(np.asarray(places, dtype=float)))

    def data(self, point: Points) -> Points:
        """Return the data coordinates of a point of the drawing."""
        return np.asarray(self.axes.transData.inverted().transform(point))

    def along(self, line: Any) -> Points:
        """Return points about 2 apart along a curve, or its marks if they are not joined, that are in the frame."""
        from matplotlib.cbook import STEP_LOOKUP_MAP

        values = STEP_LOOKUP_MAP[line.get_drawstyle()](*np.asarray(line.get_xydata(), dtype=float).T)
        path = line.get_transform().transform(np.column_stack(values))
        path = path[np.isfinite(path).all(axis=1)]
        if line.get_linestyle() != "None" and len(path) > 1:
            way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
            at = np.linspace(0.0, way[-1], min(int(way[-1] / 2.0) + 2, 3000))
            path = np.column_stack([np.interp(at, way, part) for part in path.T])
        inside: Points = path[((path >= self.frame[0] - 0.5) & (path <= self.frame[1] + 0.5)).all(axis=1)]
        return inside

    def write(self, name: str, starts: Points, size: float, color: str, line: Any = None, *, leader: bool = True,
              gid: str | None = None) -> None:  # fmt: skip
        """Write a name beside one of the `starts`, where it covers least and is close to no curve but its `line`.

        A name that is far from its start has a line to it.
        """
        from matplotlib.textpath import TextPath

        extent = np.array([TextPath((0.0, 0.0), name, size=size).get_extents().width + 2.0, size + 2.0])
        offsets = (_WAYS[:, None] * (_AWAY[:, None] + 0.5 * extent)).reshape(-1, 2)
        away = np.tile(_AWAY, len(_WAYS))
        centers = starts[:, None] + offsets
        low, high = centers - 0.5 * extent, centers + 0.5 * extent
        others = self._inked([each for each in self.axes.lines if each is not line]) if line else self.names
        outside = ((low < self.frame[0]) | (high > self.frame[1])).any(axis=2)
        leaders = (starts[:, None, None] + _ALONG[:, None] * offsets[:, None]).astype(int)
        x, y = np.moveaxis(np.clip(leaders, 0, np.array(self.names.shape[::-1]) - 1), -1, 0)
        costs = (4.0 * _sums(self.ink, low, high) + 400.0 * (_sums(self.names, low, high) > 0.0) + 1e6 * outside
                 + 40.0 * ((away > _NEAR) & (self.names[y, x] > 0.0).any(axis=2)) + away / 4.0
                 + sum(15.0 * (_sums(others, starts - near, starts + near) > 1.0)[:, None] for near in _CLOSE))
        start, way = np.unravel_index(np.argmin(costs), costs.shape)
        far = leader and away[way] > _NEAR
        look = {"arrowstyle": "-", "color": color, "lw": 0.5, "shrinkA": 0, "shrinkB": 2.0, "relpos": (0.5, 0.5)}
        note = self.axes.annotate(name, self.data(starts[start]), offsets[way], textcoords="offset points", ha="center",
                                  va="center", fontsize=size, color=color, zorder=9, gid=gid, annotation_clip=False,
                                  arrowprops=look if far else None)
        if far:
            note.arrow_patch.set_gid(gid)
            self.names[y[start, way], x[start, way]] = 1.0
        self._take(low[start, way], high[start, way])


def _sums(ink: Points, low: Points, high: Points) -> Points:
    """Return the ink inside each box from `low` to `high` (..., 2)."""
    total = np.pad(ink.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    (left, bottom), (right, top) = (
        np.moveaxis(np.clip(ends.round().astype(int), 0, np.array(ink.shape[::-1])), -1, 0) for ends in (low, high))
    found: Points = total[top, right] - total[bottom, right] - total[top, left] + total[bottom, left]
    return found

"""Place names at marks, curves and arrows so that they cover no other name or mark, and a line only if unavoidable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reports.figures.style import INK, MUTED

SIZE, NAME_SIZE = 7.0, 8.0  # points: names of marks, of curves
_NEAR = 6.0  # points: a name so close to a curve is read as that of this curve, and needs no leader to it
_MARK = 3.0  # points around a mark that stay free
_COLUMN, _LINE = 3, 1.3 * SIZE  # least number of marks above each other whose names form a list; its line height
_PLACES = 40  # number of places along a curve that are tried
_ARROW, _ASIDE = 9, 8.0  # half the length of the arrow of time, in steps, and its distance from the curve [points]
_STEP = 2.0  # points between the places of a line that a name must not cover
# directions and distances [points] of a name from its place
_AWAY = np.repeat([3.0, 10.0, 20.0, 32.0, 48.0, 70.0], 8)
_WAYS = np.tile([(0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, 1), (1, -1), (-1, -1)], (6, 1))

Box = tuple[float, float, float, float]  # left, bottom, right, top
Points = NDArray[np.float64]


def label_marks(axes: Any, names: Sequence[str], places: Sequence[tuple[float, float]],
                colors: Sequence[str] = ()) -> list[Box]:  # fmt: skip
    """Write each name beside its mark, where it covers no mark, no other name and no line; return the boxes [points].

    A name further away has a line to its mark. Marks above each other have their names in the same order to the left.
    Call it last, after the limits of the axes are set.
    """
    sheet = _Sheet(axes)
    drawn = [place for line in axes.lines if line.get_marker() not in ("None", "") for place in line.get_xydata()]
    marks = sheet.points(places)
    sheet.taken += [(x - _MARK, y - _MARK, x + _MARK, y + _MARK) for x, y in [*marks, *sheet.points([*places, *drawn])]]
    columns = _columns(names, marks, sheet.frame)
    sheet.taken += columns.values()
    boxes = []
    for number, (name, mark) in enumerate(zip(names, marks, strict=True)):
        box = columns.get(number) or sheet.least(mark[None], name, SIZE, gap=_MARK)[0]
        sheet.write(name, mark, box, SIZE, colors[number] if colors else INK, listed=number in columns)
        boxes.append(box)
    return boxes


def _columns(names: Sequence[str], marks: Points, frame: Box) -> dict[int, Box]:
    """Return boxes to the left of marks that are above each other and too close for names beside them."""
    found: dict[int, Box] = {}
    for column in set(marks[:, 0].round()):
        rising = sorted(np.flatnonzero(marks[:, 0].round() == column).tolist(), key=lambda k: float(marks[k, 1]))
        widths, right = [_width(names[k], SIZE) for k in rising], column - 3.0 * _NEAR
        if len(rising) < _COLUMN or right - max(widths) < frame[0]:
            continue
        steps = _LINE * np.arange(len(rising))
        up = np.maximum.accumulate(marks[rising, 1] - steps)  # apart upwards, and from the top down again
        down = np.minimum.accumulate(np.minimum(up, frame[3] - _LINE - steps[-1])[::-1])[::-1] + steps
        for k, width, height in zip(rising, widths, down, strict=True):
            found[k] = (right - width, height - 0.6 * SIZE, right, height + 0.6 * SIZE)
    return found


def name_curves(axes: Any, words: Mapping[str, str] = MappingProxyType({})) -> None:
    """Write the name of each curve beside it, in its colour, where the name covers least; skip curves already named.

    The name of a curve comes from its `gid`, "curve=name", which `line_arguments` sets. A single curve gets no name.
    The entry of a curve in `words` is written after its name.
    """
    lines = {str(line.get_gid())[6:]: line for line in axes.lines if str(line.get_gid()).startswith("curve=")}
    named = [text.get_text() for text in axes.texts]
    if len(lines) < 2:
        return
    sheet = _Sheet(axes)
    for name, line in lines.items():
        own = sheet.curves[line]
        if any(text.startswith(name) for text in named) or not len(own):
            continue
        others = np.vstack([sheet.rest, *(found for other, found in sheet.curves.items() if other is not line)])
        written = name + words.get(name, "")
        box, at = sheet.least(own[:: max(len(own) // _PLACES, 1)], written, NAME_SIZE, others)
        sheet.write(written, at, box, NAME_SIZE, line.get_color(), f"name={name}")
        sheet.rest = np.vstack([sheet.rest, _leader(at, box)])


def arrow_of_time(axes: Any) -> None:
    """Draw an arrow in the direction of time, beside the first half of the first curve."""
    sheet = _Sheet(axes)
    path = sheet.curves[axes.lines[0]]
    middle = len(path) // 4
    way = path[min(middle + _ARROW, len(path) - 1)] - path[max(middle - _ARROW, 0)]
    aside = _ASIDE * np.array([way[1], -way[0]]) / np.hypot(*way)
    tail, tip = (sheet.data(path[middle] + aside + share * way) for share in (-0.5, 0.5))
    look = {"arrowstyle": "-|>", "color": MUTED, "lw": 1.1, "mutation_scale": 9.0, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", tip, tail, zorder=8, arrowprops=look).arrow_patch.set_gid("name=")
    axes.annotate("time", 0.5 * (tail + tip), tuple(1.2 * aside), textcoords="offset points", fontsize=NAME_SIZE,
                  color=MUTED, ha="left" if aside[0] > 0 else "right", va="center", gid="name=")


def note_beside(axes: Any, tail: Any, tip: Any, text: str, size: float, color: str = INK) -> None:
    """Write the name of an arrow from `tail` to `tip` where it covers the least of arrows, lines and edges of bodies.

    Call it last, after the limits of the axes are set.
    """
    sheet = _Sheet(axes)
    box, at = sheet.least(sheet.along(sheet.points([tail, tip])), text, size)
    sheet.write(text, at, box, size, color, leader=False)


class _Sheet:
    """What some axes show, in points of the drawing: points that each curve covers, those of the `rest`, the names."""

    def __init__(self, axes: Any) -> None:
        axes.figure.draw_without_rendering()  # positions are known after the layout
        self.axes, self.scale = axes, 72.0 / axes.figure.dpi
        self.frame = self._box(axes)
        self.curves = {line: self._places(line) for line in axes.lines}
        paths = [self.points(path) for each in axes.collections for path in getattr(each, "get_segments", list)()]
        paths += [self.scale * patch.get_path().transformed(patch.get_transform()).vertices for patch in axes.patches]
        paths += [self.points([text.xyann, text.xy]) for text in axes.texts
                  if getattr(text, "arrow_patch", None) and text.anncoords == "data"]  # fmt: skip
        self.rest = np.vstack([np.zeros((0, 2)), *map(self.along, paths)])
        self.taken = [self._box(text) for text in axes.texts if text.get_text()]

    def points(self, places: Any) -> Points:
        """Return data coordinates as points of the drawing."""
        return np.asarray(self.scale * self.axes.transData.transform(np.asarray(places, dtype=float)))

    def data(self, point: Points) -> Points:
        """Return the data coordinates of a point of the drawing."""
        return np.asarray(self.axes.transData.inverted().transform(point / self.scale))

    def _box(self, artist: Any) -> Box:
        left, bottom, right, top = (self.scale * side for side in artist.get_window_extent().extents)
        return (left, bottom, right, top)

    def along(self, path: Points) -> Points:
        """Return evenly spaced points along a path that are inside the frame."""
        path = np.asarray(path)[np.isfinite(path).all(axis=1)]
        if len(path) > 1:
            way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
            at = np.linspace(0.0, way[-1], min(int(way[-1] / _STEP) + 2, 3000))
            path = np.column_stack([np.interp(at, way, path[:, 0]), np.interp(at, way, path[:, 1])])
        return self._inside(path)

    def _inside(self, points: Points) -> Points:
        low, high = np.split(np.array(self.frame), 2)
        return np.asarray(points[((points >= low - 0.5) & (points <= high + 0.5)).all(axis=1)])

    def _places(self, line: Any) -> Points:
        """Return the points that a line covers: points along it, or its marks if they are not joined."""
        from matplotlib.cbook import STEP_LOOKUP_MAP

        values = np.column_stack(STEP_LOOKUP_MAP[line.get_drawstyle()](*np.asarray(line.get_xydata(), dtype=float).T))
        paper = self.scale * line.get_transform().transform(values)
        if line.get_linestyle() != "None" and len(paper) > 1:
            return self.along(paper)
        corners = (0.5 * line.get_markersize() + 1.0) * np.array([(0, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)])
        return self._inside((paper[:, None, :] + corners).reshape(-1, 2))

    def least(self, starts: Points, name: str, size: float, others: Points | None = None,
              gap: float = 0.0) -> tuple[Box, Points]:  # fmt: skip
        """Return the box in which a name beside one of the `starts` covers least, and its start.

        others : points of other curves; where a start is near them, the name could belong to either
        """
        low, high = np.split(np.array(self.frame), 2)
        extent = np.array([_width(name, size) + 2.0, size + 2.0])
        centers = starts[:, None] + _WAYS * (_AWAY[:, None] + gap + 0.5 * extent)
        corners = (centers - 0.5 * extent).reshape(-1, 2)
        boxes, taken = np.hstack([corners, corners + extent]), np.array(self.taken).reshape(-1, 4)
        apart = np.full(len(starts), np.inf)
        if others is not None and len(others):
            apart = np.array([np.hypot(*(others - at).T).min() for at in starts])
        # how many points of lines there are to the left of and below each point of the drawing, 1 point apart
        drawn = np.clip(np.vstack([self.rest, *self.curves.values()]) - low, 0.0, high - low).astype(int)
        below = np.zeros(np.ceil(high - low).astype(int) + 2)
        np.add.at(below, tuple(drawn.T + 1), 1.0)
        below = below.cumsum(axis=0).cumsum(axis=1)
        left, bottom, right, top = np.clip((boxes - np.tile(low, 2)).round(), 0, np.tile(high - low, 2)).astype(int).T
        covered = below[right, top] - below[left, top] - below[right, bottom] + below[left, bottom]
        overlaps = ((boxes[:, None, :2] < taken[:, 2:]) & (taken[:, :2] < boxes[:, None, 2:])).all(axis=2).sum(axis=1)
        outside = (boxes < np.tile(low, 2)).any(axis=1) | (boxes > np.tile(high, 2)).any(axis=1)
        costs = (2.0 * covered + np.tile(_AWAY, len(starts)) / 4.0 + 400.0 * overlaps + 1e6 * outside
                 + np.repeat(30.0 * np.maximum(0.0, 1.0 - apart / _NEAR), len(_AWAY)))  # fmt: skip
        best = (np.inf, 0)
        for k in np.argsort(costs, kind="stable"):
            if costs[k] >= best[0]:
                break
            leader = _leader(starts[k // len(_AWAY)], boxes[k])[:, None]
            crosses = ((leader > taken[:, :2]) & (leader < taken[:, 2:])).all(axis=2).any()
            best = min(best, (float(costs[k]) + 40.0 * bool(crosses), int(k)))
        x, y, end, height = boxes[best[1]].tolist()
        return (x, y, end, height), starts[best[1] // len(_AWAY)]

    def write(self, name: str, at: Points, box: Box, size: float, color: str, gid: str | None = None, *,
              leader: bool = True, listed: bool = False) -> None:  # fmt: skip
        """Write a name into a box, with a line to its place if it is far away.

        In a list the line begins at the end of the name, so that no line crosses another.
        """
        offset = (box[2] if listed else 0.5 * (box[0] + box[2])) - at[0], 0.5 * (box[1] + box[3]) - at[1]
        line = {"arrowstyle": "-", "color": color, "lw": 0.5, "shrinkA": 0, "shrinkB": 2.0,
                "relpos": (1.0 if listed else 0.5, 0.5)}  # fmt: skip
        far = leader and len(_leader(at, box)) > 0
        note = self.axes.annotate(name, self.data(at), offset, textcoords="offset points",
                                  ha="right" if listed else "center", va="center", fontsize=size, color=color,
                                  zorder=9, gid=gid, annotation_clip=False, arrowprops=line if far else None)
        if far:
            note.arrow_patch.set_gid(gid)
        self.taken.append(box)


@cache
def _width(text: str, size: float) -> float:
    """Return the width of a text [points]."""
    from matplotlib.textpath import TextPath

    return float(TextPath((0.0, 0.0), text, size=size).get_extents().width)


def _leader(mark: Points, box: Any) -> Points:
    """Return points along the line from a mark to its name, without those at the mark; none if the name is near."""
    if np.hypot(*(np.clip(mark, box[:2], box[2:]) - mark)) <= _NEAR + 2.0:
        return np.zeros((0, 2))
    way = np.array([0.5 * (box[0] + box[2]), 0.5 * (box[1] + box[3])]) - mark
    length = float(np.hypot(*way))
    points = np.asarray(mark + np.arange(_NEAR, length, 0.5 * _STEP)[:, None] / length * way)
    return points[((points < box[:2]) | (points > box[2:])).any(axis=1)]

"""Place labels at marks and curves so that they cover no other label and no mark, and a curve only if unavoidable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reports.figures.style import INK, MUTED

SIZE = 7.0  # points
_GAP = 6.0  # points between a mark and its name
_MARK = 3.0  # points around a mark that stay free
_COLUMN, _LINE = 3, 1.3 * SIZE  # least number of marks above each other whose names form a list; its line height

Box = tuple[float, float, float, float]  # left, bottom, right, top
Points = NDArray[np.float64]


def label_marks(axes: Any, names: Sequence[str], places: Sequence[tuple[float, float]],
                colors: Sequence[str] = ()) -> list[Box]:  # fmt: skip
    """Write each name beside its mark, at the nearest position where it covers no mark, no other name and no line.

    A name further away has a line to its mark. Marks above each other have their names in the same order to the left.
    Call it last, after the limits of the axes are set. Returns the boxes of the names [points].
    """
    axes.figure.draw_without_rendering()  # the positions of marks are known after the layout
    marks = [(float(x), float(y)) for x, y in _on_paper(axes, places)]
    frame = _frame(axes)
    drawn = [place for line in axes.lines if line.get_marker() not in ("None", "") for place in line.get_xydata()]
    around = [*marks, *map(tuple, _inside(_on_paper(axes, [*places, *drawn]), frame))]
    taken: list[Box] = [(x - _MARK, y - _MARK, x + _MARK, y + _MARK) for x, y in around]
    lines = _lines(axes, frame)
    columns = _columns(names, marks, frame)
    taken += columns.values()
    boxes = []
    for number, (name, place, (x, y)) in enumerate(zip(names, places, marks, strict=True)):
        box = columns.get(number) or _free(x, y, _width(name, SIZE) + 2.0, taken, lines, frame)
        taken.append(box)
        boxes.append(box)
        color = colors[number] if colors else INK
        far = len(_leader((x, y), box)) > 0
        before = box[2] < x
        # in a list from the end of the name, so that no leader crosses another
        start = {"relpos": (1.0, 0.5)} if number in columns else {}
        leader = {"arrowstyle": "-", "color": color, "lw": 0.5, "shrinkA": 0, "shrinkB": 2.0, **start}
        axes.annotate(name, place, (box[2 if before else 0] - x, box[1] - y), textcoords="offset points", fontsize=SIZE,
                      color=color, va="bottom", ha="right" if before else "left", arrowprops=leader if far else None)
    return boxes


def _columns(names: Sequence[str], marks: Sequence[tuple[float, float]], frame: Box) -> dict[int, Box]:
    """Return boxes to the left of marks that are above each other and too close for names beside them."""
    found: dict[int, Box] = {}
    for column in {round(x) for x, _ in marks}:
        rising = sorted((k for k, (x, _) in enumerate(marks) if round(x) == column), key=lambda k: marks[k][1])
        heights = [marks[k][1] for k in rising]
        right = column - 3.0 * _GAP
        widths = [_width(names[k], SIZE) for k in rising]
        if len(rising) < _COLUMN or right - max(widths) < frame[0]:
            continue
        for k in range(1, len(heights)):  # apart upwards, and from the top down again
            heights[k] = max(heights[k], heights[k - 1] + _LINE)
        heights[-1] = min(heights[-1], frame[3] - _LINE)
        for k in reversed(range(len(heights) - 1)):
            heights[k] = min(heights[k], heights[k + 1] - _LINE)
        for k, width, height in zip(rising, widths, heights, strict=True):
            found[k] = (right - width, height - 0.6 * SIZE, right, height + 0.6 * SIZE)
    return found


@cache
def _width(text: str, size: float) -> float:
    """Return the width of a text [points]."""
    from matplotlib.textpath import TextPath

    return float(TextPath((0.0, 0.0), text, size=size).get_extents().width)


def _lines(axes: Any, frame: Box) -> Points:
    """Return points along all drawn lines, both curves and segments."""
    found = [_places_of(line, frame) for line in axes.lines if line.get_linestyle() != "None"]
    for collection in axes.collections:
        found += [_dense(_on_paper(axes, path), frame) for path in getattr(collection, "get_segments", list)()]
    return np.vstack([np.zeros((0, 2)), *found])


def name_curves(axes: Any, words: Mapping[str, str] = MappingProxyType({})) -> None:
    """Write the name of each curve beside it, in its colour, where the name covers least; skip curves already named.

    The name of a curve comes from its `gid`, "curve=name", which `line_arguments` sets. A single curve gets no name.
    The entry of a curve in `words` is written after its name.
    """
    lines = {str(line.get_gid())[6:]: line for line in axes.lines if str(line.get_gid()).startswith("curve=")}
    named = [text.get_text() for text in axes.texts]
    if len(lines) < 2:
        return
    axes.figure.draw_without_rendering()  # the positions of curves are known after the layout
    frame = _frame(axes)
    places = {line: _places_of(line, frame) for line in axes.lines}
    taken: list[Box] = [_box_of(text) for text in axes.texts]
    leaders = np.zeros((0, 2))
    for name, line in lines.items():
        own = places[line]
        if any(text.startswith(name) for text in named) or not len(own):
            continue
        others = np.vstack([leaders, *(found for other, found in places.items() if other is not line)])
        written = name + words.get(name, "")
        box, at = _least(own[:: max(len(own) // _PLACES, 1)], written, NAME_SIZE, frame, taken, own, others)
        taken.append(box)
        middle = (0.5 * (box[0] + box[2]), 0.5 * (box[1] + box[3]))
        far = len(_leader((float(at[0]), float(at[1])), box)) > 0
        leaders = np.vstack([leaders, _leader((float(at[0]), float(at[1])), box)])
        place = axes.transData.inverted().transform(at * axes.figure.dpi / 72.0)
        note = axes.annotate(written, place, (middle[0] - at[0], middle[1] - at[1]), textcoords="offset points",
                             ha="center", va="center", fontsize=NAME_SIZE, color=line.get_color(), zorder=9,
                             gid=f"name={name}",
                             arrowprops={"arrowstyle": "-", "color": line.get_color(), "lw": 0.5} if far else None,
                             annotation_clip=False)
        if far:
            note.arrow_patch.set_gid(f"name={name}")


def arrow_of_time(axes: Any) -> None:
    """Draw an arrow in the direction of time, beside the first half of the first curve."""
    line = axes.lines[0]
    axes.figure.draw_without_rendering()
    path = _places_of(line, _frame(axes))
    middle = len(path) // 4
    way = path[min(middle + _ARROW, len(path) - 1)] - path[max(middle - _ARROW, 0)]
    aside = _ASIDE * np.array([way[1], -way[0]]) / np.hypot(*way)
    back = axes.transData.inverted()
    tail, tip = (back.transform((path[middle] + aside + share * way) * axes.figure.dpi / 72.0) for share in (-0.5, 0.5))
    look = {"arrowstyle": "-|>", "color": MUTED, "lw": 1.1, "mutation_scale": 9.0, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", tip, tail, zorder=8, arrowprops=look).arrow_patch.set_gid("name=")
    axes.annotate("time", 0.5 * (tail + tip), tuple(1.2 * aside), textcoords="offset points", fontsize=NAME_SIZE,
                  color=MUTED, ha="left" if aside[0] > 0 else "right", va="center", gid="name=")


def note_beside(axes: Any, tail: Any, tip: Any, text: str, size: float, **how: Any) -> None:
    """Write the name of an arrow from `tail` to `tip` where it covers the least of arrows, lines and edges of bodies.

    Call it last, after the limits of the axes are set.
    """
    axes.figure.draw_without_rendering()
    frame, scale = _frame(axes), 72.0 / axes.figure.dpi
    own = _dense(_on_paper(axes, [tail, tip]), frame)
    edges = [patch.get_path().transformed(patch.get_transform()).vertices * scale for patch in axes.patches]
    arrows = [_on_paper(axes, [one.xyann, one.xy]) for one in axes.texts if getattr(one, "arrow_patch", None)]
    others = np.vstack([*(_dense(np.asarray(path), frame) for path in (*edges, *arrows)),
                        *(_places_of(line, frame) for line in axes.lines)])
    taken = [_box_of(other) for other in axes.texts if other.get_text()]
    box, at = _least(own, text, size, frame, taken, own, others, shared=0.0)
    place = axes.transData.inverted().transform(at * axes.figure.dpi / 72.0)
    offset = (0.5 * (box[0] + box[2]) - at[0], 0.5 * (box[1] + box[3]) - at[1])
    axes.annotate(text, place, offset, textcoords="offset points", ha="center", va="center", fontsize=size, zorder=9,
                  **how)  # fmt: skip


def _least(starts: Points, name: str, size: float, frame: Box, taken: Sequence[Box], own: Points, others: Points,
           shared: float = 30.0) -> tuple[Box, Points]:  # fmt: skip
    """Return the box in which a name covers least, and the start that it belongs to.

    starts : points beside which the name may be placed; own : points of the named line; others : points of other lines
    shared : cost of a start on another line, where the name could belong to either; less beside it, none _GAP away
    """
    left, bottom, right, top = frame
    extent = np.array([_width(name, size) + 2.0, size + 2.0])
    best: tuple[float, Box, Points] = (np.inf, (0.0, 0.0, 0.0, 0.0), starts[0])
    for at in starts:
        for x, y, away in _AROUND:
            low = at + np.array([x, y]) * (away + 0.5 * extent) - 0.5 * extent
            box = (*low, *(low + extent))
            if box[0] < left or box[1] < bottom or box[2] > right or box[3] > top:
                continue
            cost = (2.0 * _covered(box, others) + 2.0 * _covered(box, own) + away / 4.0 + shared * _near(at, others)
                    + 400.0 * any(_overlap(box, other) for other in taken))
            if cost < best[0]:
                leader = _leader((float(at[0]), float(at[1])), box)
                cost += 40.0 * any(_covered(other, leader) for other in taken)
            if cost < best[0]:
                best = (cost, box, at)
    return best[1:]


NAME_SIZE = 8.0  # points
_PLACES = 40  # number of places along a curve that are tried
# directions and distances [points] of a name from its place on the curve
_AROUND = tuple((x, y, away) for away in (3.0, 10.0, 20.0, 32.0, 48.0)
                for x, y in ((0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, 1), (1, -1), (-1, -1)))  # fmt: skip
_ARROW, _ASIDE = 9, 8.0  # half the length of the arrow of time, in steps, and its distance from the curve [points]
_STEP = 2.0  # points between the places of a curve that a name must not cover

def _on_paper(axes: Any, places: Any) -> Points:
    """Return data coordinates as points (1/72 inch) of the drawing; call it after the layout."""
    return np.asarray(axes.transData.transform(np.asarray(places, dtype=float)) * 72.0 / axes.figure.dpi)


def _frame(axes: Any) -> Box:
    left, bottom, right, top = (72.0 / axes.figure.dpi * side for side in axes.get_window_extent().extents)
    return (left, bottom, right, top)


def _box_of(text: Any) -> Box:
    left, bottom, right, top = (72.0 / text.figure.dpi * side for side in text.get_window_extent().extents)
    return (left, bottom, right, top)


def _places_of(line: Any, frame: Box) -> Points:
    """Return the points that a line covers: points along it, or its marks if they are not joined."""
    from matplotlib.cbook import STEP_LOOKUP_MAP

    steps = STEP_LOOKUP_MAP[line.get_drawstyle()]
    values = np.column_stack(steps(*np.asarray(line.get_xydata(), dtype=float).T))
    paper = np.asarray(line.get_transform().transform(values) * 72.0 / line.axes.figure.dpi)
    if line.get_linestyle() != "None":
        return _dense(paper, frame)
    corners = _MARK * np.array([(0, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)])
    return _inside((paper[:, None, :] + corners).reshape(-1, 2), frame)


def _dense(path: Points, frame: Box) -> Points:
    """Return evenly spaced points along a path that are inside the frame."""
    path = path[np.isfinite(path).all(axis=1)]
    if len(path) > 1:
        way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
        at = np.linspace(0.0, way[-1], min(int(way[-1] / _STEP) + 2, 3000))
        path = np.column_stack([np.interp(at, way, path[:, 0]), np.interp(at, way, path[:, 1])])
    return _inside(path, frame)


def _inside(places: Points, frame: Box) -> Points:
    kept = (places >= np.array(frame[:2]) - 0.5) & (places <= np.array(frame[2:]) + 0.5)
    return np.asarray(places[kept.all(axis=1)])


def _covered(box: Box, points: Points) -> float:
    return float(np.sum((points[:, 0] > box[0]) & (points[:, 0] < box[2]) & (points[:, 1] > box[1])
                        & (points[:, 1] < box[3])))  # fmt: skip


def _near(place: Points, others: Points) -> float:
    """Return how easily a name beside this place could be read as that of another curve: 1 if the curves coincide."""
    if not len(others):
        return 0.0
    return max(0.0, 1.0 - float(np.min(np.hypot(*(others - place).T))) / _GAP)


def _free(x: float, y: float, width: float, taken: Sequence[Box], lines: Points, frame: Sequence[float]) -> Box:
    """Return the first box for a name inside of the axes that covers nothing, else the box that covers least."""
    best: tuple[float, Box] = (np.inf, (0.0, 0.0, 0.0, 0.0))
    for step, away in _TRIED:
        lift = (step + 1) // 2 * SIZE * (1 if step % 2 else -1)  # 0, up, down, further up, ...
        for left in (x + away, x - away - width):
            box = (left, y + lift - 0.6 * SIZE, left + width, y + lift + 0.6 * SIZE)
            inside = box[0] >= frame[0] and box[2] <= frame[2] and box[1] >= frame[1] and box[3] <= frame[3]
            leader = _leader((x, y), box)
            covered = (_covered(box, lines) + 1e3 * sum(_overlap(box, other) for other in taken) + 1e6 * (not inside)
                       + _crossed(leader, lines) + 10.0 * sum(_covered(other, leader) for other in taken))
            if covered == 0.0:
                return box
            best = min(best, (covered + 0.1 * step, box))
    return best[1]


# steps up and down, and distances to the side [points], from the nearest
_TRIED = sorted(((step, away) for step in range(24) for away in (_GAP, 4.0 * _GAP, 10.0 * _GAP)),
                key=lambda tried: 0.5 * SIZE * tried[0] + tried[1])  # fmt: skip


def _leader(mark: tuple[float, float], box: Box) -> Points:
    """Return points along the line from a mark to its name, without those at the mark; none if the name is near."""
    if np.hypot(*(np.clip(mark, box[:2], box[2:]) - mark)) <= _GAP + 2.0:
        return np.zeros((0, 2))
    way = np.array([0.5 * (box[0] + box[2]), 0.5 * (box[1] + box[3])]) - mark
    length = float(np.hypot(*way))
    points = np.asarray(mark + np.arange(_GAP, length, 0.5 * _STEP)[:, None] / length * way)
    return points[((points < box[:2]) | (points > box[2:])).any(axis=1)]


def _crossed(leader: Points, lines: Points) -> float:
    """Return how many points of a leader are at a line."""
    if not len(leader) or not len(lines):
        return 0.0
    return float(np.sum(np.hypot(*(leader[:, None] - lines).transpose(2, 0, 1)).min(axis=1) < _STEP))


def _overlap(a: Box, b: Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]

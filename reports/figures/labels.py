"""Names beside marks, moved apart: no name on another one, nor on a mark."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from reports.figures.style import INK, MUTED

SIZE = 7.0  # points
_LETTER = 0.56  # mean width of a letter, in sizes
_GAP = 5.0  # points between a mark and its name
_MARK = 3.0  # points around a mark that stay free

Box = tuple[float, float, float, float]  # left, bottom, right, top


def label_marks(axes: Any, names: Sequence[str], places: Sequence[tuple[float, float]]) -> list[Box]:
    """Write each name beside its mark: on the right, on the left, or higher and lower until nothing is in the way.

    Call it last, when the limits of the axes stand. Returns the boxes of the names [points].
    """
    axes.figure.draw_without_rendering()  # the layout decides where marks are
    scale = 72.0 / axes.figure.dpi
    marks = [tuple(scale * pixel for pixel in axes.transData.transform(place)) for place in places]
    frame = tuple(scale * side for side in axes.get_window_extent().extents)
    taken: list[Box] = [(x - _MARK, y - _MARK, x + _MARK, y + _MARK) for x, y in marks]
    boxes = []
    for name, place, (x, y) in zip(names, places, marks, strict=True):
        box = _free(x, y, _LETTER * SIZE * len(name), taken, frame)
        taken.append(box)
        boxes.append(box)
        near = abs(0.5 * (box[1] + box[3]) - y) < SIZE
        axes.annotate(name, place, (box[0] - x, box[1] - y), textcoords="offset points", fontsize=SIZE, color=INK,
                      va="bottom", arrowprops=None if near else {"arrowstyle": "-", "color": MUTED, "lw": 0.4})
    return boxes


def _free(x: float, y: float, width: float, taken: Sequence[Box], frame: Sequence[float]) -> Box:
    """The first place for a name that is free and inside of the axes; the last one tried where none is."""
    box: Box = (0.0, 0.0, 0.0, 0.0)
    for step in range(24):
        lift = (step + 1) // 2 * SIZE * (1 if step % 2 else -1)  # 0, up, down, further up, ...
        for left in (x + _GAP, x - _GAP - width):
            box = (left, y + lift - 0.6 * SIZE, left + width, y + lift + 0.6 * SIZE)
            inside = box[0] >= frame[0] and box[2] <= frame[2] and box[1] >= frame[1] and box[3] <= frame[3]
            if inside and not any(_overlap(box, other) for other in taken):
                return box
    return box


def _overlap(a: Box, b: Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]

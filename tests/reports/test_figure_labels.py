"""Names beside marks do not cover one another."""

from __future__ import annotations

from itertools import combinations

import pytest

from reports.figures.labels import label_marks
from reports.figures.style import styled

CROWD = [(0.5 + 0.01 * n, 0.5) for n in range(6)]


@pytest.mark.parametrize("places", [CROWD, [(0.99, 0.99), (0.0, 0.0), (0.985, 0.98)], [(0.5, 0.5)]])
def test_no_name_lies_on_another_or_on_a_mark_or_outside(places):
    with styled() as new_figure:
        drawing = new_figure(figsize=(4.0, 3.0), layout="constrained")
        axes = drawing.add_subplot()
        axes.plot(*zip(*places, strict=True), "o")
        axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
        boxes = label_marks(axes, ["a long name"] * len(places), places)
        scale = 72.0 / drawing.dpi
        marks = [scale * axes.transData.transform(place) for place in places]
        left, bottom, right, top = (scale * side for side in axes.get_window_extent().extents)
    for a, b in combinations(boxes, 2):
        assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]
    for box in boxes:
        assert not any(box[0] < x < box[2] and box[1] < y < box[3] for x, y in marks)
        assert left <= box[0] and box[2] <= right and bottom <= box[1] and box[3] <= top

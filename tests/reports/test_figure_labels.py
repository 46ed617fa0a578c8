"""Names beside marks do not cover one another; no curve runs through the name of one."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.cbook import STEP_LOOKUP_MAP
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from reports.figures.labels import arrow_of_time, label_marks, name_curves, note_beside
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


def test_names_of_marks_above_each_other_are_a_list_in_their_order_and_colour() -> None:
    """As five effects were that save no time: one name after another floated around the crowd."""
    names, heights = ["low", "middle", "high", "highest"], [0.5, 0.5, 0.51, 0.52]
    with styled() as new_figure:
        axes = new_figure(figsize=(4.0, 3.0), layout="constrained").add_subplot()
        axes.plot([0.5] * 4, heights, "o", color="red")
        axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
        boxes = label_marks(axes, names, [(0.5, height) for height in heights], ["red"] * 4)
        assert [text.get_color() for text in axes.texts] == ["red"] * 4
        assert all(text.arrow_patch is not None for text in axes.texts)  # each has a line to its mark
    assert [box[2] for box in boxes] == [boxes[0][2]] * 4  # one margin
    assert all(low[3] <= high[1] + 1e-9 for low, high in zip(boxes, boxes[1:], strict=False))


def crossed(axes: Axes) -> list[tuple[str, str]]:
    """Return (name at a curve, what runs through it: a line's gid) of axes that are drawn."""
    found = []
    for text in axes.texts:
        if not text.get_text() or not str(text.get_gid()).startswith("name="):
            continue
        box = Text.get_window_extent(text)  # without a leader
        core = Bbox.from_extents(box.x0 + 1, box.y0 + box.height / 4, box.x1 - 1, box.y1 - box.height / 4)
        for line in axes.lines:
            steps = STEP_LOOKUP_MAP[line.get_drawstyle()]
            places = np.column_stack(steps(*np.asarray(line.get_xydata(), dtype=float).T))
            path = line.get_transform().transform_path(Path(places))
            if line.get_linestyle() != "None" and path.intersects_bbox(core, False):
                found.append((text.get_text(), str(line.get_gid())))
    return found


def curves(axes: Axes) -> None:
    """Two named curves, and two bounds without a name where names would stand best."""
    x = np.linspace(0.0, 1.0, 50)
    axes.plot(x, 0.4 + 0.2 * x, gid="curve=first")
    axes.plot(x, 0.6 - 0.2 * x, gid="curve=second")
    axes.plot(x, 0.46 + 0.2 * x, "--")
    axes.axvline(0.3)
    axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))


def test_no_line_runs_through_the_name_of_a_curve() -> None:
    with styled() as new_figure:
        axes = new_figure(figsize=(4.0, 3.0), layout="constrained").add_subplot()
        curves(axes)
        name_curves(axes)
        assert [text.get_text() for text in axes.texts] == ["first", "second"] and crossed(axes) == []
        axes.annotate("third", (0.3, 0.8), (0, 0), textcoords="offset points", ha="center", gid="name=third")
        axes.annotate("fourth", (0.8, 0.56), (0, 0), textcoords="offset points", ha="center", va="center", gid="name=f")
        axes.figure.draw_without_rendering()
        assert {name for name, _ in crossed(axes)} == {"third", "fourth"}  # a planted name is noticed


def test_a_curve_is_named_where_it_is_alone_rather_than_where_curves_coincide() -> None:
    """Two paths coincide at first; then they are five points apart, which is closer than a name likes."""
    x, fork = np.linspace(0.0, 1.0, 200), np.linspace(0.0, 1.0, 200) > 0.5
    with styled() as new_figure:
        axes = new_figure(figsize=(4.0, 3.0), layout="constrained").add_subplot()
        axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
        axes.plot(x, 0.5 + np.zeros(200), gid="curve=above")
        axes.plot(x, np.where(fork, 0.475, 0.5), gid="curve=below")
        name_curves(axes)
        assert [text.xy[0] > 0.45 for text in axes.texts] == [True, True]  # type: ignore[attr-defined]


def test_the_name_of_an_arrow_stands_clear_of_bodies_and_arrow() -> None:
    with styled() as new_figure:
        axes = new_figure(figsize=(4.0, 3.0)).add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set(xlim=(0.0, 4.0), ylim=(0.0, 3.0))
        axes.fill([1.9, 2.4, 2.4, 1.9], [0.5, 0.5, 1.7, 1.7])
        axes.annotate("", (2.0, 2.5), (2.0, 1.5), arrowprops={"arrowstyle": "-|>"})
        note_beside(axes, (2.0, 1.5), (2.0, 2.5), "hand", 9)
        axes.figure.draw_without_rendering()
        box = axes.texts[-1].get_window_extent()
        edges = [axes.transData.transform_path(Path(ends)) for ends in
                 ([(2.0, 1.5), (2.0, 2.5)], [(1.9, 0.5), (2.4, 0.5), (2.4, 1.7), (1.9, 1.7), (1.9, 0.5)])]  # fmt: skip
        assert not any(path.intersects_bbox(box, False) for path in edges)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_the_arrow_of_time_points_along_the_path(way: float) -> None:
    with styled() as new_figure:
        axes = new_figure(figsize=(4.0, 3.0)).add_subplot()
        axes.plot(way * np.linspace(0.0, 1.0, 50), way * np.linspace(0.0, 2.0, 50))
        arrow_of_time(axes)
        tip, tail = (np.asarray(end) for end in (axes.texts[0].xy, axes.texts[0].xyann))
        assert axes.texts[0].arrowprops["arrowstyle"] == "-|>" and (way * (tip - tail) > 0.0).all()


def test_no_name_is_struck_through_by_a_line() -> None:
    """As "clustering" was by the front of effects, and every name by the curves at the floor."""
    with styled() as new_figure:
        axes = new_figure(figsize=(4.0, 3.0), layout="constrained").add_subplot()
        axes.plot([0.2, 0.8], [0.5, 0.5], "-o")
        axes.vlines(0.5, 0.1, 0.9)
        axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
        boxes = label_marks(axes, ["clustering", "coupling", "middle"], [(0.2, 0.5), (0.8, 0.5), (0.5, 0.5)])
        left, bottom, right, top = (72.0 / axes.figure.dpi * side for side in axes.get_window_extent().extents)
    across, up = left + 0.5 * (right - left), bottom + 0.5 * (top - bottom)
    ends = [left + share * (right - left) for share in (0.2, 0.8)]
    for box in boxes:
        assert not (box[1] < up < box[3] and box[0] < ends[1] and box[2] > ends[0])
        assert not box[0] < across < box[2]

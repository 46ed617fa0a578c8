"""Accuracy against time: error and energy gain of each impact method against the time that it takes.

The input is a `Numbers` with the columns named below, one row per method and problem; rows of one problem share its
name. Times are medians in microseconds; an error or gain of 0 is drawn at the bottom of the picture.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from reports.figures.energy_gains import plain_powers
from reports.figures.figure import Figure, Numbers, Panel, Recipe
from reports.figures.style import CYCLE, line_arguments, series_legend, styled
from reports.figures.svg import to_svg

KEY, TITLE = "work-precision", "What a microsecond buys"
INPUT = "work_precision"
METHOD, PROBLEM, TIME = "method", "problem", "time [µs]"
ERROR, RESIDUAL, GAIN = "relative error", "restitution residual", "relative energy gain"
CAPTION = (
    "Each mark is one method on one problem; lower left is better. Marks at the very bottom mean none that double "
    "precision can show. "
)
NO_GAIN = "No method gained energy on these problems."
SOME_GAIN = "A method that gains energy is not safe to hold, however fast or accurate it is."
_SMALLEST = 1e-18
_SIZE = (4.1, 3.2)


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw error, residual and energy gain against time."""
    numbers: Numbers = inputs[INPUT]
    methods = tuple(dict.fromkeys(row[numbers.columns.index(METHOD)] for row in numbers.rows))
    shown = tuple(column for column in (ERROR, RESIDUAL, GAIN) if _any_positive(numbers, column))
    panels = tuple(Panel(_marks(numbers, methods, column), f"{column} against time for {', '.join(methods)}.", column)
                   for column in shown)
    caption = CAPTION + (SOME_GAIN if GAIN in shown else NO_GAIN)
    return Figure(KEY, "", TITLE, caption, panels, numbers, series_legend(methods, line=False), (INPUT,))


def _any_positive(numbers: Numbers, column: str) -> bool:
    """Tell whether a column is there and has something to draw."""
    if column not in numbers.columns:
        return False
    at = numbers.columns.index(column)
    return any(row[at] is not None and row[at] > 0.0 for row in numbers.rows)


def _marks(numbers: Numbers, methods: tuple[str, ...], column: str) -> str:
    where, at, of = (numbers.columns.index(name) for name in (METHOD, TIME, column))
    with styled() as new_figure:
        drawing = new_figure(figsize=_SIZE, layout="constrained")
        axes = drawing.add_subplot()
        for number, method in enumerate(methods):
            points = [(float(row[at]), max(float(row[of]), _SMALLEST)) for row in numbers.rows
                      if row[where] == method and None not in (row[at], row[of])]
            look = {**line_arguments(CYCLE[number % len(CYCLE)]), "linestyle": "none", "markersize": 6}
            axes.plot(*zip(*points, strict=True), **look) if points else None
        axes.set(xscale="log", yscale="log", xlabel=TIME, ylabel=column)
        plain_powers(axes)
        return to_svg(drawing, f"{KEY}-{column.split()[-1]}")


RECIPE = Recipe(KEY, "", TITLE, (INPUT,), draw, section="accuracy")

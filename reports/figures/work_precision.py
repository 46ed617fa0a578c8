"""Accuracy against time: error and energy gain of each impact method against the time that it takes.

The input is a `Numbers` with the columns named below, one row per method and problem; rows of one problem share its
name. Times are medians in microseconds; an error or gain of 0 is drawn at the bottom of the picture.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from reports.figures.energy_gains import plain_powers
from reports.figures.figure import Figure, Numbers, Panel, Recipe
from reports.figures.rigid_convergence import look
from reports.figures.style import line_arguments, styled
from reports.figures.svg import to_svg

KEY, TITLE = "work-precision", "What a microsecond buys"
INPUT = "work_precision"
METHOD, PROBLEM, TIME = "method", "problem", "time [µs]"
FAILED = "failed after [µs]"
ERROR, RESIDUAL, GAIN = "relative error", "restitution residual", "relative energy gain"
CAPTION = (
    "Each mark is one method on one problem; lower left is better. Marks at the very bottom mean none that double "
    "precision can show. Crosses at the upper rim are failures, after the time at which they were given up. "
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
    legend = tuple((method, replace(look(number), width=0.0)) for number, method in enumerate(methods))
    return Figure(KEY, "", TITLE, caption, panels, numbers, legend, (INPUT,))


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
            marks = {**line_arguments(look(number)), "linestyle": "none", "markersize": 6}
            axes.plot(*zip(*points, strict=True), **marks) if points else None
            lost = _failures(numbers, method)
            axes.plot(lost, [0.985] * len(lost), "x", color=look(number).color, markersize=5,
                      transform=axes.get_xaxis_transform())  # fmt: skip
        axes.set(xscale="log", yscale="log", xlabel=TIME, ylabel=column)
        plain_powers(axes)
        return to_svg(drawing, f"{KEY}-{column.split()[-1]}")


def _failures(numbers: Numbers, method: str) -> list[float]:
    """Times at which a method's failures were given up."""
    if FAILED not in numbers.columns:
        return []
    where, at = numbers.columns.index(METHOD), numbers.columns.index(FAILED)
    return [float(row[at]) for row in numbers.rows if row[where] == method and row[at] is not None]


RECIPE = Recipe(KEY, "", TITLE, (INPUT,), draw, section="accuracy")

"""Accuracy against time: error and energy gain of each impact method against the time that it takes.

The input is a `Table` with the columns named below, one row per method and problem; rows of one problem share its
name. Times are medians in microseconds; an error or gain of 0 is drawn at the bottom of the picture.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from reports.figures.energy_gains import plain_powers
from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.rigid_convergence import look
from reports.figures.style import line_arguments, styled
from reports.figures.svg import to_svg
from verification.finding import Table

KEY, TITLE = "work-precision", "What a microsecond buys"
INPUT = "work_precision"
METHOD, PROBLEM, TIME = "method", "problem", "time"
FAILED = "failed after"
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
    numbers: Table = inputs[INPUT]
    methods = tuple(dict.fromkeys(numbers.column(METHOD)))
    shown = tuple(column for column in (ERROR, RESIDUAL, GAIN) if _any_positive(numbers, column))
    panels = tuple(Panel(_marks(numbers, methods, column), f"{column} against time for {', '.join(methods)}.", column)
                   for column in shown)
    caption = CAPTION + (SOME_GAIN if GAIN in shown else NO_GAIN)
    legend = tuple((method, replace(look(number), width=0.0)) for number, method in enumerate(methods))
    return Figure(KEY, "", TITLE, caption, panels, numbers, legend, (INPUT,))


def _any_positive(numbers: Table, column: str) -> bool:
    """Tell whether a column is there and has something to draw."""
    return column in numbers.keys and any(value is not None and value > 0.0 for value in numbers.column(column))


def _marks(numbers: Table, methods: tuple[str, ...], column: str) -> str:
    with styled() as new_figure:
        drawing = new_figure(figsize=_SIZE, layout="constrained")
        axes = drawing.add_subplot()
        for number, method in enumerate(methods):
            mine = numbers.where(method=method).select((TIME, column)).rows
            points = [(float(time), max(float(error), _SMALLEST)) for time, error in mine if None not in (time, error)]
            marks = {**line_arguments(look(number)), "linestyle": "none", "markersize": 6}
            axes.plot(*zip(*points, strict=True), **marks) if points else None
            lost = _failures(numbers, method)
            axes.plot(lost, [0.985] * len(lost), "x", color=look(number).color, markersize=5,
                      transform=axes.get_xaxis_transform())  # fmt: skip
        axes.set(xscale="log", yscale="log", xlabel="time [µs]", ylabel=column)
        plain_powers(axes)
        return to_svg(drawing, f"{KEY}-{column.split()[-1]}")


def _failures(numbers: Table, method: str) -> list[float]:
    """Times at which a method's failures were given up."""
    found = numbers.where(method=method).column(FAILED) if FAILED in numbers.keys else []
    return [float(seconds) for seconds in found if seconds is not None]


RECIPE = Recipe(KEY, "", TITLE, (INPUT,), draw, section="accuracy")

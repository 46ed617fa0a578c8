"""The rigid world against event-driven truth: error against step, scene by scene, beside the slope of first order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from reports.figures.energy_gains import plain_powers
from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.style import CYCLE, STYLES, LineStyle, line_arguments, styled
from reports.figures.svg import to_svg
from verification.finding import Table

KEY, TITLE = "rigid-convergence", "The rigid world converges to event-driven truth"
INPUT = "complementarity/convergence"
SCENE, STEP = "scene", "step"
ERRORS = {"positions, sup norm": "error of positions", "velocities, L¹ over time": "error of velocities"}
CAPTION = (
    "The largest error of three steps near each mark, before impacts accumulate. Parallel to the dashed line: "
    "errors in proportion to the step, which is all that a scheme can do that does not locate impacts. A scene "
    "whose error is rounding alone has no curve."
)
_ROUNDING = 1e-12  # errors below are none
_SIZE = (4.4, 3.4)


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw positions and velocities."""
    numbers: Table = inputs[INPUT]
    rows = numbers.records()
    scenes = tuple(dict.fromkeys(row[SCENE] for row in rows))
    panels = tuple(Panel(_curves(rows, scenes, column), f"Errors of {label} against the step.", label)
                   for label, column in ERRORS.items())  # fmt: skip
    legend = (*((scene, look(number)) for number, scene in enumerate(scenes)), ("first order", STYLES["bound"]))
    return Figure(KEY, "", TITLE, CAPTION, panels, numbers, legend, (INPUT,))


def look(number: int) -> LineStyle:
    """A style for each scene; from the second round on with empty markers."""
    return replace(CYCLE[number % len(CYCLE)], filled=number < len(CYCLE))


def _curves(rows: list[dict[str, Any]], scenes: tuple[str, ...], column: str) -> str:
    with styled() as new_figure:
        drawing = new_figure(figsize=_SIZE, layout="constrained")
        axes = drawing.add_subplot()
        drawn = []
        for number, scene in enumerate(scenes):
            curve = sorted((row[STEP], row[column]) for row in rows if row[SCENE] == scene and row[column] > _ROUNDING)
            if curve:
                axes.plot(*zip(*curve, strict=True), **line_arguments(look(number)))
                drawn += curve
        if drawn:
            _slope(axes, drawn)
        axes.set(xscale="log", yscale="log", xlabel="step [ms]", ylabel="error")
        plain_powers(axes)
        steps = sorted({row[STEP] for row in rows})
        axes.set_xticks(steps, [f"{step:.2g}" for step in steps])
        return to_svg(drawing, f"{KEY}-{column.split()[-1]}")


def _slope(axes: Any, drawn: list[tuple[float, float]]) -> None:
    """A line of slope one below all curves."""
    steps, lowest = [step for step, _ in drawn], min(error / step for step, error in drawn)
    ends = (min(steps), max(steps))
    axes.plot(ends, [0.5 * lowest * step for step in ends], **line_arguments(STYLES["bound"], marked=False))


RECIPE = Recipe(KEY, "", TITLE, (INPUT,), draw, section="complementarity")

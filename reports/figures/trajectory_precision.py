"""Whole motions: error against event-driven truth over CPU time, one row of panels per scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from reports.figures.energy_gains import plain_powers
from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.style import STYLES, LineStyle, line_arguments, series_legend, styled
from reports.figures.svg import to_svg
from verification.finding import Table

KEY, TITLE, INPUT = "trajectory-precision", "What accuracy of a whole motion costs", "haptic-rate/motions"
SCENE, METHOD, TIME, OUTCOME = "scene", "method", "time", "outcome"
ERRORS = {"position": "positions [lengths]", "velocity": "velocities [speeds]", "energy": "energy [kinetic]"}
CAPTION = (
    "Each mark is one run with one step, lower left is better; lines join the steps of a method. A curve that ends "
    "level has an error that no step mends: the model of contact decides, not the step. Crosses at the "
    "upper rim are runs that failed or would take too long. Marks at the very bottom: no error that double precision "
    "or the samples can show."
)
_SMALLEST, _SIZE = 1e-9, (4.1, 3.1)


def draw(inputs: Mapping[str, Any]) -> Figure:
    """A panel per scene and error."""
    numbers: Table = inputs[INPUT]
    rows = numbers.records()
    methods = tuple(dict.fromkeys(row[METHOD] for row in rows))
    panels = tuple(
        Panel(_curves(rows, methods, scene, column, f"{number}-{column}"),
              f"{scene}: error of {label} against CPU time for {', '.join(methods)}.", f"{scene}: {label}")
        for number, scene in enumerate(dict.fromkeys(row[SCENE] for row in rows)) for column, label in ERRORS.items()
    )  # fmt: skip
    return Figure(KEY, "", TITLE, CAPTION, panels, numbers, _legend(methods), (INPUT,))


def _legend(methods: Sequence[str]) -> tuple[tuple[str, LineStyle], ...]:
    return series_legend(methods)


def _curves(rows: list[dict[str, Any]], methods: Sequence[str], scene: str, column: str, key: str) -> str:
    looks = dict(_legend(methods))
    with styled() as new_figure:
        drawing = new_figure(figsize=_SIZE, layout="constrained")
        axes = drawing.add_subplot()
        for method in methods:
            here = [row for row in rows if row[SCENE] == scene and row[METHOD] == method]
            curve = [(row[TIME], max(row[column], _SMALLEST)) for row in here if row[column] is not None]
            if curve:
                axes.plot(*zip(*curve, strict=True), **line_arguments(looks[method]))
            lost = [row[TIME] for row in here if row[OUTCOME] != "ok" and row[TIME]]
            axes.plot(lost, [0.98] * len(lost), "x", color=looks[method].color, markersize=5,
                      transform=axes.get_xaxis_transform())  # fmt: skip
        axes.set(xscale="log", yscale="log", xlabel="CPU time [ms]", ylabel=f"error of {column}")
        plain_powers(axes)
        axes.axhline(1.0, **line_arguments(STYLES["bound"], marked=False) | {"alpha": 0.4, "linewidth": 0.8})
        return to_svg(drawing, f"{KEY}-{key}")


RECIPE = Recipe(KEY, "", TITLE, (INPUT,), draw, section="haptic-rate")

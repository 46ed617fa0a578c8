"""How the time of one impact grows with contacts and with coordinates, with the fitted power laws."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from reports.figures.energy_gains import plain_powers
from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.style import STYLES, line_arguments, styled
from reports.figures.svg import to_svg
from verification.finding import Table

KEY, TITLE = "impact-scaling", "How one impact's time grows"
INPUTS = ("haptic-rate/scaling", "haptic-rate/fitted")
AXES = {"contacts": ("coordinates", 12), "coordinates": ("contacts", 60)}  # varied -> what is held, and at what
LOOKS = {"factored": STYLES["IAPB"], "gram_pinv": STYLES["PB"]}
CAPTION = (
    "Medians with quartiles; thin lines are fitted powers. Every contact adds a row to the factored impact but no more "
    "work per row than the rank asks for; the pseudo-inverse of the printed formula is of a matrix of all contacts."
)


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Two panels."""
    numbers, fitted = (inputs[name] for name in INPUTS)
    powers = {(method, axis): power for method, axis, power in fitted.rows}
    panels = tuple(
        Panel(_curves(numbers, powers, axis), f"Time of one impact against the number of {axis}.",
              f"{axis}, with {held[1]} {held[0]}") for axis, held in AXES.items()
    )  # fmt: skip
    return Figure(KEY, "", TITLE, CAPTION, panels, numbers, tuple(LOOKS.items()), INPUTS)


def _curves(numbers: Table, powers: Mapping[tuple[str, str], float], axis: str) -> str:
    rows = numbers.records()
    held, value = AXES[axis]
    with styled() as new_figure:
        drawing = new_figure(figsize=(4.1, 3.0), layout="constrained")
        axes = drawing.add_subplot()
        for method, look in LOOKS.items():
            curve = sorted((row[axis], row["time"], row["lower quartile"], row["upper quartile"])
                           for row in rows if row["method"] == method and row[held] == value)  # fmt: skip
            size, middle, low, high = (np.array(part) for part in zip(*curve, strict=True))
            axes.plot(size, middle, **line_arguments(look) | {"linestyle": "none"})
            axes.vlines(size, low, high, color=look.color, linewidth=1.0)
            power = powers[method, axis]
            level = np.exp(np.mean(np.log(middle) - power * np.log(size)))
            axes.plot(size, level * size**power, color=look.color, linewidth=0.9)
            axes.annotate(f"exponent {power + 0.0:.2f}".replace("-", "−"), (size[-1], middle[-1]),
                          textcoords="offset points", xytext=(-4, 7), ha="right", color=look.color)  # fmt: skip
        axes.set(xscale="log", yscale="log", xlabel=axis, ylabel="time of one impact [µs]")
        plain_powers(axes)
        return to_svg(drawing, f"{KEY}-{axis}")


RECIPE = Recipe(KEY, "", TITLE, INPUTS, draw, section="haptic-rate")

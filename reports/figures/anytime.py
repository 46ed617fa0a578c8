"""The anytime impact: what is left of restitution, and of the energy to be lost, when it stops early."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.style import LineStyle, line_arguments, series_legend, styled
from reports.figures.svg import to_svg
from verification.finding import Table

KEY, TITLE, INPUT = "anytime", "Stopping an impact early", "haptic-rate/budgets"
BUDGET, RESIDUAL, LOST = "budget", "median residual", "share of the loss"
CAPTION = (
    "Plastic impacts stopped after so many rows, the largest unmet one first. What is not yet resolved falls with "
    "every row, and at the rank to rounding; the energy taken never exceeds what the whole impact takes, so no budget "
    "is unsafe."
)
_SMALLEST = 1e-17


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Residual and energy."""
    numbers: Table = inputs[INPUT]
    rows = numbers.records()
    names = tuple(dict.fromkeys(_name(row) for row in rows))
    legend = series_legend(names)
    panels = (
        Panel(_curves(rows, dict(legend), RESIDUAL, "log"), "Residual against the share of rows done.", RESIDUAL),
        Panel(_curves(rows, dict(legend), LOST, "linear"), "Energy taken against the share of rows done.",
              "energy taken, of what the whole impact takes"),
    )  # fmt: skip
    return Figure(KEY, "", TITLE, CAPTION, panels, numbers, legend, (INPUT,))


def _name(row: Mapping[str, Any]) -> str:
    return f"{row['coordinates']} coordinates, {row['contacts']} contacts, rank {row['rank']}"


def _curves(rows: list[dict[str, Any]], looks: Mapping[str, LineStyle], column: str, scale: str) -> str:
    with styled() as new_figure:
        drawing = new_figure(figsize=(4.1, 3.0), layout="constrained")
        axes = drawing.add_subplot()
        for name, look in looks.items():
            here = [row for row in rows if _name(row) == name]
            values = [max(row[column], _SMALLEST) for row in here]
            axes.plot([row[BUDGET] / row["rank"] for row in here], values, **line_arguments(look))
        axes.set(yscale=scale, xlabel="rows done, of the rank", ylabel=column)
        axes.set_xlim(-0.02, 1.02)
        return to_svg(drawing, f"{KEY}-{column.split()[-1]}")


RECIPE = Recipe(KEY, "", TITLE, (INPUT,), draw, section="haptic-rate")

"""Figure: how hard a wall feels, how long it bounces and how deep the hand goes, against its stiffness."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from reports.figures.energy_gains import plain_powers
from reports.figures.figure import Figure, Numbers, Panel, Recipe
from reports.figures.style import STYLES, line_arguments, styled
from reports.figures.svg import to_svg

KEY, TITLE, INPUT = "hardness", "How hard a wall feels", "stability/hardness"
CAPTION = (
    "A device without damping at 512 Hz with ideal sensors, walls with the paper's damping of 50 N s/m. The first "
    "rise of the force is what feels hard: with impulses it does not depend on the wall's stiffness. Where a curve "
    "ends, the contact never comes to rest."
)
_LOOKS = {"penalty": STYLES["PB"], "impulses": STYLES["IAPB"]}
_SHOWN = ((5, "rate-hardness [N/m]"), (6, "settles after [s]"), (7, "penetration [mm]"))
_LOOP = (512.0, "ideal", 0.0)


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Three panels over the stiffness."""
    table: Numbers = inputs[INPUT]
    rows = [row for row in table.rows if row[:3] == _LOOP]
    panels = tuple(Panel(_curves(rows, column, label), f"{label} against stiffness, penalties and impulses.", label)
                   for column, label in _SHOWN)
    return Figure(KEY, "", TITLE, CAPTION, panels, table, tuple(_LOOKS.items()), (INPUT,))


def _curves(rows: list[tuple[Any, ...]], column: int, label: str) -> str:
    with styled() as new_figure:
        drawing = new_figure(figsize=(3.3, 2.6), layout="constrained")
        axes = drawing.add_subplot()
        for law, look in _LOOKS.items():
            points = [(row[4], row[column]) for row in rows if row[3] == law and row[column] is not None]
            axes.plot(*zip(*points, strict=True), **line_arguments(look))
        axes.set(xscale="log", yscale="log", xlabel="stiffness [N/m]", ylabel=label)
        plain_powers(axes)
        return to_svg(drawing, f"{KEY}-{column}")


RECIPE = Recipe(KEY, "", TITLE, (INPUT,), draw, section="stability")

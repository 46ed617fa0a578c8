"""Figure: how hard a wall feels, how long it bounces and how deep the hand goes, against its stiffness."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from reports.figures.energy_gains import plain_powers
from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.style import STYLES, line_arguments, styled
from reports.figures.svg import to_svg
from verification.finding import Table

KEY, TITLE, INPUT = "hardness", "How hard a wall feels", "stability/hardness"
CAPTION = (
    "A device without damping at 512 Hz with ideal sensors, walls with the paper's damping of 50 N s/m. The first "
    "rise of the force is what feels hard: with impulses it does not depend on the wall's stiffness. Where a curve "
    "ends, the contact never comes to rest."
)
_LOOKS = {"penalty": STYLES["PB"], "impulses": STYLES["IAPB"]}
_SHOWN = ("rate-hardness", "settles after", "penetration")
_LOOP = {"rate": 512.0, "sensors": "ideal", "device damping": 0.0}


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Three panels over the stiffness."""
    table: Table = inputs[INPUT]
    labels = {column.key: column.title for column in table.columns}
    here = table.where(**_LOOP).records()
    panels = tuple(Panel(_curves(here, key, labels[key]), f"{labels[key]} against stiffness, penalties and impulses.",
                         labels[key]) for key in _SHOWN)  # fmt: skip
    return Figure(KEY, "", TITLE, CAPTION, panels, table, tuple(_LOOKS.items()), (INPUT,))


def _curves(rows: list[dict[str, Any]], key: str, label: str) -> str:
    with styled() as new_figure:
        drawing = new_figure(figsize=(3.3, 2.6), layout="constrained")
        axes = drawing.add_subplot()
        for law, look in _LOOKS.items():
            points = [(row["stiffness"], row[key]) for row in rows if row["law"] == law and row[key] is not None]
            axes.plot(*zip(*points, strict=True), **line_arguments(look))
        axes.set(xscale="log", yscale="log", xlabel="stiffness [N/m]", ylabel=label)
        plain_powers(axes)
        return to_svg(drawing, f"{KEY}-{_SHOWN.index(key) + 5}")


RECIPE = Recipe(KEY, "", TITLE, (INPUT,), draw, section="stability")

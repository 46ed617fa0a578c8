"""Figure: which sampled walls a hand can lean on, by penalties and by impulses, beside Colgate's condition."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from reports.figures.energy_gains import plain_powers
from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.style import BLUE, INK, MUTED, PAPER, VERMILION, LineStyle, styled
from reports.figures.svg import to_svg
from verification.finding import Table

KEY, TITLE = "stability-map", "Walls that come to rest"
MAPS, DAMPINGS = "stability/maps", "stability/dampings"
CAPTION = (
    "Each place is a wall, stiffer to the right, more damped upwards; the lowest row has no damping. Look for the blue "
    "rings: walls that only come to rest with impulses, mostly stiff ones with little damping. No mark: neither law "
    "holds it. Walls under the dashed line are passive for every hand; a device without damping has none."
)
LEGEND = (("both laws", LineStyle(MUTED, "o", (), 0.0)), ("only impulses", LineStyle(BLUE, "o", (), 0.0, filled=False)),
          ("only penalties", LineStyle(VERMILION, "s", (), 0.0)), ("b = KT/2 + B", LineStyle(INK, "", (4, 2), 1.2)))
LOOP = ("rate", "sensors", "device damping")
_SETTLES = "+"
_SIZE = (3.1, 2.5)


def draw(inputs: Mapping[str, Any]) -> Figure:
    """One panel per loop."""
    table: Table = inputs[MAPS]
    damping = np.array(inputs[DAMPINGS].column("damping"))
    loops = dict.fromkeys(table.select(LOOP).rows)
    panels = tuple(_panel(number, loop, table.where(**dict(zip(LOOP, loop, strict=True))), damping)
                   for number, loop in enumerate(loops))
    return Figure(KEY, "", TITLE, CAPTION, panels, table, LEGEND, (MAPS, DAMPINGS))


def _panel(number: int, loop: tuple[Any, ...], walls: Table, damping: np.ndarray) -> Panel:
    rate, sensors, b = loop
    stiffness, bound = np.array(walls.column("stiffness")), np.array(walls.column("passive up to"))
    theirs, ours = (np.array([[mark == _SETTLES for mark in marks] for marks in walls.column(law)])
                    for law in ("penalties", "impulses"))  # fmt: skip
    shown = np.where(damping > 0.0, damping, damping[damping > 0.0].min() / 2.0)  # the row without damping
    K, B = np.meshgrid(stiffness, shown, indexing="ij")
    with styled() as new_figure:
        drawing = new_figure(figsize=_SIZE, layout="constrained")
        axes = drawing.add_subplot()
        for where, look in ((theirs & ours, {"marker": ".", "color": MUTED, "s": 9}),
                            (ours & ~theirs, {"marker": "o", "facecolor": PAPER, "edgecolor": BLUE, "s": 17}),
                            (theirs & ~ours, {"marker": "s", "color": VERMILION, "s": 11})):  # fmt: skip
            axes.scatter(K[where], B[where], zorder=3, **look)
        if (bound > 0.0).any():
            fine = np.geomspace(stiffness[0], 2.0 * b * rate * 0.999, 60)
            axes.plot(fine, np.maximum(b - 0.5 * fine / rate, shown[0] * 0.7), color=INK, dashes=(4, 2), linewidth=1.2)
        axes.set(xscale="log", yscale="log", xlabel="stiffness [N/m]", ylabel="damping [N s/m]",
                 xlim=(stiffness[0] / 1.3, stiffness[-1] * 1.3), ylim=(shown[0] * 0.7, shown[-1] * 1.4))
        plain_powers(axes)
        svg = to_svg(drawing, f"{KEY}-{number}")
    alt = (f"Of {ours.size} walls {int(theirs.sum())} come to rest with penalties, {int(ours.sum())} with impulses.")
    return Panel(svg, alt, f"{rate:.0f} Hz, {sensors} sensors, b = {b:g} N s/m")


RECIPE = Recipe(KEY, "", TITLE, (MAPS, DAMPINGS), draw, section="stability")

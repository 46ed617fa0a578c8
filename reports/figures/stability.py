"""Sampled walls: which ones are stable under a hand, and how hard they feel, with penalties and
with impulses."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from iapb.run import Run
from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.plot import TIME, Plot
from reports.figures.style import BOUND, FORCE, LINK, MUTED, STYLES, LineStyle, line_arguments
from verification.stability.walls import GROWS, SETTLED_SPEED, SETTLES
from verification.table import Table

# where a wall comes to rest, else what the mass does with impulses -> its mark, in the colour of
# the world
_HOLDS = {
    "both laws": LineStyle(MUTED, "o", (), 0.0),
    "only impulses": replace(STYLES["impulses"], width=0.0, filled=False, name=""),
    "only penalties": replace(STYLES["penalty"], width=0.0, name=""),
    "neither, keeps bouncing": LineStyle(LINK, "|", (), 0.0, filled=False),
    "neither, moves ever more": LineStyle(FORCE, "X", (), 0.0),
}
_LOOP = ("rate", "sensors", "device damping")


@recipe("stability-map", "stability/maps", "stability/dampings")
def stability_map(table: Table, dampings: Table) -> Drawn:
    """Draw one panel per loop."""
    damping = np.array(dampings.column("damping"))
    panels = [
        _walls(number, loop, table.where(**dict(zip(_LOOP, loop, strict=True))), damping)
        for number, loop in enumerate(dict.fromkeys(table.select(_LOOP).rows))
    ]
    return Drawn(panels, table, _HOLDS | {"b = KT/2 + B": BOUND}, {"rest": 1e3 * SETTLED_SPEED})


def _walls(number: int, loop: tuple[Any, ...], walls: Table, damping: np.ndarray) -> Panel:
    rate, sensors, b = loop
    stiffness, bound = np.array(walls.column("stiffness")), np.array(walls.column("passive up to"))
    theirs, ours = (
        np.array([[mark == SETTLES for mark in marks] for marks in walls.column(law)])
        for law in ("penalties", "impulses")
    )
    grows = np.array([[mark == GROWS for mark in marks] for marks in walls.column("impulses")])
    neither = ~theirs & ~ours
    shown = np.where(
        damping > 0.0, damping, damping[damping > 0.0].min() / 2.0
    )  # the row without damping
    K, B = np.meshgrid(stiffness, shown, indexing="ij")
    with Plot(f"stability-map-{number}", (3.4, 2.6)) as plot:
        states = (theirs & ours, ours & ~theirs, theirs & ~ours, neither & ~grows, neither & grows)
        for where, look in zip(states, _HOLDS.values(), strict=True):
            plot.marks(zip(K[where], B[where], strict=True), look, markersize=3.6)
        if sensors == "ideal" and (bound > 0.0).any():  # Colgate's condition is for ideal sensors
            fine = np.geomspace(stiffness[0], 2.0 * b * rate * 0.999, 60)
            plot.curve(
                zip(fine, np.maximum(b - 0.5 * fine / rate, shown[0] * 0.7), strict=True), BOUND
            )
        plot.log(
            "stiffness [N/m]",
            "damping [N s/m]",
            xlim=(stiffness[0] / 1.3, stiffness[-1] * 1.3),
            ylim=(shown[0] * 0.7, shown[-1] * 1.4),
        )
    alt = f"Of {ours.size} walls {int(theirs.sum())} come to rest with penalties, {int(ours.sum())} with impulses."
    return Panel(plot.svg, alt, f"{rate:.0f} Hz, {sensors} sensors, b = {b:g} N s/m")


_LAWS = {"penalty": STYLES["penalty"], "impulses": STYLES["impulses"]}
_FELT = ("rate-hardness", "settles after", "penetration")


@recipe("hardness", "stability/hardness")
def hardness(table: Table) -> Drawn:
    """Draw three panels over the stiffness."""
    labels = {column.key: column.title for column in table.columns}
    here = table.where(**dict(zip(_LOOP, (512.0, "ideal", 0.0), strict=True)))
    panels = []
    for number, key in enumerate(_FELT, start=5):
        with Plot(f"hardness-{number}", (3.3, 2.6)) as plot:
            for law, look in _LAWS.items():
                rows = here.where(law=law).select(("stiffness", key)).rows
                plot.curve(
                    [(stiffness, value) for stiffness, value in rows if value is not None], look
                )
            plot.log("stiffness [N/m]", labels[key])
            if key == _FELT[-1]:  # little more than a decade
                plot.ticks("y", (0.3, 1.0, 3.0))
        panels.append(
            Panel(
                plot.svg, f"{labels[key]} against stiffness, penalties and impulses.", labels[key]
            )
        )
    return Drawn(panels, table, _LAWS)


@recipe("stiff-wall", "wall/ideal", "wall/IAPB", "wall/PB")
def stiff_wall(*runs: Run) -> Drawn:
    """Draw the kinetic energy of the tool over time, in each world."""
    looks, gains = {world: STYLES[world] for world in ("ideal", "IAPB", "PB")}, dict[str, str]()
    with Plot("stiff-wall-0", kind=TIME) as plot:
        for run, (world, look) in zip(runs, looks.items(), strict=True):
            kinetic = run.energy["kinetic"]
            gains[world] = f"{kinetic.max() / kinetic[0]:.2g}"
            plot.axes.plot(run.time, 1e3 * kinetic, **line_arguments(look), markevery=150)
        plot.axes.set(xlabel="t [s]", ylabel="kinetic energy of the tool [mJ]")
    words = (
        f"Largest kinetic energy, relative to the start: {', '.join(map(' '.join, gains.items()))}."
    )
    return Drawn([Panel(plot.svg, words)], None, looks, gains)

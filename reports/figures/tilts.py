"""The first picture: a peg is pushed into a corner, nearly straight and tilted, in every world.

The paper's frame is turned: to the right and upwards are positive, and the corner is at the origin.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from iapb.run import Run
from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.plot import Plot, note
from reports.figures.style import PAPER, STYLES, WALL, line_arguments
from verification.check import Study
from verification.claims.conditions import Condition
from verification.claims.peg import PUSHING, WORLDS, apart_from, closest, trace
from verification.table import Table, titled

MILLI = 1e3
CURVES = {
    "ideal": "rigid wall",
    "IAPB": "impulse, then spring (IAPB)",
    "PB": "spring only (PB)",
    "CBuc": "rigid wall through a spring (CBuc)",
}
REMEDY = "impulses that only push (ours)"
# [rad]: 0.86° and 11.5°
STRAIGHT = 0.015
TILTED_BY = 0.2
WINDOW = (-14.6, -8.8), (3.5, 6.4)  # [mm] of the path
# inches
PAIR = (3.0, 2.0)
WHOLE = (6.2, 1.75)


@recipe("hero", "peg at every tilt")
def hero(tilted: Mapping[float, Mapping[str, Run]]) -> Drawn:
    """Draw the path of the hand at a small tilt, the angle at a large one, and the distance over
    all tilts."""
    numbers = _distances(tilted)
    panels = (
        Panel(_paths(tilted[STRAIGHT]), "Path of the hand at a tilt of 0.86°: impulses keep near."),
        Panel(_angles(tilted[TILTED_BY]), "Angle of the peg over 3 s: impulses stop it."),
        Panel(_over_tilts(numbers), "Distance from the rigid wall over the tilt.", wide=True),
    )
    legend = {text: STYLES[name] for name, text in CURVES.items()} | {REMEDY: STYLES[PUSHING]}
    return Drawn(panels, numbers, legend)


def _paths(runs: Mapping[str, Run]) -> str:
    with Plot("hero-paths", PAIR) as plot:
        (left, right), (low, high) = WINDOW
        plot.axes.axhspan(low, 5.25, color=WALL, alpha=0.6, linewidth=0)
        plot.axes.set(
            xlim=(left, right), ylim=(low, high), xlabel="to the wall [mm]", ylabel="height [mm]"
        )
        plot.axes.grid(False)
        for name in CURVES:
            x, y, _ = -MILLI * runs[name].device_q.T
            plot.axes.plot(x, y, **_line(name))
        note(plot.axes, (-14.4, 3.75), "in the floor", fontsize=8, ha="left")
    return plot.svg


def _angles(runs: Mapping[str, Run]) -> str:
    with Plot("hero-angles", PAIR) as plot:
        plot.axes.set(xlim=(0.0, 3.0), xlabel="time [s]", ylabel="tilt [°]")
        for name in (*CURVES, PUSHING):
            run = runs[name]
            plot.axes.plot(run.time, np.degrees(run.device_q[:, 2]), **_line(name))
    return plot.svg


def _over_tilts(numbers: Table) -> str:
    with Plot("hero-tilts", WHOLE) as plot:
        plot.axes.set(
            xlim=(-0.3, 20.4), xlabel="tilt of the peg at the start [°]", ylabel="distance [mm]"
        )
        tilts = numbers["tilt"]
        for name in (*WORLDS, PUSHING):
            plot.curve(zip(tilts, numbers[name], strict=True), STYLES[name])
        open_ = [
            (tilt, ours)
            for tilt, ours, told in zip(tilts, numbers["IAPB"], numbers["nearest"], strict=True)
            if told == "too close to call"
        ]
        plot.axes.plot(*np.reshape(open_, (-1, 2)).T, "o", mfc=PAPER, mec=STYLES["IAPB"].color)
        plot.axes.set_ylim(bottom=0.0)
    return plot.svg


def _line(name: str) -> dict[str, Any]:
    return line_arguments(STYLES[name], marked=False)


def _distances(tilted: Mapping[float, Mapping[str, Run]]) -> Table:
    """Return the distances from the rigid wall at each tilt, as claim C10 measures them."""
    return titled(
        ("tilt [°]", *(f"{name} [mm]" for name in (*WORLDS, PUSHING)), "nearest"),
        [_row(tilt, runs) for tilt, runs in tilted.items()],
        digits=3,
        note="Root mean square of √(Δx² + Δy² + (50 mm Δθ)²).",
    )


def _row(tilt: float, runs: Mapping[str, Run]) -> Sequence[Any]:
    study = Study(run=lambda scene, world, rendering: runs[world])
    start = Condition(tilt)
    worlds = {name: trace(study, start, name) for name in (*WORLDS, PUSHING)}
    *_, together = apart_from(trace(study, start, "ideal"), worlds)
    ahead = closest(together)
    nearest = "too close to call" if ahead is None else min(WORLDS, key=together.__getitem__)
    return (np.degrees(tilt), *(MILLI * together[name] for name in worlds), nearest)

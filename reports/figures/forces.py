"""Panels of a force figure: what the device's actuators apply along x and about the peg, over time.

An impact of one step is hundreds of times the force that holds the peg afterwards, so each force is drawn twice:
in full, and magnified around the force that balances the hand.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from iapb.run import Run
from reports.figures.figure import Numbers, Panel
from reports.figures.measures import peak_force
from reports.figures.style import PANEL, STYLES, line_arguments, styled
from reports.figures.traces import curve_id, traced_svg
from reports.figures.trajectories import marks

_FORCES = ((0, "force along x", "Fx [N]", 1.5), (2, "torque", "τ [N m]", 0.03))
_LAST_PART = 0.2  # of the run: long after the last impact of any world, the mean is the balance of forces


def force_panel(key: str, runs: Mapping[str, Run], coordinate: int, title: str, label: str,
                shown: float | None = None) -> Panel:
    """Draw one device force over time; `shown` cuts the axis to plus and minus that value."""
    with styled() as new_figure:
        drawing = new_figure(figsize=PANEL, layout="constrained")
        axes = drawing.add_subplot()
        for number, (curve, run) in enumerate(runs.items()):
            force = run.device_force[:, coordinate]
            axes.plot(run.time[:-1], force, **line_arguments(STYLES[curve]), drawstyle="steps-post",
                      gid=curve_id(curve), markevery=marks(len(force), number), zorder=3 + number / 10)
        axes.set(xlabel="t [s]", ylabel=label, xlim=(0, max(run.time[-1] for run in runs.values())))
        if shown is not None:
            axes.set_ylim(-shown, shown)
        svg = traced_svg(drawing, f"{key}-{coordinate}{'m' if shown else ''}")
    magnified = f", magnified: cut at ±{shown:g} {label[label.index('[') + 1 : -1]}" if shown else ""
    return Panel(svg, f"{label} over time{magnified}, for {', '.join(runs)}.", title + magnified)


def force_panels(key: str, runs: Mapping[str, Run]) -> tuple[Panel, ...]:
    """Draw force along x and torque, each in full and magnified."""
    return tuple(
        force_panel(key, runs, coordinate, title, label, shown)
        for coordinate, title, label, cut in _FORCES for shown in (None, cut)
    )


def force_numbers(runs: Mapping[str, Run]) -> Numbers:
    """Return peaks, and the mean over the last part of the run, of each world."""
    columns = ("world", "peak |Fx| [N]", "peak |Fy| [N]", "peak |τ| [N m]", "held Fx [N]", "held Fy [N]",
               "held τ [N m]")
    return Numbers(columns, tuple((curve, *map(float, peak_force(run)), *map(float, held_force(run)))
                                  for curve, run in runs.items()), digits=3,
                   note="Held: mean over the last fifth of the run. The hand pushes with Fx = −0.32 N, Fy = 0.4 N, so "
                        "a world in balance holds 0.32 and −0.4 N.")


def held_force(run: Run) -> np.ndarray:
    """Return the mean device force over the last part of the run (d_t,)."""
    return run.device_force[-max(int(_LAST_PART * run.steps), 1):].mean(axis=0)

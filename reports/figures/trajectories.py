"""Panels of a trajectory figure: the path in the plane and each coordinate over time, device side.

The paper's frame has x to the left and y down (its drawing turned by 180 degrees), so both axes are reversed:
the corner is at the lower right, as in the paper's Figure 4.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from iapb.run import Run
from reports.figures.figure import Numbers, Panel
from reports.figures.measures import (
    deepest_penetration,
    distance_between,
    settling_time,
    tool_positions,
    widest_separation,
)
from reports.figures.style import PANEL, STYLES, line_arguments, styled
from reports.figures.traces import PATH, curve_id, traced_svg

MILLI, DEGREES = 1e3, 180.0 / np.pi
_COORDINATES = (("x", "mm", MILLI), ("y", "mm", MILLI), ("θ", "°", DEGREES))
_BEFORE_CONTACT = 0.05  # [s] of the approach that a path shows
_MARKS = 9  # markers along a curve: enough to tell it in grey, few enough to see the line


def marks(count: int, number: int) -> tuple[int, int]:
    """Return matplotlib's (first, every) so that curves that coincide show their markers side by side."""
    every = max(count // _MARKS, 1)
    return (number * every // 5) % every, every


def first_shown(runs: Mapping[str, Run]) -> int:
    """Return the step shortly before the first contact of any run: before it all paths are one straight line."""
    touching = [int(np.flatnonzero(np.diff(run.contacts.offsets))[0]) for run in runs.values() if len(run.contacts.gap)]
    dt = next(iter(runs.values())).dt
    return max(min(touching) - round(_BEFORE_CONTACT / dt), 0) if touching else 0


def path_panel(key: str, runs: Mapping[str, Run]) -> Panel:
    """Draw y against x of the device, from shortly before the first contact."""
    first = first_shown(runs)
    with styled() as new_figure:
        drawing = new_figure(figsize=PANEL, layout="constrained")
        axes = drawing.add_subplot()
        for number, (curve, run) in enumerate(runs.items()):
            x, y = MILLI * run.device_q[first:, :2].T
            axes.plot(x, y, **line_arguments(STYLES[curve]), gid=curve_id(curve),
                      markevery=marks(len(x), number), zorder=3 + number / 10)
        axes.set(xlabel="x [mm]", ylabel="y [mm]")
        axes.xaxis.set_inverted(True)
        axes.yaxis.set_inverted(True)
        svg = traced_svg(drawing, f"{key}-path", PATH)
    alt = f"Paths of the hand in the plane, in mm: {_ends(runs)}"
    return Panel(svg, alt, "path of the hand, from just before contact")


def time_panel(key: str, runs: Mapping[str, Run], coordinate: int) -> Panel:
    """Draw one device coordinate over time."""
    name, unit, factor = _COORDINATES[coordinate]
    with styled() as new_figure:
        drawing = new_figure(figsize=PANEL, layout="constrained")
        axes = drawing.add_subplot()
        for number, (curve, run) in enumerate(runs.items()):
            axes.plot(run.time, factor * run.device_q[:, coordinate], **line_arguments(STYLES[curve]),
                      gid=curve_id(curve), markevery=marks(len(run.time), number), zorder=3 + number / 10)
        axes.set(xlabel="t [s]", ylabel=f"{name} [{unit}]", xlim=(0, max(run.time[-1] for run in runs.values())))
        svg = traced_svg(drawing, f"{key}-{'xyz'[coordinate]}")
    return Panel(svg, f"{name} of the hand over time in {unit}, for {', '.join(runs)}.", f"{name} over time")


def separation_panel(key: str, runs: Mapping[str, Run]) -> Panel:
    """Draw the distance between tool and device over time."""
    with styled() as new_figure:
        drawing = new_figure(figsize=PANEL, layout="constrained")
        axes = drawing.add_subplot()
        for number, (curve, run) in enumerate(runs.items()):
            apart = MILLI * np.hypot(*(tool_positions(run)[:, :2] - run.device_q[:, :2]).T)
            axes.plot(run.time, apart, **line_arguments(STYLES[curve]), gid=curve_id(curve),
                      markevery=marks(len(apart), number))
        axes.set(xlabel="t [s]", ylabel="distance [mm]", xlim=(0, max(run.time[-1] for run in runs.values())))
        svg = traced_svg(drawing, f"{key}-apart")
    return Panel(svg, f"Distance between tool and device over time, for {', '.join(runs)}.",
                 "how far tool and device come apart")


def penetration_panel(key: str, runs: Mapping[str, Run]) -> Panel:
    """Draw the deepest penetration of the tool in each step."""
    with styled() as new_figure:
        drawing = new_figure(figsize=PANEL, layout="constrained")
        axes = drawing.add_subplot()
        for number, (curve, run) in enumerate(runs.items()):
            depth = MILLI * penetration_over_time(run)
            axes.plot(run.time[:-1], depth, **line_arguments(STYLES[curve]), gid=curve_id(curve),
                      markevery=marks(len(depth), number))
        axes.set(xlabel="t [s]", ylabel="penetration [mm]", xlim=(0, max(run.time[-1] for run in runs.values())))
        svg = traced_svg(drawing, f"{key}-depth")
    return Panel(svg, f"Penetration of the virtual peg over time, for {', '.join(runs)}.",
                 "how deep the virtual peg sinks in")


def penetration_over_time(run: Run) -> np.ndarray:
    """Return the deepest penetration of each step (n,) [m], 0 without contact."""
    depth = np.zeros(run.steps)
    steps = np.repeat(np.arange(run.steps), np.diff(run.contacts.offsets))
    np.maximum.at(depth, steps, -run.contacts.gap)
    return depth


def trajectory_panels(key: str, runs: Mapping[str, Run]) -> tuple[Panel, ...]:
    """Draw the path and the three coordinates."""
    return (path_panel(key, runs), *(time_panel(key, runs, coordinate) for coordinate in range(3)))


def trajectory_numbers(runs: Mapping[str, Run], reference: str | None = "ideal") -> Numbers:
    """Return the table under a trajectory figure; distances are from the curve `reference`, if there is one."""
    apart = ("from ideal x [mm]", "y [mm]", "θ [°]") if reference else ()
    columns = ("world", *apart, "penetration [mm]", "tool–device [mm]", "impacts", "settled at [s]")
    return Numbers(columns, tuple(_row(curve, runs, reference) for curve in runs), digits=3,
                   note=_FROM_IDEAL + _SETTLED if reference else _SETTLED)


_FROM_IDEAL = "Distances from the ideal trajectory are root mean squares over the whole run, on the device side. "
_SETTLED = "Settled: from then on slower than 1 mm/s and 10 mrad/s; a dash means not within the run."
_DIGITS = 9  # of millimetres: a picometre and less is rounding of the coordinates, not motion


def _row(curve: str, runs: Mapping[str, Run], reference: str | None) -> tuple[object, ...]:
    run = runs[curve]
    apart: tuple[object, ...] = ()
    if reference:
        distance = distance_between(run, runs[reference])
        apart = tuple(float(distance[k] * factor) for k, (_, _, factor) in enumerate(_COORDINATES))
    lengths = (deepest_penetration(run), float(np.hypot(*widest_separation(run)[:2])))
    return (curve, *apart, *(round(MILLI * length, _DIGITS) for length in lengths), len(run.impacts.step),
            settling_time(run))


def _ends(runs: Mapping[str, Run]) -> str:
    ends = {curve: MILLI * run.device_q[-1, :2] for curve, run in runs.items()}
    return "; ".join(f"{curve} ends at ({x:.1f}, {y:.1f})" for curve, (x, y) in ends.items()) + "."

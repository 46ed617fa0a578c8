"""The peg in the corner: Figures 7 to 13, in four worlds and with a limited or emulated device.

Each figure shows the path or the force of some runs, on the device side, and judges what the paper
says of it. The paper's frame has x to the left and y down (its drawing is turned by 180 degrees),
so both axes of a path are reversed: the corner is at the lower right, as in the paper's Figure 4.
Lengths are in metres and angles in radians, unless a name says otherwise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from iapb.run import Run
from reports.figures.figure import Drawn, Panel, Recipe, recipe
from reports.figures.plot import Plot, note
from reports.figures.style import MUTED, STYLES, line_arguments
from verification.scenes import measures
from verification.scenes.measures import Trace
from verification.table import titled

Traces = Mapping[str, Trace]
Measured = Mapping[str, Mapping[str, Any]]

# The runs, by the name that the paper gives their curve, which is also its style; right: the name
# among the inputs.
UNLIMITED = {
    "ideal": "corner/ideal",
    "IAPB": "corner/IAPB",
    "PB": "corner/PB",
    "CBuc": "corner/CBuc",
}
LIMITED = {
    "ideal": "corner/ideal",
    "IAPB LM": "corner/IAPB-spread",
    "PB": "corner/PB",
    "CBuc": "corner/CBuc",
}
STRATEGIES = {
    "ideal": "corner/ideal",
    "pfull": "corner/IAPB",
    "pspread": "corner/IAPB-spread",
    "pscaled": "corner/IAPB-scale",
    "psaturated": "corner/IAPB-saturate",
}
DEVICE = {"IAPB": "device/IAPB", "IAPB LM": "device/IAPB-LM", "PB": "device/PB"}

MILLI = 1e3
DEGREES = 180.0 / np.pi
_COORDINATES = (("x", "mm", MILLI), ("y", "mm", MILLI), ("θ", "°", DEGREES))
_FORCES = (("Fx", "N"), ("Fy", "N"), ("torque", "N m"))
_BEFORE_CONTACT = 0.05  # [s] of the approach that a path shows
# [s] before and after the first contact: the impulses of all worlds, separately visible
_LEAD = 0.01
_TAIL = 0.14
# of the run: long after the last impact of any world, the mean is the balance of forces
_LAST_PART = 0.2
_MARKS = 9  # markers along a curve: enough to identify it in grey print, few enough to see the line
# a pulse has no counterpart if none of this share of it is within so many steps around it
_NEAR = 11
_SMALL = 0.1
_LARGE = 10.0  # times the force that is held: a pulse
_BALANCED = 0.01  # share of the hand's force
_DIGITS = 9  # of millimetres: a picometre and less is rounding of the coordinates, not motion

_TIME = "t [s]"
_DISTANCES = {"x": "x from ideal [mm]", "y": "y from ideal [mm]", "angle": "θ from ideal [°]"}
_DEVICE = {"settled": "at rest after [s]", "bounces": "bounces", "depth": "sinks in [mm]"}
_PEAKS = {"Fx": "largest |Fx| [N]", "Fy": "largest |Fy| [N]", "torque": "largest |τ| [N m]"}
_REST = {"depth": "sinks in [mm]", "apart": "tool and device apart [mm]", "impacts": "impacts"}


def _figure(
    number: int,
    runs: Mapping[str, str],
    forces: bool,
    shown: Mapping[str, str],
    same: Callable[[Measured], Mapping[str, bool]],
) -> Recipe:
    """Return the recipe of a figure of the paper with the paths or forces of some runs."""
    key = f"fig{number:02d}"
    # one window for all figures of the corner, so that a run has the same distances in each
    every = {**runs, **UNLIMITED, **STRATEGIES} if "ideal" in runs else dict(runs)

    def draw(*given: Run) -> Drawn:
        named = dict(zip(every, given, strict=True))
        traces = {curve: measures.trace_of(run) for curve, run in named.items()}
        window = measures.comparison_window([*traces.values()])
        traces = {curve: traces[curve] for curve in runs}
        measured = {
            curve: measured_of(named[curve], trace, traces.get("ideal"), window)
            for curve, trace in traces.items()
        }
        drawing = _forces if forces else _paths
        panels = drawing(key, traces, window)
        columns = {**shown, **(_REST if shown is _DISTANCES else {})}
        rows = [(curve, *(each[name] for name in columns)) for curve, each in measured.items()]
        return Drawn(
            panels,
            titled(("world", *columns.values()), rows, digits=3),
            {curve: STYLES[curve] for curve in runs},
            measured,
            same(measured),
            tuple(shown.values()),
        )

    return recipe(key, *every.values())(draw)


def measured_of(run: Run, trace: Trace, ideal: Trace | None, window: slice) -> dict[str, Any]:
    """Return the numbers of one curve by name: [mm], [°], [s], [N] and [N m]."""
    force = trace.device_force
    state = measures.settled_at(trace)
    held = force[-max(int(_LAST_PART * len(force)), 1) :].mean(axis=0)
    hand = trace.hand_force[-1]
    found: dict[str, Any] = {
        "depth": round(MILLI * measures.deepest_penetration(trace), _DIGITS),
        "apart": round(MILLI * float(np.hypot(*measures.largest_separation(trace)[:2])), _DIGITS),
        "impacts": len(trace.impact_step),
        "bounces": measures.bounces(trace),
        "settled": float(trace.time[state]) if state < len(trace.time) else None,
        "rests": f"{trace.time[state]:.2f}" if state < len(trace.time) else "not in this run",
        "held": float(np.abs(held[:2]).max()),
        "balanced": bool(np.hypot(*(held + hand)[:2]) <= _BALANCED * np.hypot(*hand[:2])),
    }
    peaks = measures.peak_force(trace).tolist()
    found |= {name: peak for (name, _), peak in zip(_FORCES, peaks, strict=True)}
    if ideal is not None:
        x, y, angle = measures.root_mean_square(trace, ideal, window).tolist()
        found |= {
            "x": MILLI * x,
            "y": MILLI * y,
            "angle": DEGREES * angle,
            "distance": MILLI * float(np.hypot(x, y)),
            "lone torque": lone_torque(trace, ideal),
        }
        found["pull"] = -float(run.contacts.impulse.min(initial=0.0))
    return found


def lone_torque(trace: Trace, ideal: Trace) -> float:
    """Return the largest torque of a run [N m] in a step around which ideal has none."""
    from scipy.ndimage import maximum_filter1d

    ours, theirs = (np.abs(each.device_force[:, 2]) for each in (trace, ideal))
    alone = maximum_filter1d(theirs, _NEAR) < _SMALL * ours
    return float(np.where(alone, ours, 0.0).max())


# What the paper says of each figure, and whether our numbers say the same


def _nearer(m: Measured, curve: str) -> dict[str, bool]:
    return {
        f"nearer than {other}": m[curve]["distance"] < m[other]["distance"]
        for other in ("PB", "CBuc")
    }


def _same_7(m: Measured) -> dict[str, bool]:
    return _nearer(m, "IAPB")


def _same_8(m: Measured) -> dict[str, bool]:
    ours = m["IAPB"]
    ideal = m["ideal"]
    return {
        "large at a new contact": all(each["Fx"] > _LARGE * each["held"] for each in (ours, ideal)),
        "then balances the hand": ours["balanced"],
        "nearest to ideal": all(
            abs(ours[name] - ideal[name]) < abs(m[other][name] - ideal[name])
            for name, _ in _FORCES
            for other in ("PB", "CBuc")
        ),
        "no torque that ideal lacks": ours["lone torque"] <= _SMALL * ours["torque"],
    }


def _same_9(m: Measured) -> dict[str, bool]:
    lost = {name: m[name]["distance"] for name in ("pspread", "pscaled", "psaturated")}
    return {
        "clipping loses most": max(lost, key=lost.__getitem__) == "psaturated",
        "spreading loses least": min(lost, key=lost.__getitem__) == "pspread",
    }


def _same_10(m: Measured) -> dict[str, bool]:
    return _nearer(m, "IAPB LM") | {"sinks in less": m["IAPB LM"]["depth"] < m["PB"]["depth"]}


def _harder(m: Measured, *curves: str) -> dict[str, bool]:
    return {
        f"{curve} harder than PB": all(m[curve][name] > m["PB"][name] for name, _ in _FORCES)
        for curve in curves
    }


def _same_11(m: Measured) -> dict[str, bool]:
    return _harder(m, "IAPB LM")


def _same_12(m: Measured) -> dict[str, bool]:
    impulses = ("IAPB", "IAPB LM")
    springs = m["PB"]
    rest = {
        curve: np.inf if each["settled"] is None else each["settled"] for curve, each in m.items()
    }
    return {
        "sooner at rest": all(rest[curve] < rest["PB"] for curve in impulses),
        "fewer bounces": all(m[curve]["bounces"] < springs["bounces"] for curve in impulses),
    }


def _same_13(m: Measured) -> dict[str, bool]:
    return _harder(m, "IAPB", "IAPB LM")


# The drawings


def _paths(key: str, traces: Traces, window: slice) -> list[Panel]:
    """Draw y against x of the device, from shortly before the first contact, and each coordinate
    from then on until all worlds rest."""
    approach = slice(_before(_BEFORE_CONTACT, traces, window), None)
    paths = {curve: MILLI * trace.device[approach, :2].T for curve, trace in traces.items()}
    label = "path of the hand, from just before contact"
    panels = [_panel(f"{key}-path", paths, "x [mm]", "y [mm]", label)]
    for k, (name, unit, factor) in enumerate(_COORDINATES):
        curves = {
            curve: (trace.time[window], factor * trace.device[window, k])
            for curve, trace in traces.items()
        }
        label = f"{name}, from the first contact until all rest"
        panels.append(_panel(f"{key}-{k}", curves, _TIME, f"{name} [{unit}]", label))
    return panels


def _forces(key: str, traces: Traces, window: slice) -> list[Panel]:
    """Draw the forces along x and y at the first contact."""
    shown = slice(_before(_LEAD, traces, window), _before(-_TAIL, traces, window))
    panels = []
    for k, (name, unit) in enumerate(_FORCES[:2]):
        curves = {
            curve: (trace.time[shown], trace.device_force[shown, k])
            for curve, trace in traces.items()
        }
        label = f"{name}, {_LEAD + _TAIL:.2g} s around the first contact"
        axis = f"{name} [{unit}]"
        panels.append(_panel(f"{key}-{k}", curves, _TIME, axis, label, drawstyle="steps-post"))
    return panels


def _before(seconds: float, traces: Traces, window: slice) -> int:
    """Return the state at a time before the window begins."""
    dt = next(iter(traces.values())).dt
    return max(window.start - round(seconds / dt), 0)


def _panel(key: str, curves: Mapping[str, Any], x: str, y: str, label: str, **how: Any) -> Panel:
    """Draw the curves (x, y) by name; where curves coincide, their markers stand side by side."""
    with Plot(key) as plot:
        for number, (curve, points) in enumerate(curves.items()):
            every = max(len(points[0]) // _MARKS, 1)
            first = (number * every // 5) % every
            look = line_arguments(STYLES[curve]) | how
            plot.axes.plot(*points, **look, markevery=(first, every), zorder=3 + number / 10)
        plot.axes.set(xlabel=x, ylabel=y)
        if x == _TIME:
            plot.axes.margins(x=0.0)
        else:
            plot.axes.invert_xaxis()
            plot.axes.invert_yaxis()
            start = next(iter(curves.values()))[:, 0]
            note(plot.axes, start, "start", (0, 8), fontsize=8, color=MUTED)
    return Panel(plot.svg, f"{y} over {x}: {', '.join(curves)}.", label)


_figure(7, UNLIMITED, False, _DISTANCES, _same_7)
_figure(8, UNLIMITED, True, _PEAKS, _same_8)
_figure(9, STRATEGIES, False, _DISTANCES, _same_9)
_figure(10, LIMITED, False, _DISTANCES, _same_10)
_figure(11, LIMITED, True, _PEAKS, _same_11)
_figure(12, DEVICE, False, _DEVICE, _same_12)
_figure(13, DEVICE, True, _PEAKS, _same_13)

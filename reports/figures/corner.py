"""The peg in the corner: Figures 7 to 13, in four worlds and with a limited or emulated device.

Each figure shows trajectories or forces of some runs, on the device side. The paper's frame has x
to the left and y down (its drawing is turned by 180 degrees), so both axes of a path are reversed:
the corner is at the lower right, as in the paper's Figure 4. Lengths are in metres and angles in
radians, unless a name says otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.run import Run
from reports.figures.figure import Drawn, Panel, Recipe, recipe
from reports.figures.plot import PATH, TIME, Plot, note
from reports.figures.style import MUTED, STYLES, line_arguments
from verification.scenes import measures
from verification.scenes.measures import Trace
from verification.table import titled

Floats = NDArray[np.float64]

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
    "psaturated": "corner/IAPB-saturate",
    "pscaled": "corner/IAPB-scale",
    "pspread": "corner/IAPB-spread",
}
DEVICE = {"IAPB": "device/IAPB", "IAPB LM": "device/IAPB-LM", "PB": "device/PB"}

MILLI, DEGREES = 1e3, 180.0 / np.pi
_COORDINATES = (("x", "mm", MILLI), ("y", "mm", MILLI), ("θ", "°", DEGREES))
_BEFORE_CONTACT = 0.05  # [s] of the approach that a path shows
_AT_CONTACT = (
    -0.01,
    0.14,
)  # [s] from the first contact: the impulses of all worlds, separately visible
_LIMITED = ("fig09", "fig10")  # figures of trajectories with a limited device
_LAST_PART = (
    0.2  # of the run: long after the last impact of any world, the mean is the balance of forces
)
_MARKS = 9  # markers along a curve: enough to identify it in grey print, few enough to see the line
# share of the largest distance between curves at which they are seen to part, and to stay at rest
_APART = 0.05
_LEAD = 5  # steps before the curves part that are shown
_NEAR, _SMALL = (
    11,
    0.1,
)  # a pulse has no counterpart if none of this share of it is within so many steps around it
# Forces that are drawn: coordinate, title, name, unit, and the range between the impulses
_DRAWN = ((0, "force along x", "Fx", "N", (-0.4, 1.5)), (2, "torque", "τ", "N m", (-0.03, 0.03)))
# What is measured, and its column in the tables
_DISTANCES = {"x": "distance from ideal: x [mm]", "y": "y [mm]", "angle": "θ [°]"}
_MOTION = {
    "depth": "penetration [mm]",
    "apart": "largest distance of tool and device [mm]",
    "impacts": "impacts",
    "settled": "settled at [s]",
}
_FORCES = {
    "Fx": "peak |Fx| [N]",
    "Fy": "peak |Fy| [N]",
    "torque": "peak |τ| [N m]",
    "held Fx": "held Fx [N]",
    "held Fy": "held Fy [N]",
    "held torque": "held τ [N m]",
}
_FROM_IDEAL = (
    "Distances from the ideal path of the hand are root mean squares from the first contact until "
    "all "
    "worlds of the figure settle or the run ends. "
)
_SETTLED = (
    "Settled: from then on slower than 1 mm/s and 10 mrad/s; a dash means not within the run."
)
_HELD = (
    "Held: mean over the last fifth of the run. The hand pushes with Fx = −0.32 N, Fy = 0.4 N, so "
    "a world in "
    "balance holds 0.32 and −0.4 N."
)
_DIGITS = 9  # of millimetres: a picometre and less is rounding of the coordinates, not motion

Traces = Mapping[str, Trace]


def _recipe(number: int, runs: Mapping[str, str], forces: bool) -> Recipe:
    """Return the recipe of a figure of the paper with trajectories or forces of some runs."""
    key = f"fig{number:02d}"

    def draw(*given: Run) -> Drawn:
        named = dict(zip(runs, given, strict=True))
        traces = {curve: measures.trace_of(run) for curve, run in named.items()}
        window = measures.comparison_window([*traces.values()])
        measured = {
            curve: _measured(trace, traces.get("ideal"), window) for curve, trace in traces.items()
        }
        told: dict[str, Any] = {
            **measured,
            "tilt": DEGREES * next(iter(traces.values())).device[0, 2],
            "damping": (given[0].scene_resolved["device"]["damping"] or [0.0])[0],
        }
        panels, shown, note = (
            (_forces(key, traces), _FORCES, _HELD)
            if forces
            else (_trajectories(key, named, traces), _MOTION, _SETTLED)
        )
        if forces and "ideal" in runs:
            told["lone"] = _lone_pulse(
                *next((named[curve], traces[curve]) for curve in named if "IAPB" in curve),
                traces["ideal"],
            )
        elif "ideal" in runs:
            shown, note = _DISTANCES | shown, _FROM_IDEAL + note
            told |= {
                name: ", ".join(
                    sorted(measured.keys() - {"ideal"}, key=lambda curve: measured[curve][name])
                )
                for name in ("distance", "angle")
            }
        rows = tuple((curve, *(each[name] for name in shown)) for curve, each in measured.items())
        return Drawn(
            panels,
            titled(("world", *shown.values()), rows, digits=3, note=note),
            {curve: STYLES[curve] for curve in runs},
            told,
        )

    return recipe(key, *runs.values())(draw)


def _measured(trace: Trace, ideal: Trace | None, window: slice) -> dict[str, Any]:
    """Return the numbers of one curve, by the names that tables and texts use: [mm], [°], [s], [N]
    and [N m]."""
    force, state, peaks = trace.device_force, measures.settled_at(trace), measures.peak_force(trace)
    held = force[-max(int(_LAST_PART * len(force)), 1) :].mean(axis=0)
    settled = float(trace.time[state]) if state < len(trace.time) else None
    pulse = [f"{each:.1f}" for each in np.abs(force[:, 0]) if each > _SMALL * peaks[0]]
    found = {
        "depth": round(MILLI * measures.deepest_penetration(trace), _DIGITS),
        "apart": round(MILLI * float(np.hypot(*measures.largest_separation(trace)[:2])), _DIGITS),
        "impacts": len(trace.impact_step),
        "bounces": measures.bounces(trace),
        "settled": settled,
        "rests": "never in the run" if settled is None else f"at {settled:.2f} s",
        "steps": len(pulse),
        "pulse": " and ".join(pulse),
        **dict(zip(_FORCES, (*peaks.tolist(), *held.tolist()), strict=True)),
    }
    if ideal is not None:
        x, y, angle = measures.root_mean_square(trace, ideal, window).tolist()
        past = np.abs(trace.device[-1] - ideal.device[-1])
        found |= {
            "x": MILLI * x,
            "y": MILLI * y,
            "angle": DEGREES * angle,
            "distance": MILLI * np.hypot(x, y),
            "past x": MILLI * past[0],
            "past y": MILLI * past[1],
        }
    return found


def _lone_pulse(run: Run, trace: Trace, ideal: Trace) -> dict[str, float]:
    """Return the largest torque of a run [N m] in a step around which ideal has none, its time, and
    its strongest pull.

    A pull is an impulse [N s] against the normal of its contact.
    """
    from scipy.ndimage import maximum_filter1d

    ours, theirs = (np.abs(each.device_force[:, 2]) for each in (trace, ideal))
    step = int(np.argmax(np.where(maximum_filter1d(theirs, _NEAR) < _SMALL * ours, ours, 0.0)))
    impulses = run.contacts.impulse[slice(*run.contacts.offsets[step : step + 2])]
    return {"torque": ours[step], "time": run.time[step], "pull": -impulses.min(initial=0.0)}


def _marks(count: int, number: int) -> tuple[int, int]:
    """Return matplotlib's `markevery` (first, every), with which coinciding curves show their
    markers side by side."""
    every = max(count // _MARKS, 1)
    return (number * every // 5) % every, every


def _first_shown(runs: Mapping[str, Run]) -> int:
    """Return the first step of the paths; up to the first contact of any run all paths are the same
    line."""
    touching = [
        int(np.flatnonzero(np.diff(run.contacts.offsets))[0])
        for run in runs.values()
        if len(run.contacts.gap)
    ]
    return (
        max(min(touching) - round(_BEFORE_CONTACT / next(iter(runs.values())).dt), 0)
        if touching
        else 0
    )


def _trajectories(key: str, runs: Mapping[str, Run], traces: Traces) -> list[Panel]:
    """Draw the path and, from where the curves differ, the three coordinates and the distances from
    ideal.

    If a device is limited, also draw how far tool and device come apart, and the penetration.
    """

    def over(suffix: str, values: Mapping[str, Floats], axis: str, label: str) -> Panel:
        return _over_time(
            f"{key}-{suffix}", traces, values, axis, label, *_seen_apart([*values.values()])
        )

    ends = "; ".join(
        "{} ends at ({:.1f}, {:.1f})".format(curve, *(MILLI * trace.device[-1, :2]))
        for curve, trace in traces.items()
    )
    panels = [
        Panel(
            _path(f"{key}-path", runs),
            f"Paths of the hand in the plane, in mm: {ends}.",
            "path of the hand, from just before contact",
        )
    ]
    for k, (name, unit, factor) in enumerate(_COORDINATES):
        values = {curve: factor * trace.device[:, k] for curve, trace in traces.items()}
        panels.append(over("xyz"[k], values, f"{name} [{unit}]", f"{name}, from where they differ"))
    if "ideal" in traces:
        off = {
            curve: trace.device - traces["ideal"].device
            for curve, trace in traces.items()
            if curve != "ideal"
        }
        panels += [
            over(
                "off-position",
                {curve: MILLI * np.hypot(*path[:, :2].T) for curve, path in off.items()},
                "distance from ideal [mm]",
                "distance from ideal, position",
            ),
            over(
                "off-angle",
                {curve: DEGREES * np.abs(path[:, 2]) for curve, path in off.items()},
                "angle from ideal [°]",
                "distance from ideal, angle",
            ),
        ]
    if key in _LIMITED:
        apart = {
            curve: MILLI * np.hypot(*(trace.tool - trace.device)[:, :2].T)
            for curve, trace in traces.items()
        }
        depths = {curve: MILLI * trace.penetration for curve, trace in traces.items()}
        panels += [
            over("apart", apart, "distance [mm]", "how far tool and device come apart"),
            over("depth", depths, "penetration [mm]", "how deep the virtual peg sinks in"),
        ]
    return panels


def _seen_apart(values: Sequence[Floats]) -> tuple[int, int]:
    """Return the steps just before the curves part, and when all are at rest."""
    every = np.array(values)
    spread = np.ptp(every, axis=0)
    seen = _APART * spread.max()
    parted = int(np.argmax(spread > seen))
    rest = np.flatnonzero((np.abs(every - every[:, -1:]) > seen).any(axis=0)).max(initial=parted)
    return max(parted - _LEAD, 0), int(rest) + int(rest - parted) // 10 + 2


def _path(key: str, runs: Mapping[str, Run]) -> str:
    """Draw y against x of the device, from shortly before the first contact."""
    with Plot(key, kind=PATH) as plot:
        for number, (curve, run) in enumerate(runs.items()):
            x, y = MILLI * run.device_q[_first_shown(runs) :, :2].T
            plot.axes.plot(
                x,
                y,
                **line_arguments(STYLES[curve]),
                markevery=_marks(len(x), number),
                zorder=3 + number / 10,
            )
        plot.axes.set(xlabel="x [mm]", ylabel="y [mm]")
        plot.axes.xaxis.set_inverted(True)
        plot.axes.yaxis.set_inverted(True)
        note(plot.axes, (x[0], y[0]), "start", (0, 8), fontsize=8, color=MUTED)
    return plot.svg


def _over_time(
    key: str,
    traces: Traces,
    values: Mapping[str, Floats],
    axis: str,
    label: str,
    first: int,
    last: int,
    height: tuple[float, float] | None = None,
    **how: Any,
) -> Panel:
    """Draw a quantity of each run over time, from step `first` to step `last`; `height` limits the
    vertical axis."""
    time = next(iter(traces.values())).time[first:last]
    with Plot(key, kind=TIME) as plot:
        for number, (curve, whole) in enumerate(values.items()):
            shown = whole[first:last]
            plot.axes.plot(
                time[: len(shown)],
                shown,
                **line_arguments(STYLES[curve]),
                **how,
                markevery=_marks(len(shown), number),
                zorder=3 + number / 10,
            )
        plot.axes.set(xlabel="t [s]", ylabel=axis, xlim=time[[0, -1]], ylim=height)
    ranges = ", ".join(
        f"{curve} {min(each):.3g} to {max(each):.3g}" for curve, each in values.items()
    )
    return Panel(plot.svg, f"{axis} over time, in the whole run: {ranges}.", label)


def _forces(key: str, traces: Traces) -> list[Panel]:
    """Draw force along x and torque at the first contact, and magnified around the holding force.

    The force of an impact in one step is hundreds of times the holding force afterwards.
    """
    window, panels = measures.comparison_window([*traces.values()]), list[Panel]()
    start, *ends = (
        window.start + round(seconds / next(iter(traces.values())).dt) for seconds in _AT_CONTACT
    )
    for k, title, name, unit, cut in _DRAWN:
        values = {curve: trace.device_force[:, k] for curve, trace in traces.items()}
        for suffix, view, last, height in (
            ("c", f"{np.ptp(_AT_CONTACT):.2g} s around first contact", ends[0], None),
            ("m", "until all worlds rest, pulses cut off", window.stop, cut),
        ):
            panels.append(
                _over_time(
                    f"{key}-{k}{suffix}",
                    traces,
                    values,
                    f"{name} [{unit}]",
                    f"{title}, {view}",
                    max(start, 0),
                    last,
                    height,
                    drawstyle="steps-post",
                )
            )
    return panels


RECIPES = tuple(
    _recipe(number, runs, forces)
    for number, runs, forces in (
        (7, UNLIMITED, False),
        (8, UNLIMITED, True),
        (9, STRATEGIES, False),
        (10, LIMITED, False),
        (11, LIMITED, True),
        (12, DEVICE, False),
        (13, DEVICE, True),
    )
)

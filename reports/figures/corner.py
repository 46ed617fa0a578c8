"""The peg in the corner: the first picture, and Figures 7 to 13, in four worlds and with a limited or emulated device.

Each figure shows trajectories or forces of some runs, on the device side. The paper's frame has x to the left and y
down (its drawing is turned by 180 degrees), so both axes of a path are reversed: the corner is at the lower right, as
in the paper's Figure 4. Lengths are in metres and angles in radians, unless a name says otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.run import Run
from reports.figures.figure import Drawn, Panel, Recipe, recipe
from reports.figures.geometry import body_outlines
from reports.figures.labels import arrow_of_time
from reports.figures.plot import PATH, TIME, Canvas, Plot
from reports.figures.style import MUTED, PANEL, STYLES, line_arguments
from verification.table import Table, titled

Floats = NDArray[np.float64]

# The runs, by the name that the paper gives their curve, which is also its style; right: the name among the inputs.
UNLIMITED = {"ideal": "corner/ideal", "IAPB": "corner/IAPB", "PB": "corner/PB", "CBuc": "corner/CBuc"}
LIMITED = {**UNLIMITED, "IAPB": "corner/IAPB-spread"}
STRATEGIES = {
    "ideal": "corner/ideal", "pfull": "corner/IAPB", "psaturated": "corner/IAPB-saturate",
    "pscaled": "corner/IAPB-scale", "pspread": "corner/IAPB-spread",
}
DEVICE = {"IAPB": "device/IAPB", "IAPB LM": "device/IAPB-LM", "PB": "device/PB"}

MILLI, DEGREES = 1e3, 180.0 / np.pi
_COORDINATES = (("x", "mm", MILLI), ("y", "mm", MILLI), ("θ", "°", DEGREES))
_BEFORE_CONTACT = 0.05  # [s] of the approach that a path shows
_AT_CONTACT = (0.01, 0.14)  # [s] before and after the first contact: the impulses of all worlds, separately visible
_LAST_PART = 0.2  # of the run: long after the last impact of any world, the mean is the balance of forces
_MARKS = 9  # markers along a curve: enough to identify it in grey print, few enough to see the line
_PRINTED_RANGE = (-2.5, 0.05)  # ticks of Figure 7 that the paper's text keeps; a line of room for curves at 0
# A peg slower than this (and turning slower than this) counts as settled: a tenth of its speed at contact, where
# the eye no longer sees it move [m/s], [rad/s].
SETTLED_SPEED = np.array([1e-3, 1e-3, 1e-2])
_FROM_IDEAL = "Distances from the ideal trajectory are root mean squares over the whole run, on the device side. "
_SETTLED = "Settled: from then on slower than 1 mm/s and 10 mrad/s; a dash means not within the run."
_HELD = ("Held: mean over the last fifth of the run. The hand pushes with Fx = −0.32 N, Fy = 0.4 N, so a world in "
         "balance holds 0.32 and −0.4 N.")  # fmt: skip
_DIGITS = 9  # of millimetres: a picometre and less is rounding of the coordinates, not motion


def _recipe(number: int, runs: Mapping[str, str], forces: bool) -> Recipe:
    """Return the recipe of a figure of the paper with trajectories or forces of some runs."""
    key = f"fig{number:02d}"

    def draw(*given: Run) -> Drawn:
        named = dict(zip(runs, given, strict=True))
        panels, numbers = _forces(key, named) if forces else _trajectories(key, named, runs)
        return Drawn(panels, numbers, {curve: STYLES[curve] for curve in runs})

    return recipe(key, *runs.values())(draw)


def _marks(count: int, number: int) -> tuple[int, int]:
    """Return matplotlib's `markevery` (first, every), with which coinciding curves show their markers side by side."""
    every = max(count // _MARKS, 1)
    return (number * every // 5) % every, every


def _first_shown(runs: Mapping[str, Run], before: float) -> int:
    """Return the step `before` [s] the first contact of any run; up to that contact all paths are the same line."""
    touching = [int(np.flatnonzero(np.diff(run.contacts.offsets))[0]) for run in runs.values() if len(run.contacts.gap)]
    return max(min(touching) - round(before / next(iter(runs.values())).dt), 0) if touching else 0


def _trajectories(key: str, runs: Mapping[str, Run], names: Mapping[str, str]) -> tuple[list[Panel], Table]:
    """Draw the path and the three coordinates; for limited devices, also tool against device and penetration."""
    over = partial(_over_time, key, runs)
    ends = "; ".join("{} ends at ({:.1f}, {:.1f})".format(curve, *(MILLI * run.device_q[-1, :2]))
                     for curve, run in runs.items())  # fmt: skip
    panels = [Panel(_path(f"{key}-path", runs), f"Paths of the hand in the plane, in mm: {ends}.",
                    "path of the hand, from just before contact")]  # fmt: skip
    for k, (name, unit, factor) in enumerate(_COORDINATES):
        values = {curve: factor * run.device_q[:, k] for curve, run in runs.items()}
        panels.append(over("xyz"[k], values, f"{name} [{unit}]", f"{name} over time"))
    if "ideal" in runs:
        ideal = runs["ideal"].device_q
        off = {curve: _apart(run.device_q, ideal) for curve, run in runs.items() if curve != "ideal"}
        panels += [over("off-position", {curve: MILLI * np.hypot(*path[:, :2].T) for curve, path in off.items()},
                        "distance from ideal [mm]", "deviation from ideal, position"),
                   over("off-angle", {curve: DEGREES * np.abs(path[:, 2]) for curve, path in off.items()},
                        "angle from ideal [°]", "deviation from ideal, angle")]  # fmt: skip
    if names == UNLIMITED:  # beyond the final position in the ideal world, on the axis of the printed Figure 7
        values = {curve: MILLI * (runs["ideal"].device_q[-1, 1] - run.device_q[:, 1]) for curve, run in runs.items()}
        panels.append(over("printed", values, "past the rigid place [mm]",
                           "depth along y past the rigid place, on the printed range", height=_PRINTED_RANGE))
    if names in (LIMITED, STRATEGIES):
        apart = {curve: MILLI * np.hypot(*(tool_positions(run)[:, :2] - run.device_q[:, :2]).T)
                 for curve, run in runs.items()}  # fmt: skip
        depths = {curve: MILLI * penetration_over_time(run) for curve, run in runs.items()}
        panels += [over("apart", apart, "distance [mm]", "how far tool and device come apart"),
                   over("depth", depths, "penetration [mm]", "how deep the virtual peg sinks in")]
    reference = "ideal" if "ideal" in runs else None
    distances = ("distance from ideal: x [mm]", "y [mm]", "θ [°]") if reference else ()
    columns = ("world", *distances, "penetration [mm]", "tool–device [mm]", "impacts", "settled at [s]")
    note = _FROM_IDEAL + _SETTLED if reference else _SETTLED
    return panels, titled(columns, tuple(_row(curve, runs, reference) for curve in runs), digits=3, note=note)


def _apart(path: Floats, other: Floats) -> Floats:
    """Return the difference of two paths over the time of the shorter one."""
    return path[: len(other)] - other[: len(path)]


def _path(key: str, runs: Mapping[str, Run], size: tuple[float, float] = PANEL, *, equal: bool = False) -> str:
    """Draw y against x of the device, from shortly before the first contact."""
    with Plot(key, size, kind="" if equal else PATH) as plot:
        for number, (curve, run) in enumerate(runs.items()):
            x, y = MILLI * run.device_q[_first_shown(runs, _BEFORE_CONTACT) :, :2].T
            plot.axes.plot(x, y, **line_arguments(STYLES[curve]), markevery=_marks(len(x), number),
                           zorder=3 + number / 10)
        plot.axes.set(xlabel="x [mm]", ylabel="y [mm]")
        if equal:
            plot.axes.set_aspect("equal", adjustable="datalim")
        plot.axes.xaxis.set_inverted(True)
        plot.axes.yaxis.set_inverted(True)
        arrow_of_time(plot.axes)
    return plot.svg


def _over_time(key: str, runs: Mapping[str, Run], suffix: str, values: Mapping[str, Floats], axis: str, label: str, *,
               height: tuple[float, float] | None = None, first: int = 0, last: int | None = None,
               **how: Any) -> Panel:  # fmt: skip
    """Draw a quantity of each run over time, from step `first` to step `last`; `height` limits the vertical axis."""
    with Plot(f"{key}-{suffix}", kind=TIME) as plot:
        for number, (curve, whole) in enumerate(values.items()):
            shown, run = whole[first:last], runs[curve]
            plot.axes.plot(run.time[first : first + len(shown)], shown, **line_arguments(STYLES[curve]), **how,
                           markevery=_marks(len(shown), number), zorder=3 + number / 10)
        longest = max((runs[curve] for curve in values), key=lambda run: run.steps)
        plot.axes.set(xlabel="t [s]", ylabel=axis, xlim=(longest.time[first], longest.time[: last][-1]), ylim=height)
    ranges = ", ".join(f"{curve} {min(each):.3g} to {max(each):.3g}" for curve, each in values.items())
    return Panel(plot.svg, f"{axis} over time, in the whole run: {ranges}.", label)


def tool_positions(run: Run) -> Floats:
    """Return the tool's coordinates (n + 1, d_t); its joints must have as many velocities as coordinates."""
    return run.q[:, slice(*run.tool_coordinates)]


def penetration_over_time(run: Run) -> Floats:
    """Return the deepest penetration of each step (n,) [m], 0 without contact."""
    depth = np.zeros(run.steps)
    steps = np.repeat(np.arange(run.steps), np.diff(run.contacts.offsets))
    np.maximum.at(depth, steps, -run.contacts.gap)
    return depth


def settling_time(run: Run) -> float | None:
    """Return the time [s] from which the device stays slower than SETTLED_SPEED; None if it moves until the end."""
    moving = np.flatnonzero(np.any(np.abs(run.device_v) > SETTLED_SPEED[: run.device_v.shape[1]], axis=1))
    if not len(moving):
        return 0.0
    return None if moving[-1] == len(run.time) - 1 else float(run.time[moving[-1] + 1])


def _row(curve: str, runs: Mapping[str, Run], reference: str | None) -> tuple[object, ...]:
    run = runs[curve]
    apart: tuple[float, ...] = ()
    if reference:  # root mean square over the whole run
        off = np.sqrt(np.mean(_apart(run.device_q, runs[reference].device_q) ** 2, axis=0))
        apart = tuple(float(off[k] * factor) for k, (_, _, factor) in enumerate(_COORDINATES))
    widest = np.max(np.abs(tool_positions(run) - run.device_q), axis=0)
    lengths = (float(penetration_over_time(run).max(initial=0.0)), float(np.hypot(*widest[:2])))
    return (curve, *apart, *(round(MILLI * length, _DIGITS) for length in lengths), len(run.impacts.step),
            settling_time(run))


def _forces(key: str, runs: Mapping[str, Run]) -> tuple[list[Panel], Table]:
    """Draw force along x and torque at the first contact, over the whole run, and magnified around the holding force.

    The force of an impact in one step is hundreds of times the holding force afterwards. The table has the peak forces
    and the forces held at the end.
    """
    start, span = _first_shown(runs, _AT_CONTACT[0]), sum(_AT_CONTACT)
    contact = {"first": start, "last": start + round(span / next(iter(runs.values())).dt)}
    panels = []
    for k, title, name, unit, cut in ((0, "force along x", "Fx", "N", 1.5), (2, "torque", "τ", "N m", 0.03)):
        views: dict[str, dict[str, Any]] = {
            f"at the first contact: {span:g} s": contact, "the whole run": {},
            f"between impulses: cut at ±{cut:g} {unit}": {"height": (-cut, cut)},
        }  # fmt: skip
        values = {curve: run.device_force[:, k] for curve, run in runs.items()}
        for letter, (view, shown) in zip("cam", views.items(), strict=True):
            panels.append(_over_time(key, runs, f"{k}{letter}", values, f"{name} [{unit}]", f"{title}, {view}",
                                     drawstyle="steps-post", **shown))  # fmt: skip
    columns = ("world", "peak |Fx| [N]", "peak |Fy| [N]", "peak |τ| [N m]", "held Fx [N]", "held Fy [N]",
               "held τ [N m]")
    rows = tuple((curve, *np.max(np.abs(run.device_force), axis=0, initial=0.0).tolist(),
                  *run.device_force[-max(int(_LAST_PART * run.steps), 1) :].mean(axis=0).tolist())
                 for curve, run in runs.items())  # fmt: skip
    return panels, titled(columns, rows, digits=3, note=_HELD)


RECIPES = tuple(_recipe(number, runs, forces) for number, runs, forces in (
    (7, UNLIMITED, False), (8, UNLIMITED, True), (9, STRATEGIES, False), (10, LIMITED, False), (11, LIMITED, True),
    (12, DEVICE, False), (13, DEVICE, True)))  # fmt: skip


# The first picture

_GHOSTS = 4  # poses of the ideal run between start and end
_MARGIN = 0.005  # [m] of wall and of air around the motion
_FORCE_LENGTH = 0.013  # [m] on paper per newton
_SIZE = (4.5, 3.8)  # inches


@recipe("hero", *UNLIMITED.values())
def hero(*given: Run) -> Drawn:
    """Draw the picture from the runs named in UNLIMITED."""
    runs = dict(zip(UNLIMITED, given, strict=True))
    apart = {name: MILLI * np.hypot(*(run.device_q[-1, :2] - runs["ideal"].device_q[-1, :2]))
             for name, run in runs.items() if name != "ideal"}  # fmt: skip
    ends = ", ".join(f"{name} {distance:.2f} mm" for name, distance in apart.items())
    panels = (
        Panel(_motion(runs["ideal"]), "A tilted peg moves to the lower right and comes to rest in a corner.",
              "the motion in the ideal world, to scale"),
        Panel(_path("hero-paths", runs, _SIZE, equal=True),
              "Paths of the hand in the four worlds. Distance of the hand from the ideal at the end: "
              f"{ends}.", "the path of the hand, magnified, equal scales"),
    )  # fmt: skip
    return Drawn(panels, None, {curve: STYLES[curve] for curve in UNLIMITED})


def _motion(run: Run) -> str:
    scene = run.scene_resolved
    corners = np.vstack(body_outlines(scene, run.pose[0]) + body_outlines(scene, run.pose[-1]))
    low, high = np.minimum(corners.min(axis=0), 0.0) - _MARGIN, np.maximum(corners.max(axis=0), 0.0) + _MARGIN
    with Canvas("hero-scene", low, high, _SIZE, turned=True) as canvas:
        canvas.walls(scene)
        canvas.bodies(scene, run.pose[-1])
        moved = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(run.q[:, :2], axis=0).T))])
        for k in np.searchsorted(moved, np.arange(_GHOSTS) / _GHOSTS * moved[-1]):  # even along the path, not in time
            canvas.bodies(scene, run.pose[k], color="none", edge=MUTED, width=0.8)
        canvas.axes.plot(*run.q[:, :2].T, **line_arguments(STYLES["ideal"]), zorder=4)
        force = np.asarray(scene["hand"]["force"][:2])
        canvas.scale_bar((high[0] - 0.002, _MARGIN / 2), 0.01, "10 mm")
        canvas.named_arrow(run.q[0, :2], _FORCE_LENGTH * force, f"hand, {np.hypot(*force):.2f} N")
    return canvas.svg

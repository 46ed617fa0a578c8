"""The first picture: a peg is pushed into a corner from many tilts. The page's script shows one
tilt at a time.

Both axes of the paper's frame are turned: to the right and upwards are positive, and the corner is
at the origin.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from iapb.run import Run
from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.geometry import Floats, body_outlines
from reports.figures.plot import Canvas, Plot
from reports.figures.style import INK, MUTED, PEG, STYLES, css
from verification.check import Study
from verification.claims.conditions import Condition
from verification.claims.peg import ALL_THREE, NAMED, WORLDS, closest, distances
from verification.table import titled

MILLI = 1e3
CURVES = {
    "ideal": "rigid wall (ideal)",
    "IAPB": "impulse, then spring (IAPB)",
    "PB": "spring only (PB)",
    "CBuc": "rigid wall felt through a spring (CBuc)",
}
_WINDOW = (
    (-16.6, -8.6),
    (3.4, 9.2),
)  # [mm] to the right, upwards: from before the first contact to rest, at all tilts
_SIZES = (4.5, 2.1), (4.5, 3.7)  # inches
_FRAME = (
    0.085,
    0.115,
    0.905,
    0.797,
)  # of the second picture: equal scales, and room for two lines above
_POSES = 4  # of the peg between start and end
_AROUND = np.array([0.006, 0.006])  # [m] of wall and of air around the motion
_SMOOTH = 3.5  # tenths of a point, the largest distance of a drawn curve from the run


@recipe("hero", "peg at every tilt")
def hero(tilted: Mapping[float, Mapping[str, Run]]) -> Drawn:
    """Draw the motion with rigid walls and the paths in four worlds, a group of each picture for
    each tilt."""
    found = {tilt: _judged(tilt, runs) for tilt, runs in tilted.items()}
    rigid, shown = (
        {tilt: runs["ideal"] for tilt, runs in tilted.items()},
        min(tilted, key=_from_start),
    )
    scene = rigid[shown].scene_resolved
    corners = [
        ring
        for run in rigid.values()
        for k in (0, -1)
        for ring in body_outlines(scene, run.pose[k])
    ]
    low, high = (end([*np.vstack(corners), np.zeros(2)], axis=0) for end in (np.min, np.max))
    with Canvas("hero-scene", low - _AROUND, high + _AROUND, _SIZES[0], turned=True) as canvas:
        canvas.walls(scene)
        canvas.scale_bar((0.046, 0.0042), 0.01, "10 mm")
        force = np.asarray(scene["hand"]["force"][:2])
        corner = np.array(
            [canvas.limits["xlim"][0] - 0.003, canvas.limits["ylim"][1] + 0.003]
        )  # upper left
        canvas.named_arrow(corner, 0.013 * force, f"hand, {np.hypot(*force):.2f} N")
    with Plot("hero-paths", _SIZES[1], frames=[_FRAME]) as paths:
        paths.axes.set(
            xlim=_WINDOW[0],
            ylim=_WINDOW[1],
            xlabel="to the right, wall at 0 [mm]",
            ylabel="above the floor [mm]",
        )
    moves = _states(shown, {tilt: _motion(canvas, run) for tilt, run in rigid.items()})
    curves = _states(
        shown,
        {
            tilt: "".join(
                (_told(tilt, found[tilt]), *(_curve(paths, name, runs[name]) for name in CURVES))
            )
            for tilt, runs in tilted.items()
        },
    )
    rows = tuple(
        (
            np.degrees(tilt),
            *(MILLI * each[ALL_THREE][name] for name in WORLDS),
            *(_nearest(each[part]) for part in NAMED),
        )
        for tilt, each in found.items()
    )
    columns = (
        "tilt [°]",
        *(f"{name} to ideal [mm]" for name in WORLDS),
        *map("nearest, {}".format, NAMED.values()),
    )
    numbers = titled(
        columns,
        rows,
        digits=3,
        note="Distances: root mean square of √(Δx² + Δy² + (50 mm Δθ)²); 50 mm "
        "is √(inertia / mass) of the peg, by the paper's values.",
    )
    said = "; ".join(f"{part} {_nearest(found[shown][part])}" for part in NAMED)
    panels = (
        Panel(
            canvas.svg.replace("</svg>", moves + "</svg>"),
            "A tilted peg moves to the lower right into a corner.",
            "The motion at rigid walls",
        ),
        Panel(
            paths.svg.replace("</svg>", curves + "</svg>"),
            "Paths of the hand in four worlds, nearest to the "
            f"rigid walls at a tilt of {np.degrees(shown):.2f}°: {said}.",
            "The path of the hand, magnified",
        ),
    )
    ends = {"least": f"{np.degrees(min(tilted)):.2g}", "most": f"{np.degrees(max(tilted)):.2f}"}
    return Drawn(panels, numbers, {text: STYLES[name] for name, text in CURVES.items()}, ends)


def _from_start(tilt: float) -> float:
    return abs(tilt - Condition().tilt)


def _judged(tilt: float, runs: Mapping[str, Run]) -> dict[str, dict[str, Any]]:
    """Return the distances from ideal by coordinate, as claim C10 measures them."""
    study = Study(run=lambda scene, world, rendering: runs[world])
    return {row["coordinate"]: row for row in distances(study, Condition(tilt), "full")}


def _nearest(row: Mapping[str, Any]) -> str:
    """Return which world is nearest to ideal, in words."""
    ahead = closest(row)
    return (
        "too close to tell"
        if ahead is None
        else f"{min(WORLDS, key=row.__getitem__)} {'✓' if ahead else '✕'}"
    )


def _states(shown: float, drawn: Mapping[float, str]) -> str:
    """Return one group per tilt, of which only one is displayed; lengths in it are tenths of
    points."""
    look = {True: "", False: ' display="none"'}
    return (
        '<g transform="scale(.1)" fill="none" stroke-linejoin="round">'
        + "".join(
            f'<g data-state="{k}"{look[tilt == shown]}>{svg}</g>'
            for k, (tilt, svg) in enumerate(drawn.items())
        )
        + "</g>"
    )


def _told(tilt: float, found: Mapping[str, Mapping[str, Any]]) -> str:
    """Return two lines of text above the paths."""
    parts = ", ".join(
        f"{NAMED[part]} {_nearest(found[part])}" for part in NAMED if part != ALL_THREE
    )
    lines = (
        (100, 600, f"Tilt {np.degrees(tilt):.2f}°: which is nearest to the rigid wall?"),
        (230, 400, parts),
    )
    return "".join(
        f'<text x="40" y="{y}" style="font: {weight} 95px var(--sans, sans-serif); fill: {css(INK)}">{text}'
        "</text>"
        for y, weight, text in lines
    )


def _curve(plot: Plot, name: str, run: Run) -> str:
    """Return the path of the hand from where it enters the window."""
    look, path = STYLES[name], -MILLI * run.device_q[:, :2]
    inside = np.all((path > np.transpose(_WINDOW)[0]) & (path < np.transpose(_WINDOW)[1]), axis=1)
    dash = " ".join(f"{10 * look.width * part:g}" for part in look.dash)
    return (
        f'<path stroke="{css(look.color)}" stroke-width="{10 * look.width:g}"'
        + (f' stroke-dasharray="{dash}"' if dash else "")
        + f' d="{_line(plot, path[np.argmax(inside) :])}"/>'
    )


def _motion(canvas: Canvas, run: Run) -> str:
    """Return the last pose, some outlines on the way (even along the path, not in time), and the
    path of the hand."""
    moved = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(run.q[:, :2], axis=0).T))])
    *way, last = (
        body_outlines(run.scene_resolved, run.pose[k])[0]
        for k in (*np.searchsorted(moved, np.arange(_POSES) / _POSES * moved[-1]), -1)
    )
    rings = "".join(_line(canvas, ring) + "z" for ring in way)
    return "".join(
        f'<path fill="{fill}" stroke="{css(color)}" stroke-width="{width}" d="{line}"/>'
        for fill, color, width, line in (
            (css(PEG), INK, 11, f"{_line(canvas, last)}z"),
            ("none", MUTED, 8, rings),
            ("none", INK, 24, _line(canvas, run.q[:, :2])),
        )
    )


def _places(plot: Plot, points: Any) -> Floats:
    """Return points of the axes as places (n, 2) in the SVG, in tenths of points."""
    return 10.0 * ([0.0, 72.0 * plot.size[1]] + plot.axes.transData.transform(points) * [1.0, -1.0])


def _line(plot: Plot, points: Any) -> str:
    """Return the path data of a line: whole steps from point to point, without points that it does
    not need."""
    from matplotlib.path import Path

    line = Path(_places(plot, points))
    line.should_simplify, line.simplify_threshold = len(points) > 4, _SMOOTH
    kept = line.cleaned(simplify=line.should_simplify)
    places = np.asarray(kept.vertices)[kept.codes != Path.STOP].round().astype(int)
    moves = np.diff(places, axis=0)
    steps = " ".join(f"{x} {y}" for x, y in moves[moves.any(axis=1)])
    return f"M{places[0][0]} {places[0][1]}l{steps}".replace(" -", "-")

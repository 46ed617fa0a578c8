"""The first picture: the peg in the corner, and where the hand goes in each of the four worlds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from iapb.run import Run
from reports.figures.canvas import arrow, draw_bodies, draw_walls, make_canvas, note, scale_bar
from reports.figures.corner import MILLI, UNLIMITED, first_shown, legend_of, marks, runs_of
from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.geometry import body_outlines
from reports.figures.style import FORCE, MUTED, STYLES, line_arguments, styled
from reports.figures.svg import to_svg

KEY, TITLE = "hero", "Four worlds in one corner"
CAPTION = (
    "A constant force pushes a tilted peg into a corner; first picture: its outlines in the rigid world, from start to "
    "end. Second picture, magnified: where the hand goes, from shortly before the first contact. The closer a curve is "
    "to the ideal one, the more the wall feels like a rigid wall. This start, tilted by 0.015 rad, sits at the edge: "
    "up to there IAPB is the closest in x and y, beyond it often not, and in the angle rarely; claim C10 has the map."
)
_GHOSTS = 4  # poses of the ideal run between start and end
_MARGIN = 0.005  # [m] of wall and of air around the motion
_FORCE_LENGTH = 0.013  # [m] on paper per newton
_SIZE = (4.5, 3.8)  # inches


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw the picture from the runs named in worlds.UNLIMITED."""
    runs = runs_of(UNLIMITED, inputs)
    panels = (Panel(_scene(runs["ideal"]), "A tilted peg moves to the lower right and comes to rest in a corner.",
                    "the motion in the rigid world, to scale"),
              Panel(_paths(runs), _words(runs), "the path of the hand, magnified, equal scales"))
    return Figure(KEY, "", TITLE, CAPTION, panels, None, legend_of(UNLIMITED), tuple(UNLIMITED.values()))


def _scene(run: Run) -> str:
    scene = run.scene_resolved
    with styled() as new_figure:
        drawing = new_figure(figsize=_SIZE)
        low, high = _view(run)
        axes = make_canvas(drawing, low, high, turned=True)
        draw_walls(axes, scene, reach=1.0)
        draw_bodies(axes, scene, run.q[-1])
        for k in ghost_steps(run):
            draw_bodies(axes, scene, run.q[k], color="none", edge=MUTED, width=0.8)
        axes.plot(*run.q[:, :2].T, **line_arguments(STYLES["ideal"]), zorder=4)
        start, force = run.q[0, :2], np.asarray(scene["hand"]["force"][:2])
        arrow(axes, start, _FORCE_LENGTH * force)
        note(axes, start, f"hand, {np.hypot(*force):.2f} N", (0, 10), color=FORCE)
        scale_bar(axes, (high[0] - 0.002, _MARGIN / 2), 0.01, "10 mm", turned=True)
        return to_svg(drawing, f"{KEY}-scene")


def _paths(runs: Mapping[str, Run]) -> str:
    with styled() as new_figure:
        drawing = new_figure(figsize=_SIZE, layout="constrained")
        axes = drawing.add_subplot()
        for number, (curve, run) in enumerate(runs.items()):
            x, y = MILLI * run.device_q[first_shown(runs) :, :2].T
            axes.plot(x, y, **line_arguments(STYLES[curve]), zorder=4 + number / 10, markevery=marks(len(x), number))
        axes.set(xlabel="x [mm]", ylabel="y [mm]")
        axes.set_aspect("equal", adjustable="datalim")
        axes.xaxis.set_inverted(True)
        axes.yaxis.set_inverted(True)
        return to_svg(drawing, f"{KEY}-paths")


def ghost_steps(run: Run) -> list[int]:
    """Return steps that are evenly spaced along the path rather than in time."""
    moved = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(run.q[:, :2], axis=0).T))])
    return [int(np.searchsorted(moved, share * moved[-1])) for share in np.arange(_GHOSTS) / _GHOSTS]


def _view(run: Run) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners of the picture: the peg's motion and a strip of wall."""
    corners = np.vstack([outline for k in (0, -1) for _, outline in body_outlines(run.scene_resolved, run.q[k])])
    return np.minimum(corners.min(axis=0), 0.0) - _MARGIN, np.maximum(corners.max(axis=0), 0.0) + _MARGIN


def _words(runs: Mapping[str, Run]) -> str:
    apart = {name: MILLI * np.hypot(*(run.device_q[-1, :2] - runs["ideal"].device_q[-1, :2]))
             for name, run in runs.items() if name != "ideal"}
    ends = ", ".join(f"{name} {distance:.2f} mm" for name, distance in apart.items())
    return f"Paths of the hand in the four worlds. Distance of the hand from the ideal at the end: {ends}."


RECIPE = Recipe(KEY, "", TITLE, tuple(UNLIMITED.values()), draw, section="hero")

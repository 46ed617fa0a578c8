"""The first picture: the peg in the corner, and where the hand goes in each of the four worlds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from iapb.run import Run
from reports.figures.canvas import arrow, draw_bodies, draw_walls, make_canvas, note, scale_bar
from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.style import HERO, MUTED, STYLES, line_arguments, styled
from reports.figures.svg import to_svg
from reports.figures.trajectories import marks
from reports.figures.worlds import UNLIMITED, legend_of, runs_of

KEY, TITLE = "hero", "Four worlds in one corner"
CAPTION = (
    "A constant force pushes the tilted peg (pale: where it starts; solid: where the rigid world leaves it) into the "
    "corner. The curves are the path of the hand; the closer to the black one, the more the wall feels like a wall. "
    "Drawn to scale."
)
_GHOSTS = 4  # poses of the ideal run between start and end
_MARGIN = 0.012  # [m] of wall and of air around the motion
_FORCE_LENGTH = 0.018  # [m] on paper per newton


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw the picture from the runs named in worlds.UNLIMITED."""
    runs = runs_of(UNLIMITED, inputs)
    panel = Panel(_picture(runs), _words(runs), wide=True)
    return Figure(KEY, "", TITLE, CAPTION, (panel,), None, legend_of(UNLIMITED), tuple(UNLIMITED.values()))


def _picture(runs: Mapping[str, Run]) -> str:
    ideal = runs["ideal"]
    scene = ideal.scene_resolved
    low, high = _view(ideal)
    with styled() as new_figure:
        drawing = new_figure(figsize=(HERO, HERO * (high - low)[1] / (high - low)[0]))
        axes = make_canvas(drawing, low, high, turned=True)
        draw_walls(axes, scene, reach=1.0)
        for k in ghost_steps(ideal):
            draw_bodies(axes, scene, ideal.q[k], alpha=0.55, edge=MUTED, width=0.7)
        draw_bodies(axes, scene, ideal.q[-1])
        for number, (curve, run) in enumerate(runs.items()):
            axes.plot(*run.device_q[:, :2].T, **line_arguments(STYLES[curve]), zorder=4 + number / 10,
                      markevery=marks(len(run.time), number))
        start, force = ideal.q[0, :2], np.asarray(scene["hand"]["force"][:2])
        arrow(axes, start, _FORCE_LENGTH * force)
        note(axes, start + _FORCE_LENGTH * force, "hand, 0.51 N", (4, -11), ha="left", fontsize=9)
        scale_bar(axes, (high[0] - 0.003, high[1] - 0.003), 0.01, "10 mm", turned=True)
        return to_svg(drawing, KEY)


def ghost_steps(run: Run) -> list[int]:
    """Return steps that are evenly spaced along the path rather than in time."""
    moved = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(run.q[:, :2], axis=0).T))])
    return [int(np.searchsorted(moved, share * moved[-1])) for share in np.arange(_GHOSTS) / _GHOSTS]


def _view(run: Run) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners of the picture: the ideal motion and a strip of wall."""
    low, high = run.q[:, :2].min(axis=0), run.q[:, :2].max(axis=0)
    return np.minimum(low - _MARGIN, -_MARGIN / 2), np.maximum(high + _MARGIN, _MARGIN / 2)


def _words(runs: Mapping[str, Run]) -> str:
    apart = {name: 1e3 * np.hypot(*(run.device_q[-1, :2] - runs["ideal"].device_q[-1, :2]))
             for name, run in runs.items() if name != "ideal"}
    ends = ", ".join(f"{name} {distance:.2f} mm" for name, distance in apart.items())
    return f"The peg slides along the floor into the corner. Distance of the hand from the ideal at the end: {ends}."


RECIPE = Recipe(KEY, "", TITLE, tuple(UNLIMITED.values()), draw, section="hero")

"""Figure 2: the two-link arm and the two places where it is struck, from the scene file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from reports.figures.canvas import arrow, make_canvas, note
from reports.figures.fig03_energy_loss import CONTACTS, LENGTH
from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.geometry import Placement, body_placements
from reports.figures.style import BLUE, INK, LINK, MUTED, PAPER, PEG, VERMILION, styled
from reports.figures.svg import to_svg

KEY, NUMBER, TITLE = "fig02", "Figure 2", "The two-link arm"
SCENES = {"A": "scene/two_link_arm_a", "B": "scene/two_link_arm_b"}
CAPTION = (
    "Drawn from the scene files: two uniform links of 1 m and 1 kg, straight, both joints turning at 1 rad/s. The blow "
    "comes at A or at B, perpendicular to the second link and without friction."
)
_SIZE = (3.6, 3.3)
_COLORS = {"A": BLUE, "B": VERMILION}


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw the figure from the resolved scene."""
    scene = inputs[SCENES["A"]]
    words = "Two links in a straight line from a fixed pivot; " + ", ".join(
        f"{name} is {distance} m along the second link" for name, distance in CONTACTS.items()) + "."
    return Figure(KEY, NUMBER, TITLE, CAPTION, (Panel(_picture(scene), words),), None, (),
                  tuple(SCENES.values()))


def _picture(scene: Mapping[str, Any]) -> str:
    poses = list(body_placements(scene).values())[:2]
    ends = [frame.of((LENGTH, 0.0)) for frame in poses]
    pivot = poses[0].origin[:2]
    points = np.vstack([pivot, *ends])
    low, high = points.min(axis=0) - (1.25, 0.22), points.max(axis=0) + (1.25, 0.12)
    with styled() as new_figure:
        drawing = new_figure(figsize=_SIZE)
        axes = make_canvas(drawing, low, high, turned=False)
        _ground(axes, pivot)
        for number, (frame, end) in enumerate(zip(poses, ends, strict=True), start=1):
            _link(axes, frame, end, number)
        for name, distance in CONTACTS.items():
            _blow(axes, poses[1], name, distance)
        return to_svg(drawing, KEY)


def _ground(axes: Any, point: Any) -> None:
    axes.fill(point[0] + np.array([-0.14, 0.14, 0.14, -0.14]), point[1] + np.array([-0.16, -0.16, -0.08, -0.08]),
              facecolor=MUTED, edgecolor="none", alpha=0.6)
    axes.plot([point[0], point[0]], [point[1] - 0.08, point[1]], color=INK, linewidth=2)


def _link(axes: Any, frame: Placement, end: Any, number: int) -> None:
    """Draw a link as a rounded bar with its joint, its name and its joint velocity."""
    start = frame.origin[:2]
    line = np.vstack([start, end])
    axes.plot(*line.T, color=LINK, linewidth=10, solid_capstyle="round", zorder=2)
    axes.plot(*line.T, color=PEG, linewidth=8, solid_capstyle="round", zorder=2)
    axes.plot(*start, "o", markersize=7, markerfacecolor=PAPER, markeredgecolor=INK, zorder=5)
    note(axes, line.mean(axis=0), f"l{number} = 1 m, m{number} = 1 kg", (14, 0), ha="left")
    note(axes, start, f"q̇{number} = 1 rad/s", (14, 0), ha="left", color=MUTED)


def _blow(axes: Any, frame: Placement, name: str, distance: float) -> None:
    """Draw the blow at `distance` along the link, against the motion."""
    point, normal = frame.of((distance, 0.0)), -frame.rotation[:2, 1]
    arrow(axes, point - 0.42 * normal, 0.36 * normal, color=_COLORS[name])
    note(axes, point - 0.42 * normal, f"{name}, {distance} m", (-5, 0), color=_COLORS[name], ha="right")


RECIPE = Recipe(KEY, NUMBER, TITLE, tuple(SCENES.values()), draw, section="idea")

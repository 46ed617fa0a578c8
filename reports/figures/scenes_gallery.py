"""Scenes beside the paper's two drawings, each at its start, straight from the scene files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from reports.figures.canvas import arrow, draw_bodies, draw_walls, is_turned, make_canvas, note
from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.geometry import body_outlines, body_placements, bounds
from reports.figures.style import FORCE, PANEL, styled
from reports.figures.svg import to_svg

KEY, TITLE = "scenes", "The other scenes"
SCENES = ("scene/peg_hole", "scene/wall_1d")
CAPTION = (
    "The tight hole, where the peg meets both sides and the end at once: six collisions, three of them redundant. "
    "And a mass before a wall, the one-dimensional case on which the stability of haptic walls is usually studied."
)
_MARGIN = 0.25
_HAND = 0.28  # arrow length, as a share of the picture


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw every scene at its start."""
    return Figure(KEY, "", TITLE, CAPTION, tuple(scene_panel(KEY, inputs[name]) for name in SCENES), None, (), SCENES)


def scene_panel(key: str, scene: Mapping[str, Any]) -> Panel:
    """Draw one scene at its start: walls, bodies and the hand's force."""
    turned = is_turned(scene)
    low, high = bounds([corners for _, corners in body_outlines(scene)], _MARGIN)
    reach = max(high - low)
    low, high = low - 0.35 * reach, high + 0.35 * reach
    with styled() as new_figure:
        drawing = new_figure(figsize=PANEL)
        axes = make_canvas(drawing, low, high, turned=turned)
        draw_walls(axes, scene, reach=20 * reach)
        draw_bodies(axes, scene)
        if scene["hand"]:
            _hand(axes, scene, _HAND * reach)
        svg = to_svg(drawing, f"{key}-{scene['name']}")
    words = f"{scene['title']}: {len(scene['bodies'])} moving bodies, {len(scene['walls'])} walls, at the start."
    return Panel(svg, words, scene["title"])


def _hand(axes: Any, scene: Mapping[str, Any], length: float) -> None:
    hand = scene["hand"]
    force = np.asarray(hand["force"][:2], dtype=float)
    if not force.any():
        return
    start = body_placements(scene)[hand["body"]].of(hand["point"])
    arrow(axes, start, length * force / np.hypot(*force))
    note(axes, start, "hand", (0, 9), color=FORCE)


RECIPE = Recipe(KEY, "", TITLE, SCENES, draw, section="idea")

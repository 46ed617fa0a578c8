"""Figure 4: the peg before the corner, from the scene file; and Figure 1's forces at one instant of a run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from reports.figures.canvas import arrow, draw_bodies, draw_walls, make_canvas, note, scale_bar
from reports.figures.figure import Figure, Numbers, Panel, Recipe
from reports.figures.planar import body_outlines, bounds
from reports.figures.style import MUTED, PANEL, styled
from reports.figures.svg import to_svg

KEY, NUMBER, TITLE = "fig04", "Figure 4", "The peg before the corner"
SCENE = "scene/peg_corner"
CAPTION = (
    "Drawn from the scene file, to scale. The paper's frame has x to the left and y down. It gives size, mass and "
    "force; where the peg starts, and how it is tilted, is ours and is varied in the claims."
)
_ARROW = 0.02  # [m] on paper per newton
_AXIS = 0.008  # [m], length of the drawn axes


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw the figure from the resolved scene."""
    scene = inputs[SCENE]
    panel = Panel(_picture(scene), "A small tilted rectangle above a floor and left of a wall, with the hand's force "
                  "pointing to the lower right.")
    return Figure(KEY, NUMBER, TITLE, CAPTION, (panel,), _numbers(scene), (), (SCENE,))


def _picture(scene: Mapping[str, Any]) -> str:
    outlines = [corners for _, corners in body_outlines(scene)]
    low, high = bounds([*outlines, np.zeros((1, 2))], 0.12)
    low = np.minimum(low, -0.006)
    with styled() as new_figure:
        drawing = new_figure(figsize=(PANEL[0], PANEL[0] * (high - low)[1] / (high - low)[0]))
        axes = make_canvas(drawing, low, high, turned=True)
        draw_walls(axes, scene, reach=1.0)
        draw_bodies(axes, scene)
        center = np.asarray(scene["bodies"][0]["position"][:2])
        force = np.asarray(scene["hand"]["force"][:2])
        arrow(axes, center, _ARROW * force)
        note(axes, center + _ARROW * force, "F hand", (6, -8), ha="left")
        _frame(axes)
        scale_bar(axes, (high[0] - 0.002, low[1] + 0.003), 0.01, "10 mm", turned=True)
        return to_svg(drawing, KEY)


def _frame(axes: Any) -> None:
    """Draw the axes of the world at the corner."""
    for vector, name, offset in (((_AXIS, 0), "x", (-7, 0)), ((0, _AXIS / 2), "y", (0, -7))):
        arrow(axes, (0.0, 0.0), vector, color=MUTED, width=1.1, head=7)
        note(axes, vector, name, offset, color=MUTED)


def _numbers(scene: Mapping[str, Any]) -> Numbers:
    body, contact = scene["bodies"][0], scene["contact"]
    rows = (
        ("peg", "size [mm]", " × ".join(f"{1e3 * side:g}" for side in body["shapes"][0]["size"]), "paper"),
        ("peg", "mass [kg]", float(body["mass"]), "paper"),
        ("peg", "inertia [kg m²]", float(body["inertia"]), "paper"),
        ("peg", "start x, y [mm], θ [rad]", ", ".join(f"{v:g}" for v in (1e3 * body["position"][0],
                                                      1e3 * body["position"][1], body["position"][2])), "ours"),
        ("walls", "stiffness [N/m]", float(contact["stiffness"]), "paper"),
        ("walls", "damping [N s/m]", float(contact["damping"]), "paper"),
        ("walls", "restitution", float(contact["restitution"]), "paper"),
        ("walls", "friction", float(contact["friction"]), "ours"),
        ("hand", "force [N, N, N m]", ", ".join(f"{v:g}" for v in scene["hand"]["force"]), "paper"),
        ("simulation", "rate [Hz]", float(scene["rate"]), "paper"),
    )
    return Numbers(("what", "quantity", "value", "given by"), rows)


RECIPE = Recipe(KEY, NUMBER, TITLE, (SCENE,), draw, section="idea")

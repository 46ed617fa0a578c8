"""Figure 4: the peg before the corner, from the scene file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from reports.figures.canvas import arrow, draw_bodies, draw_walls, make_canvas, note, scale_bar
from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.geometry import body_outlines, bounds
from reports.figures.numbers import MINUS
from reports.figures.style import MUTED, PANEL, styled
from reports.figures.svg import to_svg
from verification.finding import Table, titled

KEY, NUMBER, TITLE = "fig04", "Figure 4", "The peg before the corner"
SCENE = "scene/peg_corner"
CAPTION = (
    "Drawn from the scene file, to scale. The paper's frame has x to the left and y down. It gives size, mass and "
    "force; where the peg starts, and how it is tilted, is ours and is varied in the claims."
)
_ARROW = 0.02  # [m] on paper per newton
_AXIS = 0.006  # [m], length of the drawn axes
_WALL = 0.008  # [m], thickness of the walls shown


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw the figure from the resolved scene."""
    scene = inputs[SCENE]
    panel = Panel(_picture(scene), "A small tilted rectangle above a floor and left of a wall, with the hand's force "
                  "pointing to the lower right.")
    return Figure(KEY, NUMBER, TITLE, CAPTION, (panel,), _numbers(scene), (), (SCENE,))


def _picture(scene: Mapping[str, Any]) -> str:
    outlines = [corners for _, corners in body_outlines(scene)]
    low, high = bounds([*outlines, np.zeros((1, 2))], 0.12)
    low, high = np.minimum(low, -_WALL), np.maximum(high, _WALL)  # x to the left, y down: show some of both walls
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
        scale_bar(axes, (high[0] - 0.002, high[1] - 0.003), 0.01, "10 mm", turned=True)
        return to_svg(drawing, KEY)


def _frame(axes: Any) -> None:
    """Draw the axes of the world at the corner."""
    for vector, name, offset in (((_AXIS, 0), "x", (0, 7)), ((0, _AXIS), "y", (7, 2))):
        arrow(axes, (0.0, 0.0), vector, color=MUTED, width=1.1, head=7)
        note(axes, vector, name, offset, color=MUTED)


def _numbers(scene: Mapping[str, Any]) -> Table:
    body, contact = scene["bodies"][0], scene["contact"]
    x, y, angle = body["position"]
    rows = (
        ("peg size [mm]", _list(1e3 * side for side in body["shapes"][0]["size"]), "paper"),
        ("peg mass [kg], inertia [kg m²]", _list((body["mass"], body["inertia"])), "paper"),
        ("peg starts at x, y [mm], θ [rad]", _list((1e3 * x, 1e3 * y, angle)), "ours"),
        ("wall stiffness [N/m], damping [N s/m]", _list((contact["stiffness"], contact["damping"])), "paper"),
        ("restitution", _list([contact["restitution"]]), "paper"),
        ("friction, its velocity threshold [m/s]", _list((contact["friction"], contact["friction_velocity"])), "ours"),
        ("hand force [N, N, N m]", _list(scene["hand"]["force"]), "paper"),
        ("rate [Hz]", _list([scene["rate"]]), "paper"),
    )
    return titled(("quantity", "value", "given by"), rows)


def _list(values: Iterable[float]) -> str:
    return ", ".join(f"{value:g}" for value in values).replace("-", MINUS)


RECIPE = Recipe(KEY, NUMBER, TITLE, (SCENE,), draw, section="idea")

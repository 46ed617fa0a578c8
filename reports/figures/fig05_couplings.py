"""Figure 5 and Table I: how device and tool hold each other. Gains are those of the scene file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from reports.figures.blocks import block, make_board, summing_point, wire
from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.style import BLUE, FORCE, GREEN, styled
from reports.figures.svg import to_svg
from verification.finding import Table, titled

KEY, NUMBER, TITLE = "fig05", "Figure 5", "Two ways to hold the tool, and Table I"
SCENE = "scene/peg_corner"
CAPTION = (
    "The four-channel controller sends both forces straight across (red) and lets a spring and damper keep the two "
    "positions together (blue). The unilateral coupler is a spring and damper only (green), and only while the tool is "
    "in contact: the hand feels the wall through it, never the wall itself."
)
_WIDTH, _HEIGHT = 8.2, 5.2
_SIZE = (5.0, 5.0 * _HEIGHT / _WIDTH)  # inches


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw both diagrams; the table repeats the scene's gains."""
    panels = (
        Panel(_unilateral(), "The hand pushes the device only; a spring and damper joins device and tool while the "
              "tool is in contact.", "(a) unilateral coupler: CBuc"),
        Panel(_four_channels(), "The hand pushes device and tool alike; the environment force of the tool goes to the "
              "device; a spring and damper joins device and tool.", "(b) four channels: ideal, IAPB, PB"),
    )
    return Figure(KEY, NUMBER, TITLE, CAPTION, panels, _table(inputs[SCENE]), (), (SCENE,))


def _four_channels() -> str:
    with styled() as new_figure:
        drawing = new_figure(figsize=_SIZE)
        axes = make_board(drawing, _WIDTH, _HEIGHT)
        _ends(axes, "virtual tool")
        block(axes, (4.5, 2.6), "K coord\nB coord", (1.5, 1.1), filled=False)
        summing_point(axes, (0.6, 2.6))
        wire(axes, [(0.6, 4.9), (0.6, 2.8)], "hand force", (0.75, 4.85), color=FORCE, align="left")
        wire(axes, [(0.6, 4.35), (7.0, 4.35), (7.0, 3.25)], "hand force channel", (4.1, 4.55), color=FORCE)
        wire(axes, [(0.8, 2.6), (1.25, 2.6)])
        wire(axes, [(7.0, 1.95), (7.0, 0.85), (0.6, 0.85), (0.6, 2.4)], "environment force channel", (4.1, 0.62),
             color=FORCE)
        _spring(axes, BLUE)
        return to_svg(drawing, f"{KEY}-four")


def _unilateral() -> str:
    with styled() as new_figure:
        drawing = new_figure(figsize=_SIZE)
        axes = make_board(drawing, _WIDTH, _HEIGHT)
        _ends(axes, "virtual tool,\nrigid contacts")
        block(axes, (4.5, 2.6), "K cpl\nB cpl", (1.5, 1.1), filled=False, dashed=True)
        axes.text(4.5, 1.78, "only in contact", ha="center", va="center", fontsize=8.5, color=GREEN)
        wire(axes, [(0.6, 4.35), (0.6, 2.6), (1.25, 2.6)], "hand force", (0.75, 4.3), color=FORCE, align="left")
        _spring(axes, GREEN)
        wire(axes, [(2.05, 1.95), (2.05, 0.85), (7.0, 0.85), (7.0, 1.95)], "free motion: the tool follows", (4.5, 0.62),
             dash=(4, 2))
        return to_svg(drawing, f"{KEY}-unilateral")


def _ends(axes: Any, tool: str) -> None:
    block(axes, (2.05, 2.6), "device", (1.6, 1.3))
    block(axes, (7.0, 2.6), tool, (1.7, 1.3))


def _spring(axes: Any, color: str) -> None:
    """Draw the two directions of the spring and damper between device and tool."""
    for left, right in ((2.85, 3.75), (5.25, 6.15)):
        wire(axes, [((left + right) / 2, 2.6), (left, 2.6)], color=color)
        wire(axes, [((left + right) / 2, 2.6), (right, 2.6)], color=color)


def _table(scene: Mapping[str, Any]) -> Table:
    couplings = scene["couplings"]
    names = {"four_channel": ("K_coord", "B_coord"), "unilateral": ("K_cpl", "B_cpl")}
    rows = []
    for coupling, (stiffness, damping) in names.items():
        gains = couplings[coupling]
        rows.append((stiffness, *map(float, gains["stiffness"]), "N/m, N m/rad"))
        rows.append((damping, *map(float, gains["damping"]), "N s/m, N m s/rad"))
    return titled(("Table I", "x", "y", "θ", "unit"), tuple(rows))


RECIPE = Recipe(KEY, NUMBER, TITLE, (SCENE,), draw, section="couplings")

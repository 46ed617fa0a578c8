"""Figure 5 and Table I: the couplings of device and tool as block diagrams, with the gains of the scene file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from reports.figures.canvas import Canvas
from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.style import BLUE, FORCE, GREEN, INK, MUTED, PEG
from verification.finding import Table, titled

_BOARD = np.zeros(2), np.array([8.2, 5.2])  # corners, in arbitrary units


@recipe(
    "fig05", "Two ways to hold the tool, and Table I", "scene/peg_corner", number="Figure 5", section="couplings",
    caption="The four-channel controller transmits both forces directly (red); a spring and damper keep the positions "
    "of device and tool together (blue). The unilateral coupler is only a spring and damper (green), active while the "
    "tool is in contact: the hand feels the wall through it, never directly.",
)  # fmt: skip
def couplings(scene: Mapping[str, Any]) -> Drawn:
    """Draw both diagrams; the table repeats the scene's gains."""
    panels = (
        Panel(_unilateral(), "The hand pushes the device only; a spring and damper joins device and tool while the "
              "tool is in contact.", "(a) unilateral coupler: CBuc"),
        Panel(_four_channels(), "The hand pushes device and tool alike; the environment force of the tool goes to the "
              "device; a spring and damper joins device and tool.", "(b) four channels: ideal, IAPB, PB"),
    )  # fmt: skip
    return Drawn(panels, _table(scene))


def _four_channels() -> str:
    with Canvas("fig05-four", *_BOARD, (5.0, 5.0 * _BOARD[1][1] / _BOARD[1][0])) as canvas:
        axes = canvas.axes
        _ends(axes, "virtual tool")
        block(axes, (4.5, 2.6), "K coord\nB coord", (1.5, 1.1), filled=False)
        summing_point(axes, (0.6, 2.6))
        wire(axes, [(0.6, 4.9), (0.6, 2.8)], "hand force", (0.75, 4.85), color=FORCE, align="left")
        wire(axes, [(0.6, 4.35), (7.0, 4.35), (7.0, 3.25)], "hand force channel", (4.1, 4.55), color=FORCE)
        wire(axes, [(0.8, 2.6), (1.25, 2.6)])
        wire(axes, [(7.0, 1.95), (7.0, 0.85), (0.6, 0.85), (0.6, 2.4)], "environment force channel", (4.1, 0.62),
             color=FORCE)
        _spring(axes, BLUE)
    return canvas.svg


def _unilateral() -> str:
    with Canvas("fig05-unilateral", *_BOARD, (5.0, 5.0 * _BOARD[1][1] / _BOARD[1][0])) as canvas:
        axes = canvas.axes
        _ends(axes, "virtual tool,\nrigid contacts")
        block(axes, (4.5, 2.6), "K cpl\nB cpl", (1.5, 1.1), filled=False, dashed=True)
        axes.text(4.5, 1.78, "only in contact", ha="center", va="center", fontsize=8.5, color=GREEN)
        wire(axes, [(0.6, 4.35), (0.6, 2.6), (1.25, 2.6)], "hand force", (0.75, 4.3), color=FORCE, align="left")
        _spring(axes, GREEN)
        wire(axes, [(2.05, 1.95), (2.05, 0.85), (7.0, 0.85), (7.0, 1.95)], "free motion: the tool follows", (4.5, 0.62),
             dash=(4, 2))
    return canvas.svg


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


def block(axes: Any, center: tuple[float, float], text: str, size: tuple[float, float] = (2.4, 1.1), *,
          filled: bool = True, dashed: bool = False) -> None:
    """Draw a box with text in it."""
    from matplotlib.patches import FancyBboxPatch

    x, y = center[0] - size[0] / 2, center[1] - size[1] / 2
    axes.add_patch(FancyBboxPatch((x, y), *size, boxstyle="round,pad=0,rounding_size=0.12", linewidth=1.1,
                                  facecolor=PEG if filled else "none", edgecolor=MUTED if dashed else INK,
                                  linestyle=(0, (4, 2)) if dashed else "-", zorder=3))
    axes.text(*center, text, ha="center", va="center", fontsize=9, zorder=4, linespacing=1.35)


def summing_point(axes: Any, center: tuple[float, float]) -> None:
    """Draw the circle in which signals are added."""
    from matplotlib.patches import Circle

    axes.add_patch(Circle(center, 0.2, facecolor="none", edgecolor=INK, linewidth=1.1, zorder=3))
    axes.text(*center, "+", ha="center", va="center", fontsize=9, zorder=4)


def wire(axes: Any, corners: Sequence[tuple[float, float]], text: str = "", at: tuple[float, float] | None = None, *,
         color: str = INK, width: float = 1.2, dash: tuple[float, ...] = (), align: str = "center") -> None:
    """Draw a signal along `corners` with an arrow head at its end, and its name at `at`."""
    xs, ys = zip(*corners, strict=True)
    style: Any = (0, dash) if dash else "-"
    axes.plot(xs[:-1] + (xs[-1],), ys, color=color, linewidth=width, linestyle=style, solid_capstyle="butt", zorder=2)
    axes.annotate("", xy=corners[-1], xytext=corners[-2], zorder=2,
                  arrowprops={"arrowstyle": "-|>", "color": color, "linewidth": 0, "mutation_scale": 10,
                              "shrinkA": 0, "shrinkB": 0, "fill": True})
    if text and at is not None:
        axes.text(*at, text, ha=align, va="center", fontsize=8.5, color=color, zorder=4)

"""Figure 5 and Table I: the couplings of device and tool as block diagrams, with the gains of the scene file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from reports.figures.canvas import Canvas
from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.style import BLUE, FORCE, GREEN, INK, MUTED, PEG
from verification.table import titled

_BOARD = np.zeros(2), np.array([8.2, 5.2])  # corners, in arbitrary units


@recipe(
    "fig05", "Two ways to hold the tool, and Table I", "scene/peg_corner", number="Figure 5", section="couplings",
    caption="The four-channel controller transmits both forces directly (red); a spring and damper keep the positions "
    "of device and tool together (blue). The unilateral coupler is only a spring and damper (green), active while the "
    "tool is in contact: the hand feels the wall through it, never directly.",
)  # fmt: skip
def couplings(scene: Mapping[str, Any]) -> Drawn:
    """Draw both diagrams; the table repeats the scene's gains."""
    size = (5.0, 5.0 * _BOARD[1][1] / _BOARD[1][0])
    with Canvas("fig05-unilateral", *_BOARD, size) as one, Canvas("fig05-four", *_BOARD, size) as four:
        tools = (one.axes, "virtual tool,\nrigid contacts", GREEN), (four.axes, "virtual tool", BLUE)
        for axes, tool, color in tools:
            block(axes, (2.05, 2.6), "device", (1.6, 1.3))
            block(axes, (7.0, 2.6), tool, (1.7, 1.3))
            for left, right in ((2.85, 3.75), (5.25, 6.15)):  # the two directions of the spring and damper
                wire(axes, [((left + right) / 2, 2.6), (left, 2.6)], color=color)
                wire(axes, [((left + right) / 2, 2.6), (right, 2.6)], color=color)
        block(one.axes, (4.5, 2.6), "K cpl\nB cpl", (1.5, 1.1), filled=False, dashed=True)
        one.axes.text(4.5, 1.78, "only in contact", ha="center", va="center", fontsize=8.5, color=GREEN)
        wire(one.axes, [(0.6, 4.35), (0.6, 2.6), (1.25, 2.6)], "hand force", (0.75, 4.3), color=FORCE, align="left")
        wire(one.axes, [(2.05, 1.95), (2.05, 0.85), (7.0, 0.85), (7.0, 1.95)], "free motion: the tool follows",
             (4.5, 0.62), dash=(4, 2))
        block(four.axes, (4.5, 2.6), "K coord\nB coord", (1.5, 1.1), filled=False)
        four.axes.plot(0.6, 2.6, "o", markersize=17.6, markerfacecolor="none", markeredgecolor=INK, markeredgewidth=1.1)
        four.axes.text(0.6, 2.6, "+", ha="center", va="center", fontsize=9, zorder=4)  # forces are added
        wire(four.axes, [(0.6, 4.9), (0.6, 2.8)], "hand force", (0.75, 4.85), color=FORCE, align="left")
        wire(four.axes, [(0.6, 4.35), (7.0, 4.35), (7.0, 3.25)], "hand force channel", (4.1, 4.55), color=FORCE)
        wire(four.axes, [(0.8, 2.6), (1.25, 2.6)])
        wire(four.axes, [(7.0, 1.95), (7.0, 0.85), (0.6, 0.85), (0.6, 2.4)], "environment force channel", (4.1, 0.62),
             color=FORCE)
    panels = (
        Panel(one.svg, "The hand pushes the device only; a spring and damper joins device and tool while the tool is "
              "in contact.", "(a) unilateral coupler: CBuc"),
        Panel(four.svg, "The hand pushes device and tool alike; the environment force of the tool goes to the device; "
              "a spring and damper joins device and tool.", "(b) four channels: ideal, IAPB, PB"),
    )  # fmt: skip
    names = {"four_channel": ("K_coord", "B_coord"), "unilateral": ("K_cpl", "B_cpl")}
    rows = tuple((name, *map(float, scene["couplings"][coupling][gain]), unit) for coupling, both in names.items()
                 for name, gain, unit in zip(both, ("stiffness", "damping"), ("N/m, N m/rad", "N s/m, N m s/rad"),
                                             strict=True))  # fmt: skip
    return Drawn(panels, titled(("Table I", "x", "y", "θ", "unit"), rows))


def block(axes: Any, center: tuple[float, float], text: str, size: tuple[float, float] = (2.4, 1.1), *,
          filled: bool = True, dashed: bool = False) -> None:
    """Draw a box with text in it."""
    from matplotlib.patches import FancyBboxPatch

    x, y = center[0] - size[0] / 2, center[1] - size[1] / 2
    axes.add_patch(FancyBboxPatch((x, y), *size, boxstyle="round,pad=0,rounding_size=0.12", linewidth=1.1,
                                  facecolor=PEG if filled else "none", edgecolor=MUTED if dashed else INK,
                                  linestyle=(0, (4, 2)) if dashed else "-", zorder=3))
    axes.text(*center, text, ha="center", va="center", fontsize=9, zorder=4, linespacing=1.35)


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

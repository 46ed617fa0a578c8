"""When formula and complementarity agree: two landings of a bar, and the map."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.numbers import format_number
from reports.figures.plot import Plot, arrow, note
from reports.figures.style import (
    BLUE,
    BOUND,
    FORCE,
    GREEN,
    INK,
    MUTED,
    PEG,
    WALL,
)
from verification.complementarity.landings import HALF_LENGTH
from verification.complementarity.landings import PEG as PAPERS_PEG
from verification.table import Table

Row = Mapping[str, Any]

_TITLES = {"A": "A: posts far apart, both push", "B": "B: posts close, the formula must pull"}
# of the bar, below it, of the longest arrow [m]
_THICK = 0.09
_FLOOR = -0.55
_LONG = 0.42
_BORDER = ("cosine", "speed ratio", "agreement predicted", "agreement found")


@recipe("condition", "complementarity/landings", "complementarity/two contacts")
def condition(landings: Table, border: Table) -> Drawn:
    """Draw the two landings and the map of cosine and speed ratio."""
    rows = {row["impact"]: row for row in landings.records()}
    drawn = [rows[name] for name in _TITLES]
    most = max(abs(row[f"impulse at the {side}"]) for row in drawn for side in ("left", "right"))
    panels = [Panel(_landing(row, most), _said(row), _TITLES[row["impact"]]) for row in drawn]
    right = sum(row["agreement predicted"] == row["agreement found"] for row in border.records())
    words = f"Both motions agree where r >= c at {right} of {len(border.rows)} points."
    panels.append(Panel(_map(border, drawn, rows[PAPERS_PEG]["c"]), words, "both, over c and r"))
    return Drawn(panels, border)


def _said(row: Row) -> str:
    left = row["impulse at the left"]
    right = row["impulse at the right"]
    return f"A bar lands on two posts: the impulses are {left:.2g} and {right:.2g} N s."


def _landing(row: Row, most: float) -> str:
    """Draw the bar, its posts, the speeds at which it comes down, and the impulses of (21)."""
    post = row["post from the middle"]
    speeds = {-post: 1.0, post: row["r"]}
    impulses = {-post: row["impulse at the left"], post: row["impulse at the right"]}
    with Plot(f"landing-{row['impact']}", (3.4, 2.6), bare=True) as plot:
        axes = plot.axes
        axes.set(xlim=(-1.6, 1.6), ylim=(-1.15, 0.75), aspect="equal")
        axes.plot([-1.2, 1.2], [_FLOOR] * 2, color=MUTED, linewidth=1.0)
        if min(impulses.values()) < 0.0:
            _tilted(axes, post, row["r"])
        axes.fill(*_bar(0.0, 0.0), facecolor=PEG, edgecolor=INK, linewidth=1.1, zorder=3)
        for place, speed in speeds.items():
            axes.fill(
                [place - 0.06, place, place + 0.06],
                [_FLOOR, 0.0, _FLOOR],
                facecolor=WALL,
                edgecolor=MUTED,
                linewidth=0.7,
            )
            arrow(axes, (place, 0.12 + 0.35 * speed), (0.0, -0.35 * speed), color=MUTED, width=1.2)
            note(
                axes,
                (place, 0.16 + 0.35 * speed),
                f"speed {speed:g}",
                (0, 5),
                fontsize=8.5,
                color=MUTED,
            )
            _impulse(axes, place, impulses[place], most)
    return plot.svg


def _bar(height: float, angle: float, about: float = 0.0) -> tuple[list[float], list[float]]:
    """Return the corners of the bar, turned about a point of its lower face."""
    corners = [
        (-HALF_LENGTH, 0.0),
        (HALF_LENGTH, 0.0),
        (HALF_LENGTH, _THICK),
        (-HALF_LENGTH, _THICK),
    ]
    c = math.cos(angle)
    s = math.sin(angle)
    x = [about + c * (a - about) - s * b for a, b in corners]
    y = [height + s * (a - about) + c * b for a, b in corners]
    return x, y


def _tilted(axes: Any, post: float, ratio: float) -> None:
    """Draw the bar a moment after impulses that only push: its right end flies up."""
    axes.fill(*_bar(0.0, 0.16, -post), fill=False, edgecolor=MUTED, linestyle="--", linewidth=1.0)
    note(axes, (1.08, 0.62), "pushing only:\nthis end flies up", fontsize=8.5, color=MUTED)


def _impulse(axes: Any, place: float, impulse: float, most: float) -> None:
    """Draw an impulse under its post, upwards if it pushes."""
    length = _LONG * abs(impulse) / most
    pushes = impulse > 0.0
    color, tail = (GREEN, -0.62 - length) if pushes else (FORCE, -0.62)
    arrow(axes, (place, tail), (0.0, length if pushes else -length), color=color, width=2.4)
    words = f"{'pushes' if pushes else 'pulls'} {format_number(abs(impulse), 2)}"
    side = "right" if place < 0.0 else "left"
    offset = (-7, 0) if place < 0.0 else (7, 0)
    note(axes, (place, -0.8), words, offset, ha=side, color=color, fontsize=8.5, fontweight="bold")


def _map(border: Table, drawn: Sequence[Row], peg: float) -> str:
    """Draw the points of the grid over c and r, and where A, B and the paper's peg are."""
    with Plot("condition-map", (4.1, 3.2)) as plot:
        axes = plot.axes
        axes.fill([0.0, 1.0, 1.0], [0.0, 1.0, 0.0], facecolor=FORCE, alpha=0.12, linewidth=0)
        plot.curve([(0.0, 0.0), (1.0, 1.0)], BOUND, marked=False)
        for cosine, ratio, _, agrees in border.select(_BORDER).rows:
            mark, color = ("o", GREEN) if agrees else ("x", FORCE)
            axes.plot(cosine, ratio, mark, color=color, markersize=6, markeredgewidth=1.6)
        for row in drawn:
            axes.plot(row["c"], row["r"], "o", markersize=13, fillstyle="none", color=INK)
            note(axes, (row["c"], row["r"]), row["impact"], (-13, 0), fontweight="bold")
        axes.axvline(peg, color=BLUE, linewidth=1.6)
        note(axes, (peg, 1.13), f"the paper's peg, c = {peg:.2f}", (-4, 0), ha="right", color=BLUE)
        note(axes, (-0.55, 0.55), "same motion", color=GREEN, fontweight="bold")
        note(axes, (0.72, 0.135), "must pull", color=FORCE, fontweight="bold")
        axes.set(
            xlim=(-1.02, 1.02),
            ylim=(0.0, 1.2),
            xlabel="c: how a push at one contact moves the other",
            ylabel="r: speed of the slower contact",
        )
        axes.grid(False)
    return plot.svg

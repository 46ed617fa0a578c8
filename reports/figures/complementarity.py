"""When formula and complementarity agree: two landings of a bar, and the map."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from reports.figures.figure import Drawn, Panel, diagram, recipe
from reports.figures.plot import Plot, note
from reports.figures.style import BLUE, BOUND, FORCE, GREEN, INK
from verification.complementarity.landings import PEG
from verification.table import Table

_TITLES = {"A": "A: posts far apart, both push", "B": "B: posts close, the formula must pull"}
_BORDER = ("cosine", "speed ratio", "agreement predicted", "agreement found")


@recipe("condition", "complementarity/landings", "complementarity/two contacts")
def condition(landings: Table, border: Table) -> Drawn:
    """Show the two landings, and draw the map of cosine and speed ratio."""
    rows = {row["impact"]: row for row in landings.records()}
    panels = [diagram(f"landing_{name}", _said(rows[name]), _TITLES[name]) for name in _TITLES]
    right = sum(row["agreement predicted"] == row["agreement found"] for row in border.records())
    words = f"Both motions agree where r >= c at {right} of {len(border.rows)} points."
    map_svg = _map(border, [rows[name] for name in _TITLES], rows[PEG]["c"])
    return Drawn([*panels, Panel(map_svg, words, "both, over c and r")], border)


def _said(row: dict[str, Any]) -> str:
    left = row["impulse at the left"]
    right = row["impulse at the right"]
    return f"A bar lands on two posts: the impulses are {left:.2g} and {right:.2g} N s."


def _map(border: Table, drawn: Sequence[dict[str, Any]], peg: float) -> str:
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

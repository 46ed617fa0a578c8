"""The map of the hand's port: the damping and friction of a device on which force laws are passive."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.plot import Plot
from reports.figures.style import BLUE, FORCE, PAPER, RULE, LineStyle, looks_of
from verification.impacts import Floats
from verification.port.kit import ForceReport
from verification.table import Table

DEVICE = LineStyle(FORCE, "D", (), 0.0)
LAW = LineStyle(BLUE, width=1.8)
_SHADED = "Shaded: devices on which no motion of the hand that we found draws energy"


def _draw(
    plot: Plot,
    edges: Mapping[str, Floats],
    looks: Mapping[str, LineStyle],
    friction: float = 0.0,
) -> float:
    """Draw the edges (n, 2) of passive sets in damping [N s/m] and friction [N]; return the height
    of the drawing [N], which shows a device with this friction and where the edges rise."""
    right = max(float(edge[-1, 0]) for edge in edges.values())
    for name, edge in edges.items():
        points = [*edge.tolist(), (right, edge[-1, 1])]
        plot.curve(points, looks[name], marked=False, label=name)
    corner = max(friction, *(float(edge[:, 1].min()) for edge in edges.values()))
    knee = max(float(edge[len(edge) // 4, 1]) for edge in edges.values())
    top = 3.0 * corner or knee or 1.0
    plot.axes.set(
        xlabel="damping of the bare device b [N s/m]",
        ylabel="its Coulomb friction [N]",
        xlim=(0.0, right),
        ylim=(-0.02 * top, top),
    )
    return top


def law_svg(report: ForceReport) -> str:
    """Draw the map of one law, its passive side shaded, and its device as a diamond."""
    device = report.device
    with Plot("port-map", (6.4, 3.6)) as plot:
        top = _draw(plot, {report.law: report.edge}, {report.law: LAW}, device.friction)
        place = device.damping, device.friction
        plot.marks([place], DEVICE, markersize=8, label="your device")
        plot.axes.fill_between(*report.edge.T, top, color=RULE, alpha=0.35, lw=0)
        plot.axes.set_title(_SHADED)
        plot.axes.legend(loc="upper right")
        plot.drawing.set_facecolor(PAPER)
    return plot.svg


@recipe("port-map", "stability/edges")
def port_map(table: Table) -> Drawn:
    """Draw the edge of each coupling of the paper."""
    looks = looks_of(table["law"])
    edges = {
        name: np.array(table.where(law=name).select(("damping", "friction")).rows) for name in looks
    }
    with Plot("port-map-0", (6.4, 3.6)) as plot:
        _draw(plot, edges, looks)
    panel = Panel(plot.svg, f"Edges of the passive sets of {', '.join(edges)}.")
    return Drawn([panel], table, looks)

"""The map of the hand's port: the damping and friction of a device on which force laws are passive."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from reports.figures.figure import Drawn, Figure, Panel, recipe, standalone
from reports.figures.plot import Plot
from reports.figures.style import BLUE, CYCLE, FORCE, RULE, STYLES, LineStyle
from verification.impacts import Floats
from verification.port.kit import ForceReport
from verification.table import Table

DEVICE = LineStyle(FORCE, "D", (), 0.0, name="your device")
_TITLE = "Is my force law passive on my device?"
_LABEL = "Shaded: devices on which no motion of the hand that we found draws energy"
LAW = LineStyle(BLUE, width=1.8)


def map_of(
    edges: Mapping[str, Floats],
    looks: Mapping[str, LineStyle],
    device: tuple[float, float] | None = None,
) -> Panel:
    """Draw edges (n, 2) of passive sets in damping [N s/m] and friction [N], and a device as a
    diamond; the passive side of a single edge is shaded."""
    bend = max(float(edge[:, 1].min()) for edge in edges.values())
    corner = max((device or (0.0, 0.0))[1], bend)
    top = 3.0 * corner or _knee(edges)
    right = max(float(edge[-1, 0]) for edge in edges.values())
    with Plot("port-map-0", (6.4, 3.6)) as plot:
        for name, edge in edges.items():
            plot.curve([*edge.tolist(), (right, edge[-1, 1])], looks[name], marked=False)
        if device is not None:
            plot.marks([device], DEVICE, markersize=8)
        if len(edges) == 1:
            plot.axes.fill_between(*edge.T, top, color=RULE, alpha=0.35, lw=0)
        plot.axes.set(
            xlabel="damping of the bare device b [N s/m]",
            ylabel="its Coulomb friction [N]",
            xlim=(0.0, right),
            ylim=(-0.02 * top, top),
        )
    return Panel(plot.svg, f"Edges of the passive sets of {', '.join(edges)}.", "")


def _knee(edges: Mapping[str, Floats]) -> float:
    """A height that shows where the edges begin to rise [N]."""
    return max(float(edge[len(edge) // 4, 1]) for edge in edges.values()) or 1.0


def write_map(path: Path, report: ForceReport) -> Path:
    """Write the map of one law and its device as an SVG file."""
    device = report.device.damping, report.device.friction
    panel = map_of({report.law: report.edge}, {report.law: LAW}, device)
    figure = Figure(
        "port-map",
        "",
        _TITLE,
        panels=(replace(panel, label=_LABEL),),
        legend=((report.law, LAW), (DEVICE.name, DEVICE)),
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(standalone(figure), encoding="utf-8")
    return path


@recipe("port-map", "stability/edges")
def port_map(table: Table) -> Drawn:
    """Draw the edge of each coupling of the paper."""
    rows = table.records()
    names = list(dict.fromkeys(row["law"] for row in rows))
    others = iter(CYCLE[1:])
    looks = {name: STYLES.get(name) or next(others) for name in names}
    edges = {
        name: np.array(table.where(law=name).select(("damping", "friction")).rows) for name in names
    }
    return Drawn([map_of(edges, looks)], table, looks)

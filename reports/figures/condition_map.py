"""Maps over two conditions that show where a claim holds, for the claim's record (called directly, without a recipe).

A filled dot means that the claim holds, a cross that it fails, a ring that the trial cannot tell. If several trials
share a place, the size of the dot is the share of trials in which the claim holds.
"""

from __future__ import annotations

import numpy as np

from reports.figures.figure import Figure, Panel
from reports.figures.plot import Plot
from reports.figures.style import OUTCOMES
from verification.table import Table

_SIZE = (4.1, 2.4)  # inches
_DOT = 6.8  # diameter of a full dot [points]


def condition_map(name: str, title: str, caption: str, table: Table, x: str, y: str, *split: str,
                  ranked: bool = False) -> Figure:  # fmt: skip
    """Draw the outcomes over the columns x and y, in one panel for every combination of the columns in `split`.

    ranked : whether x shows ranks, with a tick for each value, so that close values are drawn apart
    """
    titles = {column.key: column.title for column in table.columns}
    ticks, drawn = sorted(set(table.column(x))), []
    panels: dict[str, dict[tuple[float, float], list[bool | None]]] = {}
    for row, held in zip(table.records(), table.holds, strict=True):
        panel = ", ".join(row[key] if isinstance(row[key], str) else f"{titles[key]}: {row[key]:g}" for key in split)
        place = float(ticks.index(row[x]) if ranked else row[x]), float(row[y])
        panels.setdefault(panel, {}).setdefault(place, []).append(held)
    for number, (panel, places) in enumerate(panels.items()):
        with Plot(f"{name}-{number}", _SIZE) as plot:
            for at, trials in places.items():
                decided = [held for held in trials if held is not None]
                share = float(np.mean(decided)) if decided else 0.0
                if not decided:
                    plot.marks([at], OUTCOMES["cannot tell"], markersize=5, zorder=3)
                elif share < 1.0:
                    plot.marks([at], OUTCOMES["fails"], markersize=6, zorder=4)
                if share > 0.0:
                    plot.marks([at], OUTCOMES["holds"], markersize=_DOT * share**0.5, zorder=3)
            plot.axes.margins(0.08)
            plot.axes.set(xlabel=titles[x], ylabel=titles[y])
            if ranked:
                plot.axes.set_xticks(range(len(ticks)), [f"{tick:g}" for tick in ticks], rotation=90)
        outcomes = [held for trials in places.values() for held in trials]
        words = (f"Map over {titles[x]} and {titles[y]}: the claim holds in {outcomes.count(True)} of {len(outcomes)} "
                 f"trials, fails in {outcomes.count(False)}.")  # fmt: skip
        drawn.append(Panel(plot.svg, words, panel))
    legend = tuple(OUTCOMES.items())
    return Figure(name, "", title, caption, tuple(drawn), None, legend if None in table.holds else legend[:2])

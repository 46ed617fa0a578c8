"""Maps over two conditions that show where a claim holds, for the claim's record (called directly,
without a recipe).

A filled dot means that the claim holds, a cross that it fails, a ring that the trial cannot tell.
If several trials share a place, the size of the dot is the share of trials in which the claim
holds.
"""

from __future__ import annotations

import numpy as np

from reports.figures.figure import Figure, Panel
from reports.figures.plot import Plot
from reports.figures.style import OUTCOMES
from verification.table import Table

_SIZE = (4.1, 2.4)  # inches
_MOST = 24  # values of an axis of ranks
_DOT = 6.8  # diameter of a full dot [points]
_SHOWN = {
    "rad": ("°", 180.0 / np.pi),
    "m": ("mm", 1e3),
}  # unit of a column -> unit on an axis, and the factor


def condition_map(
    name: str,
    title: str,
    caption: str,
    table: Table,
    x: str,
    y: str,
    *split: str,
) -> Figure:
    """Draw the outcomes over the columns x and y, in one panel for every combination of the columns
    in `split`.

    An axis of few values shows their ranks, with a tick for each value, so that close values are
    drawn apart.
    """
    units = {column.key: _SHOWN.get(column.unit, (column.unit, 1.0)) for column in table.columns}
    titles = {key: f"{key} [{unit}]" if unit else key for key, (unit, _) in units.items()}
    ranks = {key: sorted(set(table.column(key))) for key in (x, y)}
    drawn = []
    panels: dict[str, dict[tuple[float, float], list[bool | None]]] = {}
    for row, held in zip(table.records(), table.holds, strict=True):
        panel = ", ".join(
            row[key]
            if isinstance(row[key], str)
            else f"{titles[key]}: {units[key][1] * row[key]:.3g}"
            for key in split
        )
        at = {
            key: units[key][1] * row[key]
            if len(ranks[key]) > _MOST
            else float(ranks[key].index(row[key]))
            for key in (x, y)
        }
        panels.setdefault(panel, {}).setdefault((at[x], at[y]), []).append(held)
    for number, (panel, places) in enumerate(panels.items()):
        marks: dict[tuple[str, float], list[tuple[float, float]]] = {}  # outcome and size -> places
        for place, trials in places.items():
            decided = [held for held in trials if held is not None]
            share = float(np.mean(decided)) if decided else 0.0
            if share < 1.0:
                marks.setdefault(("fails", 6.0) if decided else ("cannot tell", 5.0), []).append(
                    place
                )
            if share > 0.0:
                marks.setdefault(("holds", _DOT * share**0.5), []).append(place)
        with Plot(f"{name}-{number}", _SIZE) as plot:
            for (outcome, size), found in marks.items():
                plot.marks(
                    found, OUTCOMES[outcome], markersize=size, zorder=4 if outcome == "fails" else 3
                )
            plot.axes.margins(0.08)
            plot.axes.set(xlabel=titles[x], ylabel=titles[y])
            for axis, key, turn in (("x", x, 90), ("y", y, 0)):
                shown = [units[key][1] * value for value in ranks[key]]
                if len(shown) <= _MOST:
                    named = [f"{float(f'{value:.{2 + (value >= 100)}g}'):.7g}" for value in shown]
                    plot.axes.set(**{f"{axis}lim": (-0.6, len(shown) - 0.4)})
                    getattr(plot.axes, f"{axis}axis").set_ticks(
                        range(len(shown)), named, rotation=turn
                    )
        outcomes = [held for trials in places.values() for held in trials]
        told = (
            f"Map over {titles[x]} and {titles[y]}: the claim holds in {outcomes.count(True)} of "
            f"{len(outcomes)} trials, fails in {outcomes.count(False)}."
        )
        drawn.append(Panel(plot.svg, told, panel))
    legend = tuple(OUTCOMES.items())
    return Figure(
        name, "", title, caption, tuple(drawn), None, legend if None in table.holds else legend[:2]
    )

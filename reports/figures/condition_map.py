"""Maps over two conditions that show where a claim holds, for the claim's record (called directly, without a recipe).

A filled dot means that the claim holds, a cross that it fails, a ring that the trial cannot tell. If several trials
share a place, the size of the dot is the share of trials in which the claim holds.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from reports.figures.figure import Figure, Panel
from reports.figures.plot import Plot
from reports.figures.style import OUTCOMES

_SIZE = (4.1, 2.4)  # inches
_DOT = 6.8  # diameter of a full dot [points]


def condition_map(key: str, title: str, caption: str, x: tuple[str, Sequence[float]], y: tuple[str, Sequence[float]],
                  holds: Sequence[bool | None], panels: Sequence[Any] | None = None, ranked: bool = False) -> Figure:
    """Draw where a claim holds.

    Parameters
    ----------
    x, y : label with unit, and the condition's value in each trial.
    holds : whether the claim held in each trial; None if the trial cannot tell.
    panels : label of each trial's map; trials with the same label share a map. Default: one map.
    ranked : whether x shows ranks, with a tick for each value, so that close values are drawn apart.
    """
    ticks = sorted(set(x[1])) if ranked else []
    across = [float(ticks.index(value) if ranked else value) for value in x[1]]
    split = [""] * len(holds) if panels is None else [str(value) for value in panels]
    drawn = []
    for number, name in enumerate(dict.fromkeys(split)):
        places: dict[tuple[float, float], list[bool | None]] = {}
        for *place, held, panel in zip(across, map(float, y[1]), holds, split, strict=True):
            if panel == name:
                places.setdefault((place[0], place[1]), []).append(held)
        with Plot(f"{key}-{number}", _SIZE) as plot:
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
            plot.axes.set(xlabel=x[0], ylabel=y[0])
            if ticks:
                plot.axes.set_xticks(range(len(ticks)), [f"{tick:g}" for tick in ticks], rotation=90)
        outcomes = [held for trials in places.values() for held in trials]
        words = (f"Map over {x[0]} and {y[0]}: the claim holds in {outcomes.count(True)} of {len(outcomes)} trials, "
                 f"fails in {outcomes.count(False)}.")  # fmt: skip
        drawn.append(Panel(plot.svg, words, name))
    legend = tuple(OUTCOMES.items())
    return Figure(key, "", title, caption, tuple(drawn), None, legend if None in holds else legend[:2])

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

Outcomes = Sequence[bool | None]


def condition_map(key: str, title: str, caption: str, x: tuple[str, Sequence[float]], y: tuple[str, Sequence[float]],
                  holds: Outcomes, panels: Sequence[Any] | None = None, ranked: bool = False) -> Figure:
    """Draw where a claim holds.

    Parameters
    ----------
    x, y : label with unit, and the condition's value in each trial.
    holds : whether the claim held in each trial; None if the trial cannot tell.
    panels : label of each trial's map; trials with the same label share a map. Default: one map.
    ranked : whether x shows ranks, with a tick for each value, so that close values are drawn apart.
    """
    values = sorted(set(x[1])) if ranked else []
    across = [values.index(value) for value in x[1]] if ranked else x[1]
    split = ["" for _ in holds] if panels is None else [str(value) for value in panels]
    drawn = []
    for number, name in enumerate(dict.fromkeys(split)):
        kept = [k for k, value in enumerate(split) if value == name]
        places = _places([across[k] for k in kept], [y[1][k] for k in kept], [holds[k] for k in kept])
        drawn.append(Panel(_map(f"{key}-{number}", x[0], y[0], places, values), _words(x[0], y[0], places), name))
    legend = tuple(OUTCOMES.items())
    return Figure(key, "", title, caption, tuple(drawn), None, legend if None in holds else legend[:2])


Places = dict[tuple[float, float], list[bool | None]]


def _places(x: Sequence[float], y: Sequence[float], holds: Outcomes) -> Places:
    """Collect the outcomes of the trials at each place."""
    places: Places = {}
    for place_x, place_y, held in zip(x, y, holds, strict=True):
        places.setdefault((float(place_x), float(place_y)), []).append(held)
    return places


def _map(key: str, x_label: str, y_label: str, places: Places, ticks: Sequence[float]) -> str:
    with Plot(key, _SIZE) as plot:
        axes = plot.axes
        for (x, y), trials in places.items():
            decided = [held for held in trials if held is not None]
            share = float(np.mean(decided)) if decided else 0.0
            if not decided:
                plot.marks([(x, y)], OUTCOMES["cannot tell"], markersize=5, zorder=3)
            elif share < 1.0:
                plot.marks([(x, y)], OUTCOMES["fails"], markersize=6, zorder=4)
            if share > 0.0:
                plot.marks([(x, y)], OUTCOMES["holds"], markersize=_DOT * share**0.5, zorder=3)
        axes.margins(0.08)
        axes.set(xlabel=x_label, ylabel=y_label)
        if ticks:
            axes.set_xticks(range(len(ticks)), [f"{tick:g}" for tick in ticks], rotation=90)
    return plot.svg


def _words(x_label: str, y_label: str, places: Places) -> str:
    outcomes = [held for trials in places.values() for held in trials]
    return (f"Map over {x_label} and {y_label}: the claim holds in {outcomes.count(True)} of {len(outcomes)} trials, "
            f"fails in {outcomes.count(False)}.")

"""Where a claim holds: a small map over two conditions, for a claim's record (no recipe: claims call it).

A filled dot holds, a cross fails; where several trials share a place, the size of the dot is the share that holds.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from reports.figures.figure import Figure, Panel
from reports.figures.style import BLUE, PAPER, VERMILION, styled
from reports.figures.svg import to_svg

_SIZE = (4.1, 2.7)
_DOT = 46.0  # area of a full dot [points²]


def condition_map(key: str, title: str, caption: str, x: tuple[str, Sequence[float]], y: tuple[str, Sequence[float]],
                  holds: Sequence[bool]) -> Figure:
    """Draw where a claim holds.

    Parameters
    ----------
    x, y : label with unit, and the condition's value in each trial.
    holds : whether the claim held in each trial.
    """
    places: dict[tuple[float, float], list[bool]] = {}
    for place_x, place_y, held in zip(x[1], y[1], holds, strict=True):
        places.setdefault((float(place_x), float(place_y)), []).append(bool(held))
    with styled() as new_figure:
        drawing = new_figure(figsize=_SIZE, layout="constrained")
        axes = drawing.add_subplot()
        for (place_x, place_y), trials in places.items():
            share = float(np.mean(trials))
            if share < 1.0:
                axes.plot(place_x, place_y, "x", color=VERMILION, markersize=6, markeredgewidth=1.4, zorder=3)
            if share > 0.0:
                axes.scatter(place_x, place_y, s=_DOT * share, color=BLUE, edgecolor=PAPER, linewidth=0.5, zorder=4)
        axes.margins(0.08)
        axes.set(xlabel=x[0], ylabel=y[0])
        svg = to_svg(drawing, key)
    total = int(np.sum(np.asarray(holds, dtype=bool)))
    alt = f"Map over {x[0]} and {y[0]}: the claim holds in {total} of {len(holds)} trials."
    legend = (("holds", "holds"), ("fails", "fails"))
    return Figure(key, "", title, caption, (Panel(svg, alt),), None, legend)

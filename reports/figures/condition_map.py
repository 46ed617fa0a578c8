"""Maps over two conditions that show where a claim holds, for the claim's record (called directly,
without a recipe).

A filled dot means that the claim holds, a cross that it fails, a ring that the trial cannot tell.
If several trials share a place, the area of the dot is the share of trials in which the claim
holds.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from reports.figures.figure import Figure, Panel
from reports.figures.numbers import format_cell
from reports.figures.plot import Plot
from reports.figures.style import OUTCOMES
from verification.impacts import Floats
from verification.table import Table

_SIZE = (4.1, 2.4)  # inches
_MOST = 24  # values of an axis of ranks
# diameters of marks [points]
_DOT = 6.8
_CROSS = 6.0
_RING = 5.0
# unit of a column -> unit on an axis, and the factor
_SHOWN = {"rad": ("°", 180.0 / np.pi), "m": ("mm", 1e3)}


class Axis(NamedTuple):
    """A condition along an axis: the place of each trial, and the texts at the ticks.

    If there are few values, a place is the rank of its value, so that close values are drawn apart;
    else there are no ticks of ours.
    """

    title: str
    places: Floats
    ticks: list[str]


def condition_map(
    name: str, title: str, caption: str, table: Table, x: str, y: str, split: str
) -> Figure:
    """Draw the outcomes over the columns x and y, in one panel for every value of `split`."""
    axes = (_axis(table, x), _axis(table, y))
    held = np.array([np.nan if one is None else float(one) for one in table.holds])
    given = np.array(table[split])
    panels: list[Panel] = []
    for value in dict.fromkeys(given.tolist()):
        here = given == value
        places = np.column_stack([axis.places[here] for axis in axes])
        label = value
        if not isinstance(value, str):
            shown, factor = _titled(table, split)
            label = f"{shown}: {factor * value:.3g}"
        panels.append(_panel(f"{name}-{len(panels)}", label, axes, places, held[here]))
    return Figure(name, "", title, caption, tuple(panels), None, tuple(OUTCOMES.items()))


def _titled(table: Table, key: str) -> tuple[str, float]:
    """Return the title of a column with the unit that is shown, and the factor to it."""
    unit = table.columns[table.keys.index(key)].unit
    shown, factor = _SHOWN.get(unit, (unit, 1.0))
    return f"{key} [{shown}]" if shown else key, factor


def _axis(table: Table, key: str) -> Axis:
    title, factor = _titled(table, key)
    values = factor * np.array(table[key])
    different, ranks = np.unique(values, return_inverse=True)
    if len(different) > _MOST:
        return Axis(title, values, [])
    return Axis(title, ranks.astype(float), [format_cell(float(value), 3) for value in different])


def _panel(key: str, label: str, axes: tuple[Axis, Axis], trials: Floats, held: Floats) -> Panel:
    """Draw the outcomes `held` (NaN: cannot tell) of the trials at their places (n, 2)."""
    places, place_of = np.unique(trials, axis=0, return_inverse=True)
    shares = np.full(len(places), np.nan)  # of decided trials in which the claim holds
    for place in set(place_of[~np.isnan(held)]):
        shares[place] = np.nanmean(held[place_of == place])
    sizes = {
        "holds": _DOT * np.sqrt(np.nan_to_num(shares)),
        "fails": _CROSS * (shares < 1.0),
        "cannot tell": _RING * np.isnan(shares),
    }
    with Plot(key, _SIZE) as plot:
        for outcome, diameters in sizes.items():
            for size in np.unique(diameters[diameters > 0.0]):
                marked = places[diameters == size].tolist()
                plot.marks(marked, OUTCOMES[outcome], markersize=size)
        plot.axes.margins(0.08)
        plot.axes.set(xlabel=axes[0].title, ylabel=axes[1].title)
        for name, turn, axis in (("x", 90, axes[0]), ("y", 0, axes[1])):
            if axis.ticks:
                plot.axes.set(**{f"{name}lim": (-0.6, len(axis.ticks) - 0.4)})
                drawn = getattr(plot.axes, f"{name}axis")
                drawn.set_ticks(range(len(axis.ticks)), axis.ticks, rotation=turn)
    told = (
        f"Map over {axes[0].title} and {axes[1].title}: the claim holds in {np.sum(held == 1.0)} "
        f"of {len(held)} trials, fails in {np.sum(held == 0.0)}."
    )
    return Panel(plot.svg, told, label)

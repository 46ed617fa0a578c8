"""One scene in several worlds: distances from one of them, energy and penetration over time, and
the time of a step."""

from __future__ import annotations

from typing import Any

from reports.figures.numbers import power_of_ten
from reports.figures.plot import Plot
from reports.figures.style import PAPER, LineStyle, line_arguments, looks_of
from verification.table import Table

_DISTANCES = ("configuration", "velocity", "impulse")  # zero in the reference world
# largest ratio of peaks that an even scale shows; beyond, distances are on a logarithmic one
_LINEAR = 30.0
_ROUNDING = 1e-9  # share of the largest peak under which a curve is rounding and need not be seen
# column of the table over time -> (title, factor to what is drawn)
_PANELS = {
    "configuration": ("configuration apart [mm]", 1e3),
    "velocity": ("velocity apart [mm/s]", 1e3),
    "impulse": ("impulse of contacts apart [N s]", 1.0),
    "energy": ("kinetic and potential energy [J]", 1.0),
    "penetration": ("penetration [mm]", 1e3),
}


def worlds_svg(table: Table, series: Table, against: str) -> str:
    """Draw five curves over time for each world, and bars of the time of a step."""
    looks = looks_of(str(name) for name in table["world"])
    with Plot("worlds", (9.6, 5.4), shape=(2, 3)) as plot:
        for axes, (key, (title, factor)) in zip(plot.each, _PANELS.items(), strict=False):
            _curves(axes, series, key, factor, looks, against)
            axes.set(title=title, xlabel="time [s]")
        _bars(plot.each[5], table, looks)
        plot.drawing.set_facecolor(PAPER)
        lines = [plot.axes.plot([], [], **line_arguments(look))[0] for look in looks.values()]
        names = [f"{name} (reference)" if name == against else name for name in looks]
        plot.drawing.legend(lines, names, loc="outside upper left", ncols=len(names))
    return plot.svg


def _bars(axes: Any, table: Table, looks: dict[str, LineStyle]) -> None:
    spent = table["time per step"]
    colors = [look.color for look in looks.values()]
    drawn = axes.barh(list(looks), spent, color=colors, height=0.6)
    axes.bar_label(drawn, fmt="{:.3g}", padding=3)
    limits = (0.5 * min(spent), 8.0 * max(spent))
    axes.set(xscale="log", title="time of a step [µs]", xticks=[], xlim=limits)
    axes.minorticks_off()
    axes.invert_yaxis()


def _curves(
    axes: Any, series: Table, key: str, factor: float, looks: dict[str, LineStyle], against: str
) -> None:
    curves = {}
    for name in looks:
        mine = series.where(world=name)
        values = mine[key]
        if None not in values and not (key in _DISTANCES and name == against):
            curves[name] = mine["time"], [factor * value for value in values]
    peaks = [max(values) for _, values in curves.values()]
    seen = [peak for peak in peaks if peak > _ROUNDING * max(peaks)]
    if key in _DISTANCES and seen and max(seen) > _LINEAR * min(seen):
        axes.set(yscale="log", ylim=(0.1 * min(seen), 2.0 * max(seen)))
        axes.yaxis.set_major_formatter(lambda value, _: power_of_ten(value))
        axes.yaxis.set_minor_formatter(lambda *_: "")
    for number, (name, (times, values)) in enumerate(curves.items()):
        every = max(1, len(times) // 6)
        marks = number * every // len(curves), every
        axes.plot(times, values, markevery=marks, **line_arguments(looks[name]))

"""One scene in several worlds: distances from one of them, energy and penetration over time, and
the time of a step."""

from __future__ import annotations

from typing import Any

from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.numbers import power_of_ten
from reports.figures.plot import Plot
from reports.figures.style import LineStyle, line_arguments, looks_of
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


@recipe("worlds", "worlds", "over time")
def worlds(table: Table, series: Table) -> Drawn:
    """Draw five curves over time for each world, and bars of the time of a step."""
    names = [str(name) for name in table.column("world")]
    against = next(
        (name for name in names if not any(series.where(world=name).column("configuration"))), ""
    )
    looks = looks_of(names)
    with Plot("worlds", (9.6, 5.4), shape=(2, 3)) as plot:
        for axes, (key, (title, factor)) in zip(plot.each, _PANELS.items(), strict=False):
            shown = [name for name in names if key not in _DISTANCES or name != against]
            shown = [name for name in shown if None not in series.where(world=name).column(key)]
            _curves(axes, series, key, factor, {name: looks[name] for name in shown})
            axes.set(title=title, xlabel="time [s]")
        bars = plot.each[5]
        spent = dict(zip(table.column("world"), table.column("time per step"), strict=True))
        drawn = bars.barh(
            list(spent),
            list(spent.values()),
            color=[looks[name].color for name in spent],
            height=0.6,
        )
        bars.bar_label(drawn, [f"{value:.3g}" for value in spent.values()], padding=3)
        bars.set(
            xscale="log",
            title="time of a step [µs]",
            xticks=[],
            xlim=(0.5 * min(spent.values()), 8.0 * max(spent.values())),
        )
        bars.minorticks_off()
        bars.invert_yaxis()
    alt = f"Worlds {', '.join(names)} over time: {'; '.join(title for title, _ in _PANELS.values())}; time per step."
    legend = {f"{name} (reference)" if name == against else name: looks[name] for name in names}
    return Drawn([Panel(plot.svg, alt, wide=True)], table, legend)


def _curves(axes: Any, series: Table, key: str, factor: float, looks: dict[str, LineStyle]) -> None:
    peaks = [factor * max(series.where(world=name).column(key)) for name in looks]
    seen = [peak for peak in peaks if peak > _ROUNDING * max(peaks, default=0.0)]
    if key in _DISTANCES and seen and max(seen) > _LINEAR * min(seen):
        axes.set(yscale="log", ylim=(0.1 * min(seen), 2.0 * max(seen)))
        axes.yaxis.set_major_formatter(lambda value, _: power_of_ten(value))
        axes.yaxis.set_minor_formatter(lambda *_: "")
    for k, (name, look) in enumerate(looks.items()):
        mine = series.where(world=name)
        times = mine.column("time")
        values = [factor * value for value in mine.column(key)]
        apart = max(1, len(times) // 6)
        axes.plot(times, values, markevery=(k * apart // len(looks), apart), **line_arguments(look))

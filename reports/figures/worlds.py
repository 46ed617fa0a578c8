"""One scene in several worlds: distances from one of them, energy and penetration over time, and the time of a step."""

from __future__ import annotations

from typing import Any

from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.numbers import power_of_ten
from reports.figures.style import LineStyle, line_arguments, looks_of, styled
from reports.figures.svg import to_svg
from verification.table import Table

_SIZE = (9.6, 5.4)  # inches
_DISTANCES = ("configuration", "velocity", "impulse")  # zero in the reference world
_LINEAR = 30.0  # largest ratio of peaks that an even scale shows; beyond, distances are on a logarithmic one
_ROUNDING = 1e-9  # share of the largest peak under which a curve is rounding and need not be seen
# column of the table over time -> (title, factor to what is drawn)
_PANELS = {
    "configuration": ("configuration apart [mm]", 1e3), "velocity": ("velocity apart [mm/s]", 1e3),
    "impulse": ("impulse of contacts apart [N s]", 1.0), "energy": ("kinetic and potential energy [J]", 1.0),
    "penetration": ("penetration [mm]", 1e3),
}  # fmt: skip


@recipe(
    "worlds", "One scene in several worlds", "worlds", "over time",
    caption="Distances from the world to compare with, in the kinetic metric: root mean square displacement and "
    "velocity over the whole mass, and the impulse of all contacts so far (their resultant if the mass matrix is "
    "constant, else the sum of their generalized impulses). Further panels: energy, deepest penetration since the "
    "previous instant, and CPU time of a step.",
)  # fmt: skip
def worlds(table: Table, series: Table) -> Drawn:
    """Draw five curves over time for each world, and bars of the time of a step."""
    from matplotlib.ticker import NullLocator

    names = [str(name) for name in table.column("world")]
    against = next((row["world"] for row in table.records() if row["configuration, rms"] is None), "")
    looks = looks_of(names)
    with styled() as new_figure:
        drawing = new_figure(figsize=_SIZE, layout="constrained")
        axes = drawing.subplots(2, 3).ravel()
        for axis, (key, (title, factor)) in zip(axes, _PANELS.items(), strict=False):
            shown = [name for name in names if key not in _DISTANCES or name != against]
            _curves(axis, series, key, factor, {name: looks[name] for name in shown})
            axis.set(title=title, xlabel="time [s]")
        spent = dict(zip(table.column("world"), table.column("time per step"), strict=True))
        bars = axes[5].barh(list(spent), list(spent.values()), color=[looks[name].color for name in spent], height=0.6)
        axes[5].bar_label(bars, [f"{value:.3g}" for value in spent.values()], padding=3)
        axes[5].set(xscale="log", title="time of a step [µs]",
                    xlim=(0.5 * min(spent.values()), 8.0 * max(spent.values())))  # fmt: skip
        axes[5].xaxis.set_major_locator(NullLocator())
        axes[5].xaxis.set_minor_locator(NullLocator())
        axes[5].invert_yaxis()
        svg = to_svg(drawing, "worlds")
    alt = f"Worlds {', '.join(names)} over time: {'; '.join(title for title, _ in _PANELS.values())}; time per step."
    legend = tuple((f"{name} (reference)" if name == against else name, looks[name]) for name in names)
    return Drawn((Panel(svg, alt, wide=True),), table, legend)


def _curves(axis: Any, series: Table, key: str, factor: float, looks: dict[str, LineStyle]) -> None:
    from matplotlib.ticker import FuncFormatter, NullFormatter

    peaks = [factor * max(series.where(world=name).column(key)) for name in looks]
    seen = [peak for peak in peaks if peak > _ROUNDING * max(peaks, default=0.0)]
    if key in _DISTANCES and seen and max(seen) > _LINEAR * min(seen):
        axis.set(yscale="log", ylim=(0.1 * min(seen), 2.0 * max(seen)))
        axis.yaxis.set_major_formatter(FuncFormatter(lambda value, _: power_of_ten(value)))
        axis.yaxis.set_minor_formatter(NullFormatter())
    for k, (name, look) in enumerate(looks.items()):
        mine = series.where(world=name)
        times, values = mine.column("time"), [factor * value for value in mine.column(key)]
        apart = max(1, len(times) // 6)
        axis.plot(times, values, markevery=(k * apart // len(looks), apart), **line_arguments(look))

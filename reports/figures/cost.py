"""What accuracy costs in time: impact methods, whole motions, stopping early, growth with size, and effects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.labels import label_marks
from reports.figures.numbers import power_of_ten
from reports.figures.plot import Plot
from reports.figures.style import STYLES, LineStyle, line_arguments, numbered, series_legend
from verification.finding import Table

Row = Mapping[str, Any]

NO_GAIN = "No method gained energy on these problems."
SOME_GAIN = "A method that gains energy is not safe to hold, however fast or accurate it is."
_METHODS = (
    "Each mark is one method on one problem; lower left is better. Marks at the very bottom mean none that double "
    "precision can show. Crosses at the upper rim are failures, after the time at which they were given up. "
)


@recipe("work-precision", "What a microsecond buys", "work_precision", section="accuracy", caption=_METHODS)
def work_precision(numbers: Table) -> Drawn:
    """Draw error, residual and energy gain against time, as far as there is any."""
    looks = {method: numbered(number) for number, method in enumerate(dict.fromkeys(numbers.column("method")))}
    found = {column: numbers.column(column) for column in ("relative error", "restitution residual",
             "relative energy gain") if column in numbers.keys}  # fmt: skip
    columns = [column for column, values in found.items() if any(value is not None and value > 0.0 for value in values)]
    panels = tuple(Panel(_methods(numbers, looks, column), f"{column} against time for {', '.join(looks)}.", column)
                   for column in columns)  # fmt: skip
    legend = tuple((method, replace(look, width=0.0)) for method, look in looks.items())
    return Drawn(panels, numbers, legend, _METHODS + (SOME_GAIN if "relative energy gain" in columns else NO_GAIN))


def _methods(numbers: Table, looks: Mapping[str, LineStyle], column: str) -> str:
    with Plot(f"work-precision-{column.split()[-1]}", (4.1, 3.2)) as plot:
        for method, look in looks.items():
            mine = numbers.where(method=method)
            plot.marks([(float(time), max(float(error), 1e-18)) for time, error in mine.select(("time", column)).rows
                        if None not in (time, error)], look, markersize=6)  # fmt: skip
            lost = mine.column("failed after") if "failed after" in mine.keys else []
            plot.lost([float(time) for time in lost if time is not None], look, 0.985)
        plot.log("time [µs]", column)
    return plot.svg


_ERRORS = {"position": "positions [lengths]", "velocity": "velocities [speeds]", "energy": "energy [kinetic]"}


@recipe(
    "trajectory-precision", "What accuracy of a whole motion costs", "haptic-rate/motions", section="haptic-rate",
    caption="Each mark is one run with one step, lower left is better; lines join the steps of a method. A curve that "
    "ends level has an error that no step mends: the model of contact decides, not the step. Crosses at the upper rim "
    "are runs that failed or would take too long. Marks at the very bottom: no error that double precision or the "
    "samples can show.",
)  # fmt: skip
def trajectory_precision(numbers: Table) -> Drawn:
    """A panel per scene and error."""
    legend = series_legend(tuple(dict.fromkeys(numbers.column("method"))))
    panels = tuple(
        Panel(_motions(numbers.where(scene=scene).records(), dict(legend), column, f"{number}-{column}"),
              f"{scene}: error of {label} against CPU time for {', '.join(dict(legend))}.", f"{scene}: {label}")
        for number, scene in enumerate(dict.fromkeys(numbers.column("scene"))) for column, label in _ERRORS.items()
    )  # fmt: skip
    return Drawn(panels, numbers, legend)


def _motions(rows: list[dict[str, Any]], looks: Mapping[str, LineStyle], column: str, key: str) -> str:
    with Plot(f"trajectory-precision-{key}", (4.1, 3.1)) as plot:
        for method, look in looks.items():
            here = [row for row in rows if row["method"] == method]
            plot.curve([(row["time"], max(row[column], 1e-9)) for row in here if row[column] is not None], look)
            plot.lost([row["time"] for row in here if row["outcome"] != "ok" and row["time"]], look, 0.98)
        plot.log("CPU time [ms]", f"error of {column}")
        plot.axes.axhline(1.0, **line_arguments(STYLES["bound"], marked=False) | {"alpha": 0.4, "linewidth": 0.8})
    return plot.svg


@recipe(
    "anytime", "Stopping an impact early", "haptic-rate/budgets", section="haptic-rate",
    caption="Plastic impacts stopped after so many rows, the largest unmet one first. What is not yet resolved falls "
    "with every row, and at the rank to rounding; the energy taken never exceeds what the whole impact takes, so no "
    "budget is unsafe.",
)  # fmt: skip
def anytime(numbers: Table) -> Drawn:
    """Residual and energy."""
    sizes: dict[str, list[Row]] = {}
    for row in numbers.records():
        name = f"{row['coordinates']} coordinates, {row['contacts']} contacts, rank {row['rank']}"
        sizes.setdefault(name, []).append(row)
    panels = (
        Panel(_budgets(sizes, "median residual", "log"), "Residual against the share of rows done.", "median residual"),
        Panel(_budgets(sizes, "share of the loss", "linear"), "Energy taken against the share of rows done.",
              "energy taken, of what the whole impact takes"),
    )  # fmt: skip
    return Drawn(panels, numbers, series_legend(tuple(sizes)))


def _budgets(sizes: Mapping[str, list[Row]], column: str, scale: str) -> str:
    with Plot(f"anytime-{column.split()[-1]}") as plot:
        for (_, look), rows in zip(series_legend(tuple(sizes)), sizes.values(), strict=True):
            plot.curve([(row["budget"] / row["rank"], max(row[column], 1e-17)) for row in rows], look)
        plot.axes.set(yscale=scale, xlabel="rows done, of the rank", ylabel=column)
        plot.axes.set_xlim(-0.02, 1.02)
    return plot.svg


_HELD = {"contacts": ("coordinates", 12), "coordinates": ("contacts", 60)}  # varied -> what is held, and at what
_FORMS = {"factored": STYLES["IAPB"], "gram_pinv": STYLES["PB"]}


@recipe(
    "impact-scaling", "How one impact's time grows", "haptic-rate/scaling", "haptic-rate/fitted", section="haptic-rate",
    caption="Medians with quartiles; thin lines are fitted powers. Every contact adds a row to the factored impact but "
    "no more work per row than the rank asks for; the pseudo-inverse of the printed formula is of a matrix of all "
    "contacts.",
)  # fmt: skip
def impact_scaling(numbers: Table, fitted: Table) -> Drawn:
    """Two panels."""
    powers = {(row["method"], row["axis"]): row["exponent"] for row in fitted.records()}
    panels = tuple(
        Panel(_growth(numbers, powers, axis), f"Time of one impact against the number of {axis}.",
              f"{axis}, with {held[1]} {held[0]}") for axis, held in _HELD.items()
    )  # fmt: skip
    return Drawn(panels, numbers, tuple(_FORMS.items()))


def _growth(numbers: Table, powers: Mapping[tuple[str, str], float], axis: str) -> str:
    held = dict([_HELD[axis]])
    with Plot(f"impact-scaling-{axis}") as plot:
        for method, look in _FORMS.items():
            rows = numbers.where(method=method, **held).select((axis, "time", "lower quartile", "upper quartile")).rows
            size, middle, low, high = (np.array(part) for part in zip(*sorted(rows), strict=True))
            plot.marks(zip(size, middle, strict=True), look)
            plot.axes.vlines(size, low, high, color=look.color, linewidth=1.0)
            power = powers[method, axis]
            level = np.exp(np.mean(np.log(middle) - power * np.log(size)))
            plot.axes.plot(size, level * size**power, color=look.color, linewidth=0.9)
            plot.axes.annotate(f"exponent {power + 0.0:.2f}".replace("-", "−"), (size[-1], middle[-1]),
                               textcoords="offset points", xytext=(-4, 7), ha="right", color=look.color)  # fmt: skip
        plot.log(axis, "time of one impact [µs]")
    return plot.svg


_NOTHING = 1e-4  # [mm] where an error of zero is drawn


@recipe(
    "effect-costs", "What leaving an effect out saves, and what it breaks", "effect_costs", section="effects",
    caption="Each mark is one effect left out of a scene that calls for it: to the right it saves time, upwards it "
    "takes the tool away from where it should be. Filled marks, joined: no other effect saves more for less error. "
    "Marks on the lowest line change nothing on this run; a few per cent to either side are within the noise of the "
    "clock.",
)  # fmt: skip
def effect_costs(numbers: Table) -> Drawn:
    """A panel per scene."""
    panels = tuple(_effects(scene, numbers.where(scene=scene).records())
                   for scene in dict.fromkeys(numbers.column("scene")))  # fmt: skip
    return Drawn(panels, numbers)


def _effects(scene: str, rows: list[dict[str, Any]]) -> Panel:
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    def places(best: bool | None = None) -> list[tuple[float, float]]:
        return [(row["time saved"], max(row["error"], _NOTHING)) for row in rows
                if best is None or best == (row["best of its error"] == "yes")]  # fmt: skip

    with Plot(f"effect-costs-{scene}", (4.6, 3.6)) as plot:
        plot.curve(sorted(places(True)), STYLES["IAPB"], linewidth=0.8)
        plot.marks(places(False), STYLES["cannot tell"])
        plot.axes.set(yscale="log", xlabel="time of the step saved [%]", ylabel="error [mm]")
        plot.axes.margins(x=0.35, y=0.12)
        plot.axes.yaxis.set_major_locator(LogLocator(numticks=8))
        plot.axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: power_of_ten(y) if y > _NOTHING else "none"))
        plot.axes.yaxis.set_minor_locator(NullLocator())
        label_marks(plot.axes, [row["effect"].replace("_", " ") for row in rows], places())
    names = ", ".join(row["effect"] for row in rows)
    return Panel(plot.svg, f"{scene}: error against time saved for {names}.", scene)

"""What accuracy costs in time: impact methods, whole motions, stopping early, growth with size, and effects."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.labels import SIZE, label_marks
from reports.figures.numbers import power_of_ten
from reports.figures.plot import Plot
from reports.figures.style import (
    BLUE,
    FORCE,
    MUTED,
    OUTCOMES,
    STYLES,
    LineStyle,
    line_arguments,
    looks_of,
)
from verification.cost.impacts import (
    CALLED,
    IAPB,
    LEMKE,
    LONGEST,
    NO_GAIN,
    PRINTED,
    QP,
    SWEEPS,
    by_way,
    choices,
    lost_to_rivals,
    short_time,
)
from verification.finding import Table

Row = Mapping[str, Any]

_LOOKS: dict[str, LineStyle] = {  # method -> its look, which has its name at the curve
    IAPB: STYLES["IAPB"], SWEEPS: STYLES["Gauss-Seidel"], LEMKE: STYLES["Lemke"],
    CALLED: STYLES["IAPB, Python"], PRINTED: STYLES["printed, numpy"], QP: STYLES["DAQP, Python"],
}
_SHADES = ((1e-9, 0.30), (1e-6, 0.20), (1e-3, 0.10))  # largest error -> shade of the cell


@recipe(
    "which-method", "Which method for my budget?", "work_precision", section="accuracy",
    caption="Find the row of your impact and the column of your time: the method that solves all of nine hard impacts "
    "of that size in time and without a gain of energy, or most of them, with the least of the largest errors (below "
    "1e-9 the fastest). Below its name: where it is stopped early, that error relative to |v⁻|, and how many of the "
    "nine end in time where not all do. Blue: below 1e-3, the darker the more exact; an error near 1 solves next to "
    "nothing. Compiled methods; the numbers name those to call from Python. The nine: M of condition 1, 1e3 and 1e6, "
    "rows apart by 1, 1e-3 and 1e-6 of themselves, e = 0, 1/2 and 1; d is the number of coordinates.",
)  # fmt: skip
def which_method(numbers: Table) -> Drawn:
    """A cell per size and budget."""
    found = choices(numbers)
    sizes = list(dict.fromkeys(found.select(("contacts", "coordinates")).rows))
    budgets = list(dict.fromkeys(found.column("budget")))
    with Plot("which-method", (6.8, 0.46 * len(sizes) + 0.7)) as plot:
        for row in found.records():
            x, y = budgets.index(row["budget"]), sizes.index((row["contacts"], row["coordinates"]))
            largest = row["largest error"]
            shade = next((shade for most, shade in _SHADES if largest is not None and largest <= most), 0.0)
            plot.axes.fill_between((x - 0.48, x + 0.48), y - 0.46, y + 0.46, color=BLUE, alpha=shade, linewidth=0)
            plot.axes.text(x, y - 0.2, row["method"], ha="center", va="center", fontsize=8.5)
            if largest is not None:
                plot.axes.text(x, y + 0.2, _cell_note(row), ha="center", va="center", fontsize=7.0)
        plot.without_lines()
        plot.axes.set_xticks(range(len(budgets)), [short_time(1e-6 * budget) for budget in budgets])
        plot.axes.xaxis.tick_top()
        plot.axes.set_yticks(range(len(sizes)), [f"{c} contact{'s' * (c > 1)}, d = {d}" for c, d in sizes])
        plot.axes.set(xlim=(-0.5, len(budgets) - 0.5), ylim=(len(sizes) - 0.5, -0.5))
        plot.axes.tick_params(length=0)
    told = "; ".join(f"{row['contacts']} contacts in {row['budget']:g} µs: {row['method']}"
                     for row in found.records())
    return Drawn((Panel(plot.svg, told, wide=True),), found)


def _cell_note(row: Row) -> str:
    stopped = f"{row['work']}: " if row["work"][0].isdigit() else ""
    share = "" if row["share solved"] > 99 else f", {row['share solved']:.0f} %"
    return f"{stopped}{power_of_error(row['largest error'])}{share}"


def power_of_error(value: float) -> str:
    """An error in a few characters: 7e-14."""
    return f"{value:.0e}".replace("e-0", "e-") if value < 0.1 else f"{value:.1f}"


_MARKS = (
    "Lower left is better. Each mark is the median of nine hard impacts of that size, the thin line above it reaches "
    "to the largest error; a curve joins what stopping early buys (IAPB after 1, 2, 4 ... rows, Gauss-Seidel after 1, "
    "4, 16 ... sweeps). Filled: compiled; empty: called from Python. The grey steps join what no other method beats in "
    "both. A red ring: it made energy in some of the nine; a cross at the rim: it failed on some, or took more than "
    "10 ms. "
)


@recipe(
    "impact-accuracy", "What a microsecond buys", "work_precision", section="accuracy",
    caption=_MARKS,
)  # fmt: skip
def impact_accuracy(numbers: Table) -> Drawn:
    """A panel per size."""
    sizes = dict.fromkeys(numbers.select(("contacts", "coordinates")).rows)
    panels = tuple(
        Panel(_impacts(numbers.where(contacts=c, coordinates=d), f"impact-accuracy-{c}"),
              f"Error against time with {c} contacts on {d} coordinates for {', '.join(_LOOKS)}.",
              f"{c} contact{'s' * (c > 1)}, {d} coordinates") for c, d in sizes)  # fmt: skip
    lost = lost_to_rivals(numbers)
    said = ""
    for c in dict.fromkeys(lost.column("contacts")):
        here = lost.where(contacts=c).records()
        best = max(here, key=lambda row: float(row["ratio"]))
        cases = len({row["problem"] for row in here})
        said += (f"At {c} contact{'s' * (c > 1)} {best['solver']} is up to {best['ratio']:.2g} times as fast as IAPB "
                 f"(compiled, {cases} of 9 impacts): it neither orders rows nor proves that no energy is made. ")
    said = said or "No compiled complementarity solver is as exact as IAPB in less time at any of these sizes."
    return Drawn(panels, numbers, tuple((look.name, look) for look in _LOOKS.values()),
                 _MARKS + said)


def _impacts(numbers: Table, key: str) -> str:
    with Plot(key, (4.1, 3.2)) as plot:
        names, ends, front = [], [], []
        for method, look in _LOOKS.items():
            points = []
            for rows in by_way(numbers.where(method=method)).values():
                good = [row for row in rows if row["outcome"] == "ok"]
                lost = [row["failed after"] for row in rows if row["outcome"] != "ok"]
                if lost:
                    plot.lost([min(float(np.median(lost)), 1e6 * LONGEST)], look, 0.985)
                if len(good) < len(rows) / 2:
                    continue
                time = float(np.median([row["time"] for row in good]))
                errors = [max(row["relative error"], 1e-17) for row in good]
                middle = float(np.median(errors))
                points.append((time, middle))
                plot.axes.vlines(time, middle, max(errors), color=look.color, linewidth=0.7, alpha=0.6)
                if any(row["relative energy gain"] > NO_GAIN for row in good):
                    plot.axes.plot(time, middle, "o", markersize=9, markerfacecolor="none", markeredgecolor=FORCE)
            front += points
            points.sort()
            plot.curve(points, look)
            if points:
                names.append(look.name)
                ends.append(points[-1])
        steps, least = [], np.inf
        for time, error in sorted(front):
            if error < least:
                steps += [(time, least), (time, error)] if np.isfinite(least) else [(time, error)]
                least = error
        if steps:
            plot.axes.plot(*zip(*steps, (1e6 * LONGEST, least), strict=True), color=MUTED, linewidth=3, alpha=0.25)
        plot.log("time of one impact [µs]", "relative error", xlim=(0.05, 2e4), ylim=(1e-17, 10.0))
        label_marks(plot.axes, names, ends)
    return plot.svg


_TOLERANCES = (1e-3, 1e-6, 1e-9)


@recipe(
    "budget-share", "How many hard impacts a budget solves", "work_precision", section="accuracy",
    caption="Higher and further left is better: of the 54 hard impacts of all sizes, the share that a method has "
    "solved to the given error, without making energy, when the budget is over. A curve that ends below 100 % fails on "
    "the rest whatever the time: it stays too inexact, makes energy, finds no solution or needs more than 10 ms.",
)  # fmt: skip
def budget_share(numbers: Table) -> Drawn:
    """A panel per tolerance."""
    panels = tuple(Panel(_share(numbers, error), f"Share of impacts solved to {error:g} against time for "
                         f"{', '.join(_LOOKS)}.", f"error below {power_of_error(error)}")
                   for error in _TOLERANCES)  # fmt: skip
    return Drawn(panels, None, tuple((look.name, look) for look in _LOOKS.values()))


def _share(numbers: Table, tolerance: float) -> str:
    cases = len(set(numbers.select(("contacts", "problem")).rows))
    with Plot(f"budget-share-{power_of_error(tolerance)}", (4.1, 3.0)) as plot:
        ends: list[tuple[float, str, LineStyle]] = []
        for method, look in _LOOKS.items():
            first: dict[tuple[int, str], float] = {}
            for row in numbers.where(method=method, outcome="ok").records():
                if row["relative error"] <= tolerance and row["relative energy gain"] <= NO_GAIN:
                    case = row["contacts"], row["problem"]
                    first[case] = min(row["time"], first.get(case, np.inf))
            times = sorted(first.values())
            heights = [100.0 * k / cases for k in range(len(times) + 1)]
            plot.axes.step([0.05, *times, 1e6 * LONGEST], [*heights, heights[-1]], where="post",
                           **line_arguments(look, marked=False))
            ends.append((heights[-1], f"{look.name} {heights[-1]:.0f} %", look))
        plot.log("time budget [µs]", "impacts solved [%]", "x", xlim=(0.05, 1e8 * LONGEST), ylim=(0, 104))
        plot.axes.set_yticks(range(0, 101, 20), [str(height) for height in range(0, 101, 20)])
        plot.axes.set_xticks([10.0**k for k in range(-1, 5)])
        place = np.inf
        for height, name, look in sorted(ends, key=lambda end: -end[0]):
            place = min(height, place - 6.5)
            plot.axes.text(1.2e6 * LONGEST, place, name, fontsize=SIZE, color=look.color, va="center")
    return plot.svg


_MOTION_ERRORS = {"position": "error of position [lengths]", "energy made": "energy made [kinetic]"}
_MOTIONS = {  # at most six curves; the numbers have all
    "IAPB, semi-implicit Euler": STYLES["IAPB, Euler"], "IAPB, Runge-Kutta 4": STYLES["IAPB, RK4"],
    "PB, semi-implicit Euler": STYLES["PB, Euler"], "rigid (QP per step)": STYLES["rigid, QP per step"],
    "MuJoCo": STYLES["MuJoCo"], "Drake": STYLES["Drake"],
}


@recipe(
    "trajectory-precision", "What accuracy of a whole motion costs", "haptic-rate/motions", "haptic-rate/worth",
    section="accuracy",
    caption="Lower left is better: each mark is one run with one step, a line joins the steps of a method. A curve "
    "that ends level has an error that no step mends: the model of contact decides, not the step. Beside it the most "
    "by which the energy of the bodies exceeded that at the start; marks at the bottom made none. Crosses at the upper "
    "rim are runs that failed or would take too long. The numbers say what ten times the accuracy costs each method.",
)  # fmt: skip
def trajectory_precision(numbers: Table, worth: Table) -> Drawn:
    """Two panels per scene: error, and energy made."""
    looks = {name: _MOTIONS[name] for name in dict.fromkeys(numbers.column("method")) if name in _MOTIONS}
    panels = tuple(
        Panel(_motions(numbers.where(scene=scene).records(), looks, column, f"{number}-{column.split()[-1]}"),
              f"{scene}: {label} against computing time for {', '.join(looks)}.", f"{scene}: {label}")
        for number, scene in enumerate(dict.fromkeys(numbers.column("scene")))
        for column, label in _MOTION_ERRORS.items()
    )  # fmt: skip
    return Drawn(panels, worth, tuple((look.name, look) for look in looks.values()))


def _motions(rows: list[dict[str, Any]], looks: Mapping[str, LineStyle], column: str, key: str) -> str:
    with Plot(f"trajectory-precision-{key}", (4.1, 2.9)) as plot:
        for method, look in looks.items():
            here = [row for row in rows if row["method"] == method]
            points = [(row["time"], max(row[column], 1e-9)) for row in here if row[column] is not None and row["time"]]
            plot.curve(points, look)
            plot.lost([row["time"] for row in here if row["outcome"] != "ok" and row["time"]], look, 0.98)
        plot.log("computing time [ms per simulated second]", _MOTION_ERRORS[column], ylim=(5e-10, 10.0))
    return plot.svg


@recipe(
    "anytime", "What each row of the budget buys", "haptic-rate/budgets", section="accuracy",
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
    return Drawn(panels, numbers, tuple(looks_of(sizes).items()))


def _budgets(sizes: Mapping[str, list[Row]], column: str, scale: str) -> str:
    with Plot(f"anytime-{column.split()[-1]}") as plot:
        for look, rows in zip(looks_of(sizes).values(), sizes.values(), strict=True):
            plot.curve([(row["budget"] / row["rank"], max(row[column], 1e-17)) for row in rows], look)
        plot.axes.set(yscale=scale, xlabel="rows done, of the rank", ylabel=column)
        plot.axes.set_xlim(-0.02, 1.02)
    return plot.svg


_HELD = {"contacts": ("coordinates", 12), "coordinates": ("contacts", 60)}  # varied -> what is held, and at what
_FORMS = {"factored": STYLES["factored"], "gram_pinv": STYLES["gram_pinv"]}


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


@recipe(
    "effect-steps", "What a step takes, and which effects take it", "effect_steps", "machine", section="effects",
    caption="",
)  # fmt: skip
def effect_steps(numbers: Table, machine: str) -> Drawn:
    """A bar per scene, a mark where every switch is on, and the shares in words."""
    rows = numbers.records()[::-1]
    places, longest = range(len(rows)), max(row["all on"] for row in rows)
    with Plot("effect-steps", (6.8, 0.3 * len(rows) + 0.6)) as plot:
        axes = plot.axes
        axes.barh(places, [row["step"] for row in rows], height=0.5, color=BLUE, alpha=0.45)
        axes.plot([row["all on"] for row in rows], places, "|", color=FORCE, markersize=11, markeredgewidth=2)
        for place, row in zip(places, rows, strict=True):
            largest = ", ".join(row["shares of the step"].split(", ")[:3])
            axes.text(1.8 * longest, place, largest, va="center", fontsize=7.0, color=MUTED).set_in_layout(False)
        plot.log("time of a step [µs]", "", "x", xlim=(0.1, 4e4 * longest), ylim=(-0.6, len(rows) - 0.4))
        axes.grid(visible=False)
        axes.set_xticks([10.0**k for k in range(-1, int(np.log10(longest)) + 1)])
        axes.set_yticks(places, [row["scene"].replace("_", " ") for row in rows])
    told = "; ".join(f"{row['scene']} {row['step']:.2g} µs, with all on {row['all on']:.2g} µs" for row in rows[::-1])
    return Drawn((Panel(plot.svg, told, wide=True),), numbers, caption=(
        "Bar: a recorded step of the scene in the world IAPB, with the effects that it calls for. Red mark: the same "
        "with every switch of the step on; the effects added find nothing to do. The way from bar to mark is what a "
        "scene saves by what it does not ask for. Right: how much less the step takes without one effect, the three "
        "largest (the numbers have all); below the noise of nine rounds none is given. Shares need not add up: without "
        f"its hand force, say, a tool touches nothing. The time of a step is measured here alone: {machine}."))


_NOTHING = 1e-4  # [mm] where an error of zero is drawn


@recipe(
    "effect-costs", "What leaving an effect out saves, and what it breaks", "effect_costs", section="effects",
    caption="Each mark is one effect left out of a scene that calls for it: to the right it saves time, upwards it "
    "takes the tool away from where it should be. Filled marks, joined: no other effect saves more for less error. "
    "Marks on the lowest line change nothing on this run; those at 0 % save less than the noise of the clock.",
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
        plot.marks(places(False), OUTCOMES["cannot tell"])
        plot.axes.set(yscale="log", xlabel="time of the step saved [%]", ylabel="error [mm]")
        plot.axes.margins(x=0.35, y=0.12)
        plot.axes.yaxis.set_major_locator(LogLocator(numticks=8))
        plot.axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: power_of_ten(y) if y > _NOTHING else "none"))
        plot.axes.yaxis.set_minor_locator(NullLocator())
        label_marks(plot.axes, [row["effect"].replace("_", " ") for row in rows], places())
    names = ", ".join(row["effect"] for row in rows)
    return Panel(plot.svg, f"{scene}: error against time saved for {names}.", scene)

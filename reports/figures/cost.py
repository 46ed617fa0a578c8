"""Accuracy against computing time: impact methods, whole motions, row budgets, growth with size,
and effects."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from markupsafe import Markup

from reports.figures.figure import Drawn, Panel, cell, grid, recipe, swatch
from reports.figures.numbers import power_of_ten
from reports.figures.plot import Plot, note
from reports.figures.style import (
    BLUE,
    FORCE,
    INK,
    MUTED,
    OUTCOMES,
    STYLES,
    LineStyle,
    line_arguments,
    looks_of,
)
from verification.claims.speed import costs_more
from verification.cost import accuracy
from verification.cost import trajectories as motion
from verification.cost.calls import PRINTED
from verification.cost.growth import FACTORED
from verification.cost.steps import IDEAL
from verification.table import Table

Row = Mapping[str, Any]

_LOOKS: dict[str, LineStyle] = {  # method -> its look, which has its name at the curve
    accuracy.IAPB: STYLES["IAPB"],
    accuracy.SWEEPS: STYLES["Gauss-Seidel"],
    accuracy.LEMKE: STYLES["Lemke"],
    accuracy.CALLED: STYLES["IAPB, Python"],
    PRINTED: STYLES["printed, numpy"],
    accuracy.QP: STYLES["DAQP, Python"],
}
_LEGEND = {look.name: look for look in _LOOKS.values()}
_EXACT, _STRONG, _WEAK = (
    1e-9,
    0.42,
    0.16,
)  # largest error of a strongly coloured cell; strengths of colours
_LONGEST = 1e6 * accuracy.LONGEST  # [µs]


@recipe("which-method", "work_precision")
def which_method(numbers: Table) -> Drawn:
    """Draw a cell per size and budget."""
    found = accuracy.choices(numbers)
    cells: dict[str, list[Markup]] = {}
    for row in found.records():
        words, look = "", (MUTED, 0.0)
        if row["method"] != "none":
            look = _LOOKS[row["method"]].color, _STRONG if row["largest error"] <= _EXACT else _WEAK
            stopped = f"{row['work']}: " if row["work"][0].isdigit() else ""
            share = "" if row["share solved"] > 99 else f", {0.09 * row['share solved']:.0f} of 9"
            words = f"{stopped}error {power_of_error(row['largest error'])}{share}"
        elif row["nearest"]:
            words = f"nearest: error {row['nearest'].split(':')[-1].strip()}"
        cells.setdefault(f"{_contacts(row)}, d = {row['coordinates']}", []).append(
            cell(row["method"], words, *look)
        )
    told = "; ".join(
        f"{row['contacts']} contacts in {row['budget']:g} µs: {row['method']}"
        for row in found.records()
    )
    budgets = [
        accuracy.short_time(1e-6 * budget) for budget in dict.fromkeys(found.column("budget"))
    ]
    return Drawn([Panel(grid(budgets, cells), told, wide=True)], found)


def power_of_error(value: float) -> str:
    """Return an error in a few characters, such as 7e-14."""
    return f"{value:.0e}".replace("e-0", "e−").replace("-", "−") if value < 0.1 else f"{value:.1f}"


def _contacts(row: Row) -> str:
    return f"{row['contacts']} contact{'s' * (row['contacts'] > 1)}"


@recipe("where-iapb-loses", "C22/C22", "work_precision")
def where_iapb_loses(kernels: Table, numbers: Table) -> Drawn:
    """Draw the time of a rival relative to IAPB's over the contacts, compiled and called from
    Python."""
    compiled = looks_of(kernels.column("problem"))
    looks = {
        f"Lemke, {name}": replace(look, color=STYLES["Lemke"].color, name=f"Lemke, {name}")
        for name, look in compiled.items()
    }
    called = replace(STYLES["DAQP, Python"], name="DAQP, hard impacts from Python")
    curves: list[tuple[LineStyle, list[Row]]] = [(called, list(_times_of_daqp(numbers)))]
    curves += [
        (look, [row for row in kernels.where(problem=name).records() if row["ratio"] is not None])
        for name, look in zip(compiled, looks.values(), strict=True)
    ]
    ratios = [row["ratio"] for _, rows in curves for row in rows]
    said = "".join(_lost_on(name, kernels.where(problem=name)) for name in compiled)
    with Plot("where-iapb-loses", (4.9, 3.1)) as plot:
        plot.axes.axhline(1.0, color=INK, linewidth=0.9)
        plot.axes.axhspan(1e-2, 1.0, color=FORCE, alpha=0.07, linewidth=0)
        for look, rows in curves:
            plot.curve([(row["contacts"], row["ratio"]) for row in rows], look)
            plot.axes.vlines(
                [row["contacts"] for row in rows],
                [row["lower quartile"] for row in rows],
                [row["upper quartile"] for row in rows],
                color=look.color,
                linewidth=1.0,
            )
        note(
            plot.axes,
            (0.01, 0.04),
            "IAPB loses",
            xycoords="axes fraction",
            ha="left",
            va="bottom",
            color=FORCE,
        )
        plot.log(
            "contacts",
            "time of the rival / time of IAPB",
            ylim=(0.5 * min(ratios), 2.0 * max(ratios)),
        )
        plot.ticks("y", [0.1, 0.2, 0.5, 1.0, 2.0, 10.0, 100.0])
        plot.ticks("x", [1, 4, 16, 64, 300, 1000])
    alt = "Below the line at 1 IAPB is slower. " + said
    panels = [
        Panel(plot.svg, alt.strip()),
        Panel(*_lost_on_hard_impacts(numbers), "hard impacts", wide=True),
    ]
    faster = [
        str(row["contacts"]) for row in _times_of_daqp(numbers, accuracy.IAPB) if row["ratio"] < 1.0
    ]
    return Drawn(
        panels,
        kernels,
        {**looks, called.name: called},
        {
            "families": said.strip(),
            "python": f"With {' and '.join(faster)} contacts DAQP from Python is faster even "
            "than compiled IAPB (median)."
            if faster
            else "DAQP from Python is slower than compiled IAPB at every size.",
        },
    )


def _times_of_daqp(numbers: Table, ours_by: str = accuracy.CALLED) -> Iterator[Row]:
    """Yield the time of DAQP from Python over that of a method of IAPB, on the hard impacts that
    both resolve."""
    for c in dict.fromkeys(numbers.column("contacts")):
        ours, theirs = (
            {
                row["problem"]: row["time"]
                for row in numbers.where(
                    contacts=c, method=method, work=work, outcome="ok"
                ).records()
            }
            for method, work in ((ours_by, "all rows"), (accuracy.QP, "active set"))
        )
        if ratios := [theirs[problem] / ours[problem] for problem in ours.keys() & theirs.keys()]:
            low, middle, high = (float(each) for each in np.quantile(ratios, (0.25, 0.5, 0.75)))
            yield {"contacts": c, "ratio": middle, "lower quartile": low, "upper quartile": high}


def _lost_on(name: str, kernels: Table) -> str:
    """Say for how many sizes of one family IAPB clearly costs more, and by which factor at
    worst."""
    slower = [row for row in kernels.records() if costs_more(row) is False]
    where = f"On the {name.split()[-1]}"
    if not slower:
        return f"{where} IAPB is never clearly slower. "
    worst = 1.0 / min(row["ratio"] for row in slower)
    return f"{where} Lemke is clearly faster at {len(slower)} of {len(kernels.rows)} sizes (up to {worst:.2g} times). "


def _lost_on_hard_impacts(numbers: Table) -> tuple[str, str]:
    """Return a table of the fastest rival by number of contacts, compiled and called from Python,
    and its text."""
    heads = {
        accuracy.COMPILED: "fastest compiled solver",
        accuracy.PYTHON: "fastest solver from Python",
    }
    lines: dict[str, list[str]] = {}
    for called in heads:
        lost = accuracy.lost_to_rivals(numbers, called)
        for c in dict.fromkeys(numbers.column("contacts")):
            here, cases = (
                lost.where(contacts=c),
                set(numbers.where(called=called, contacts=c).column("problem")),
            )
            best = max(here.records(), key=lambda row: float(row["ratio"]), default=None)
            told = (
                "none is faster"
                if best is None
                else (
                    f"{best['solver']}: up to {best['ratio']:.2g} times as fast; IAPB loses on "
                    f"{len(set(here.column('problem')))} of {len(cases)} impacts"
                )
            )
            lines.setdefault(_contacts({"contacts": c}), []).append(told)
    words = "; ".join(
        f"{size}: " + ", ".join(map("{}: {}".format, heads.values(), said))
        for size, said in lines.items()
    )
    titles = tuple(f"{head}, compared with IAPB" for head in heads.values())
    return grid(titles, {size: [*map(cell, said)] for size, said in lines.items()}, "plain"), words


@recipe("impact-accuracy", "work_precision")
def impact_accuracy(numbers: Table) -> Drawn:
    """Draw a panel for each of four sizes; with one contact every method is exact, so there is
    nothing to draw."""
    panels = []
    for c, d in [*dict.fromkeys(numbers.select(("contacts", "coordinates")).rows)][1:5]:
        with Plot(f"impact-accuracy-{c}", (3.3, 3.2)) as plot:
            for method, look in _LOOKS.items():
                here = numbers.where(contacts=c, coordinates=d, method=method)
                plot.curve(sorted(_accuracies(plot, here, look)), look)
            plot.log("time of one impact [µs]", "largest relative error", ylim=(1e-16, 30.0))
            low, high = plot.axes.get_xlim()
            plot.axes.set(xlim=(low / 2.0, 2.0 * high))
        alt = f"Error against time with {c} contacts on {d} coordinates for {', '.join(_LOOKS)}."
        panels.append(Panel(plot.svg, alt, f"{c} contacts, {d} coordinates"))
    return Drawn(panels, numbers, _LEGEND)


def _accuracies(plot: Plot, measured: Table, look: LineStyle) -> Iterator[tuple[float, float]]:
    """Yield the median time and the largest error of each amount of work; draw gains of energy and
    failures."""
    for rows in accuracy.by_way(measured).values():
        good = [row for row in rows if row["outcome"] == "ok"]
        lost = [row["failed after"] for row in rows if row["outcome"] != "ok"]
        if lost:
            plot.lost([min(float(np.median(lost)), _LONGEST)], look, 0.985)
        if len(good) < len(rows) / 2:
            continue
        time = float(np.median([row["time"] for row in good]))
        error = max(max(row["relative error"] for row in good), 1e-15)
        if any(row["relative energy gain"] > accuracy.NO_GAIN for row in good):
            plot.axes.plot(
                time, error, "o", markersize=9, markerfacecolor="none", markeredgecolor=FORCE
            )
        yield time, error


def _draw_front(plot: Plot, points: Iterable[tuple[float, float]]) -> None:
    """Draw grey steps through the points that no other point beats in both time and error."""
    steps, least = list[tuple[float, float]](), np.inf
    for time, error in sorted(points):
        if error < least:
            steps += [(time, least), (time, error)] if np.isfinite(least) else [(time, error)]
            least = error
    plot.curve(steps, _FRONT, marked=False, alpha=0.25)


_WORLDS = {
    "IAPB": STYLES["IAPB"],
    "PB": STYLES["PB"],
    IDEAL: STYLES["ideal, Python"],
    "MuJoCo": replace(STYLES["MuJoCo"], filled=False),
}
_FRONT = LineStyle(MUTED, "", (), 3.0)  # in the legend alone; `_draw_front` draws it
_HEADINGS = (
    "called",
    "time for a tenth of the error: median, range (scenes with a fit)",
    "smallest error, median",
    "best for its time (grey): scenes, errors",
    "largest energy gain, relative to the kinetic energy",
)
_NEVER = "in no scene"
_FAST = 100.0  # [ms per simulated second] ten times as fast as the motion
_PALE = 0.45  # strength of marks that are not used


@recipe("trajectory-precision", "haptic-rate/motions")
def trajectory_precision(motions: Table) -> Drawn:
    """Draw what a motion costs by world: a table, and a panel for each scene."""
    looks = {name: look for name, look in _WORLDS.items() if name in motions.column("method")}
    found, worth = motion.curves(motions), motion.worth(motions)
    told, table = [], dict[str, Sequence[Markup]]()
    for row in worth.records():
        step = max(
            (run["energy made"], run["step"])
            for curve in found
            for run in curve.runs
            if curve.method == row["method"]
        )[1]
        look, words = looks[row["method"]], _worth_said(row, step)
        told.append(f"{look.name}: " + ", ".join(map("{}: {}".format, _HEADINGS, words)))
        table[Markup("{} {}").format(swatch(look), look.name)] = [
            cell(Markup("<b>{}</b>").format(said) if said == _NEVER else said) for said in words
        ]
    panels = [Panel(grid(_HEADINGS, table, "plain"), "; ".join(told), wide=True)]
    for number, scene in enumerate(dict.fromkeys(motions.column("scene"))):
        here = [curve for curve in found if curve.scene == scene]
        said = ", ".join(f"{looks[curve.method].name}: {curve.words}" for curve in here)
        lost = motions.only(outcome != "ok" for outcome in motions.column("outcome")).where(
            scene=scene
        )
        panels.append(
            Panel(
                _motions(f"trajectory-precision-{number}", here, lost, looks),
                f"{scene}: error of position against computing time. {said}.",
                f"{scene}. Smallest error{_nearest(here, looks)}",
            )
        )
    return Drawn(
        panels, worth, {look.name: look for look in looks.values()} | {"best for its time": _FRONT}
    )


def _nearest(here: Sequence[motion.Curve], looks: Mapping[str, LineStyle]) -> str:
    """Name the method with the smallest error among the runs ten times as fast as the motion, and
    among all runs."""
    runs = [
        (run["position"], run["time"], looks[curve.method].name)
        for curve in here
        for run in curve.runs
        if not motion.by_chance(run)
    ]
    fast, best = min((run for run in runs if run[1] <= _FAST), default=None), min(runs)
    at_once = (
        f" with at most {_FAST:g} ms of computing per simulated second: {power_of_error(fast[0])} "
        f"({fast[2]}); "
        "without this limit"
        if fast and fast != best
        else ""
    )
    return f"{at_once}: {power_of_error(best[0])} ({best[2]})"


def _worth_said(row: Row, step: float) -> tuple[str, ...]:
    """Return a line of the table of main numbers, a text for each column; `step` [ms] made the most
    energy."""
    scenes = row["scenes"]
    cost = (
        "no time step helps: the error does not fall"
        if row["error stays"] == scenes
        else "too few runs for a fit"
    )
    if row["scenes fitted"]:
        typical, *ends = (
            motion.times(row[key])
            for key in ("tenfold accuracy costs", "least cost", "largest cost")
        )
        span = f" ({' to '.join(ends)})" if row["scenes fitted"] > 1 else ""
        cost = f"{typical} the time{span}; {row['scenes fitted']} of {scenes}"
    best = (
        f"undecided: finer steps too slow in {row['cut short']} of {scenes} scenes"
        if row["cut short"]
        else _NEVER
    )
    if row["best for its time"]:
        errors = dict.fromkeys(
            power_of_error(row[key]) for key in ("most exact there", "least exact there")
        )
        best = f"{row['best for its time']} of {scenes} scenes, {' to '.join(errors)}"
    made = "none"
    if row["energy made"] > accuracy.NO_GAIN:
        made = f"{100 * row['energy made']:.2g} %, at a step of {step:g} ms"
    return row["called"], cost, power_of_error(row["least error"]), best, made


def _motions(
    key: str, here: Sequence[motion.Curve], lost: Table, looks: Mapping[str, LineStyle]
) -> str:
    def places(runs: Iterable[dict[str, Any]]) -> list[tuple[float, float]]:
        return [(run["time"], run["position"]) for run in runs if not motion.by_chance(run)]

    floor = 0.2 * min(curve.least for curve in here)
    with Plot(key, (4.1, 3.1)) as plot:
        _draw_front(plot, {(run["time"], run["position"]) for curve in here for run in curve.front})
        for curve in here:
            look = looks[curve.method]
            bare = replace(look, name="")
            plot.curve(places(curve.runs), replace(look, width=0.8), marked=False)
            plot.marks(places(curve.used), bare, markersize=5.5)
            plot.marks(places(curve.left_out), bare, markersize=3.8, alpha=_PALE)
            if curve.cost is not None:  # the fitted power law over the range of the fitted runs
                time, error = (np.log10(column) for column in zip(*places(curve.used), strict=True))
                ends = np.array([time.min(), time.max()])
                heights = error.mean() - (ends - time.mean()) / np.log10(curve.cost)
                plot.axes.plot(
                    10.0**ends, 10.0**heights, color=look.color, linewidth=1.8, alpha=0.6
                )
            plot.words[look.name] = f": {curve.words}"
            plot.lost(
                [time for time in lost.where(method=curve.method).column("time") if time],
                look,
                0.98,
            )
        plot.log(
            "computing time [ms per simulated second]",
            "error of position [lengths]",
            ylim=(floor, 30.0),
        )
    return plot.svg


@recipe("anytime", "haptic-rate/budgets")
def anytime(numbers: Table) -> Drawn:
    """Draw what is left to do after each share of the rows: a panel for the velocity and one for
    the energy."""
    sizes: dict[str, list[Row]] = {}
    for row in numbers.records():
        sizes.setdefault(f"{row['contacts']} contacts", []).append(row)
    looks, panels, ranges = looks_of(sizes), [], {}
    for key, name, alt, label in (
        (
            "velocity",
            "residual left [%]",
            "Residual left against the share of rows done.",
            "largest residual after the impact, relative to that before it",
        ),
        (
            "energy",
            "energy loss missing [%]",
            "Missing loss against the share of rows done.",
            "missing part of the energy that the complete impact takes",
        ),
    ):
        halves = []
        with Plot(f"anytime-{key}") as plot:
            plot.axes.axvspan(49.0, 51.0, color=MUTED, alpha=0.2, linewidth=0)
            for size, rows in sizes.items():
                done = [100.0 * row["budget"] / row["rank"] for row in rows]
                left = [
                    100.0
                    * (
                        row["median residual"] / rows[0]["median residual"]
                        if key == "velocity"
                        else 1.0 - row["share of the loss"]
                    )
                    for row in rows
                ]
                halves.append(float(f"{np.interp(50.0, done, left):.2g}"))
                plot.curve(zip(done, left, strict=True), looks[size])
                plot.words[size] = f": {halves[-1]:g} % after half"
            plot.axes.set(
                xlabel="rows done when time runs out [%]",
                ylabel=name,
                xlim=(-2, 102),
                ylim=(-3, 105),
            )
        ranges[key] = f"{min(halves):g} to {max(halves):g} %"
        panels.append(Panel(plot.svg, alt, label))
    needed = ", ".join(f"{rows[0]['rank']} for {name}" for name, rows in sizes.items())
    gained = sum(row["largest relative gain"] > 0.0 for row in numbers.records())
    return Drawn(
        panels,
        numbers,
        looks,
        {"needed": needed, "gained": gained or "None", "budgets": len(numbers.rows), **ranges},
    )


_HELD = {
    "contacts": ("coordinates", 12),
    "coordinates": ("contacts", 60),
}  # varied -> what is held, and at what
_FORMS = {FACTORED: STYLES["factored"], PRINTED: STYLES["printed, numpy"]}


@recipe("impact-scaling", "haptic-rate/scaling", "haptic-rate/fitted")
def impact_scaling(numbers: Table, fitted: Table) -> Drawn:
    """Draw the time over the number of contacts and over the number of coordinates."""
    powers = {(row["method"], row["axis"]): row for row in fitted.records()}
    panels = []
    for axis, (other, count) in _HELD.items():
        with Plot(f"impact-scaling-{axis}") as plot:
            for method, look in _FORMS.items():
                mine = numbers.where(method=method, **{other: count})
                rows = sorted(mine.select((axis, "time", "lower quartile", "upper quartile")).rows)
                size, middle, low, high = (np.array(part) for part in zip(*rows, strict=True))
                plot.marks(zip(size, middle, strict=True), look)
                plot.axes.vlines(size, low, high, color=look.color, linewidth=1.0)
                power = (row := powers[method, axis])["exponent"]
                level = np.exp(np.mean(np.log(middle) - power * np.log(size)))
                plot.axes.plot(size, level * size**power, color=look.color, linewidth=0.9)
                plot.words[look.name] = (
                    f": exponent {power:.2f}, {row['there']:.2f} from {row['steepest from']:g} to "
                    f"{row['to']:g}"
                )
            plot.log(axis, "time of one impact [µs]")
        panels.append(
            Panel(
                plot.svg,
                f"Time of one impact against the number of {axis}.",
                f"{axis}, with {count} {other}",
            )
        )
    return Drawn(panels, numbers, {look.name: look for look in _FORMS.values()})


@recipe("effect-steps", "effect_steps", "machine")
def effect_steps(numbers: Table, machine: str) -> Drawn:
    """Draw for each scene a dot, a mark for the time with every effect on, and the largest savings
    as text."""
    rows = sorted(numbers.records(), key=lambda row: -float(row["step"]))
    places, longest, height = (
        range(len(rows)),
        max(row["all on"] for row in rows),
        0.27 * len(rows) + 0.8,
    )
    with Plot(
        "effect-steps", (8.6, height), frames=[(0.225, 0.5 / height, 0.19, 1.0 - 0.5 / height)]
    ) as plot:
        axes = plot.axes
        axes.hlines(
            places,
            [row["step"] for row in rows],
            [row["all on"] for row in rows],
            color=FORCE,
            linewidth=1,
        )
        axes.plot(
            [row["all on"] for row in rows],
            places,
            "|",
            color=FORCE,
            markersize=9,
            markeredgewidth=2,
        )
        axes.plot([row["step"] for row in rows], places, "o", color=BLUE, markersize=5)
        how = {"fontsize": 7.5, "transform": axes.get_yaxis_transform()}
        for place, row in zip(places, rows, strict=True):
            axes.text(
                1.06,
                place,
                ", ".join(row["shares of the step"].split(", ")[:3]),
                va="center",
                color=INK,
                **how,
            )
        axes.text(
            1.06,
            len(rows) - 0.4,
            "saved by leaving out one effect: share of the step (and time)",
            va="bottom",
            color=MUTED,
            **how,
        )
        plot.log(
            "time of a step [µs]", "", "x", xlim=(0.1, 2.0 * longest), ylim=(-0.6, len(rows) + 0.2)
        )
        axes.set_xticks([10.0**k for k in range(-1, int(np.log10(2.0 * longest)) + 1)])
        axes.set_yticks(
            places, [f"{row['scene'].replace('_', ' ')}: {row['step']:.2g} µs" for row in rows]
        )
    told = "; ".join(
        f"{row['scene']} {row['step']:.2g} µs, with all on {row['all on']:.2g} µs, without "
        f"{row['shares of the step']} less"
        for row in rows[::-1]
    )
    return Drawn([Panel(plot.svg, told, wide=True)], numbers, told={"machine": machine})


_NOTHING = 1e-4  # [mm] where an error of zero is drawn
_COSTS = "time of the step saved [%]", "error [mm]"
_BEST, _WORSE = (
    replace(look, name="", width=0.0) for look in (STYLES["IAPB"], OUTCOMES["cannot tell"])
)


@recipe("effect-costs", "effect_costs")
def effect_costs(numbers: Table) -> Drawn:
    """Draw a panel per scene."""
    panels = []
    for scene in dict.fromkeys(numbers.column("scene")):
        rows = sorted(
            numbers.where(scene=scene).records(), key=lambda row: float(row["time saved"])
        )
        places = range(len(rows))
        size = 6.4, 0.8 + 0.22 * len(rows)
        with Plot(f"effect-costs-{scene}", size, shape=(1, 2)) as plot:
            for axes, key, title in zip(plot.each, ("time saved", "error"), _COSTS, strict=True):
                for place, row in zip(places, rows, strict=True):
                    style = _BEST if row["best of its error"] == "yes" else _WORSE
                    look = line_arguments(style) | {"linestyle": "none"}
                    value = max(row[key], _NOTHING) if key == "error" else row[key]
                    axes.plot(value, place, **look)
                axes.set(xlabel=title, ylim=(-0.6, len(rows) - 0.4))
                axes.set_yticks(places, [])
            plot.axes.set_yticks(places, [row["effect"].replace("_", " ") for row in rows])
            errors = plot.each[1]
            errors.set_xscale("log")
            errors.xaxis.get_major_locator().set_params(numticks=6)
            errors.xaxis.set_major_formatter(
                lambda x, _: power_of_ten(x) if x > _NOTHING else "none"
            )
        names = ", ".join(row["effect"] for row in rows[::-1])
        panels.append(Panel(plot.svg, f"{scene}: time saved and error for {names}.", scene))
    legend = {"saves most for its error": _BEST, "another saves more": _WORSE}
    return Drawn(panels, numbers, legend)

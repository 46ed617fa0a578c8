"""Accuracy against computing time: impact methods, whole motions, row budgets, growth with size, and effects."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from markupsafe import Markup

from reports.figures.canvas import note
from reports.figures.figure import Cell, Drawn, Panel, grid, recipe
from reports.figures.labels import SIZE, label_marks
from reports.figures.numbers import power_of_ten
from reports.figures.plot import Plot
from reports.figures.standalone import swatch
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
from verification.cost import impacts
from verification.cost import trajectories as motion
from verification.cost.calls import PRINTED
from verification.cost.growth import FACTORED
from verification.cost.steps import IDEAL
from verification.table import Table

Row = Mapping[str, Any]

_LOOKS: dict[str, LineStyle] = {  # method -> its look, which has its name at the curve
    impacts.IAPB: STYLES["IAPB"], impacts.SWEEPS: STYLES["Gauss-Seidel"], impacts.LEMKE: STYLES["Lemke"],
    impacts.CALLED: STYLES["IAPB, Python"], PRINTED: STYLES["printed, numpy"], impacts.QP: STYLES["DAQP, Python"],
}
_EXACT, _STRONG, _WEAK = 1e-9, 0.42, 0.16  # largest error of a strongly coloured cell; strengths of colours


@recipe(
    "which-method", "Which method for my budget?", "work_precision", section="accuracy",
    caption="Find the row of your impact and the column of your time budget. A cell names the compiled method that "
    "solves all or most of nine hard impacts of that size in time and without a gain of energy; below the name is "
    "its largest error relative to |v⁻|, and the share solved if it is not all. The colour is that of the method in "
    "the pictures below: strong for an error "
    "below 1e-9, pale for one up to 1e-3. “none”: no method solves half of the nine to 1e-3 in this time; “nearest” "
    "is then the largest error of the best method that ends in time without creating energy; if it is missing, there "
    "is no such method. The table under Numbers names that method, and the best methods called from Python. The nine "
    "impacts: condition number of M 1, 1e3 and 1e6; relative distance of the rows 1, 1e-3 and 1e-6 (of no "
    "meaning with one contact); e = 0, 1/2 and 1; all impulses push, so complementarity has the same solution. d is "
    "the number of coordinates.",
)  # fmt: skip
def which_method(numbers: Table) -> Drawn:
    """Draw a cell per size and budget."""
    found = impacts.choices(numbers)
    sizes = list(dict.fromkeys(found.select(("contacts", "coordinates")).rows))
    budgets = list(dict.fromkeys(found.column("budget")))
    cells = {f"{c} contact{'s' * (c > 1)}, d = {d}": [
        Cell(row["method"], _cell_note(row), MUTED) if row["method"] == "none" else
        Cell(row["method"], _cell_note(row), _LOOKS[row["method"]].color,
             _STRONG if row["largest error"] <= _EXACT else _WEAK)
        for row in found.where(contacts=c, coordinates=d).records()] for c, d in sizes}  # fmt: skip
    told = "; ".join(f"{row['contacts']} contacts in {row['budget']:g} µs: {row['method']}"
                     for row in found.records())
    table = grid([impacts.short_time(1e-6 * budget) for budget in budgets], cells)
    return Drawn((Panel(table, told, wide=True),), found)


def _cell_note(row: Row) -> str:
    if row["method"] == "none":
        return f"nearest: {row['nearest'].split(':')[-1].strip()}" if row["nearest"] else ""
    stopped = f"{row['work']}: " if row["work"][0].isdigit() else ""
    share = "" if row["share solved"] > 99 else f", {row['share solved']:.0f} %"
    return f"{stopped}{power_of_error(row['largest error'])}{share}"


def power_of_error(value: float) -> str:
    """Return an error in a few characters, such as 7e-14."""
    return f"{value:.0e}".replace("e-0", "e-") if value < 0.1 else f"{value:.1f}"


_WHY = (
    "The reason: IAPB orders the rows, orthogonalises each of them twice and proves that no energy is created. On a "
    "patch of a few contacts this fixed work takes most of the time. In a pile no row is redundant, so IAPB does "
    "this work for every contact, while Lemke's method needs one pivot for each. On a patch all rows but three are "
    "redundant, and IAPB is faster."
)


@recipe(
    "where-iapb-loses", "Where IAPB loses to a complementarity solver, and by how much", "C22/C22", "work_precision",
    section="accuracy", caption="",
)  # fmt: skip
def where_iapb_loses(kernels: Table, numbers: Table) -> Drawn:
    """Draw Lemke's time relative to IAPB's over the contacts, both compiled; the text says where IAPB is slower."""
    from matplotlib.ticker import FixedLocator, FuncFormatter

    looks = looks_of(dict.fromkeys(kernels.column("problem")))
    said = "Both methods are compiled and timed in turns (claim C22). Below the line at 1 IAPB is slower. "
    with Plot("where-iapb-loses", (5.2, 2.7)) as plot:
        plot.axes.axhline(1.0, color=INK, linewidth=0.9)
        plot.axes.axhspan(1e-2, 1.0, color=FORCE, alpha=0.07, linewidth=0)
        for name, look in looks.items():
            rows = [row for row in kernels.where(problem=name).records() if row["ratio"] is not None]
            plot.curve([(row["contacts"], row["ratio"]) for row in rows], look)
            plot.axes.vlines([row["contacts"] for row in rows], [row["lower quartile"] for row in rows],
                             [row["upper quartile"] for row in rows], color=look.color, linewidth=1.0)
            said += _lost_on(name, kernels.where(problem=name))
        note(plot.axes, (0.99, 0.04), "IAPB loses", (0, 0), xycoords="axes fraction", ha="right", va="bottom",
             color=FORCE)
        ratios = [row["ratio"] for row in kernels.records() if row["ratio"] is not None]
        plot.log("contacts", "time of Lemke / time of IAPB", ylim=(0.35 * min(ratios), 2.0 * max(ratios)))
        plot.axes.yaxis.set_major_locator(FixedLocator([0.5, 1.0, 2.0, 10.0, 100.0]))
        plot.axes.yaxis.set_major_formatter(FuncFormatter(lambda ratio, _: f"{ratio:g}"))
        plot.axes.xaxis.set_major_locator(FixedLocator([1, 2, 4, 8, 16, 32, 64, 128, 300]))
        plot.axes.xaxis.set_major_formatter(FuncFormatter(lambda count, _: f"{count:g}"))
    return Drawn((Panel(plot.svg, said.strip()),), kernels, tuple(looks.items()),
                 said + _lost_on_hard_impacts(numbers) + _WHY)


def _lost_on(name: str, kernels: Table) -> str:
    """Say for which contact counts of one family IAPB clearly costs more, and by which factor at worst."""
    slower = [row for row in kernels.records() if costs_more(row) is False]
    faster = max((row for row in kernels.records() if row["ratio"]), key=lambda row: float(row["ratio"]))
    won = f"at best, Lemke takes {faster['ratio']:.3g} times as long as IAPB ({_contacts(faster)}). "
    if not slower:
        return f"On {name} IAPB is clearly slower at no size; {won}"
    worst, sizes = min(slower, key=lambda row: float(row["ratio"])), [row["contacts"] for row in slower]
    return (f"On {name} IAPB is clearly slower at {len(sizes)} of {len(kernels.rows)} sizes, from {min(sizes)} "
            f"to {max(sizes)} contacts: at worst, it takes {1 / worst['ratio']:.2g} times as long as Lemke "
            f"({_contacts(worst)}); "
            f"{won}")  # fmt: skip


def _contacts(row: Row) -> str:
    return f"{row['contacts']} contact{'s' * (row['contacts'] > 1)}"


def _lost_on_hard_impacts(numbers: Table) -> str:
    """Say on how many hard impacts another solver is faster than IAPB: both compiled, then both from Python."""
    said = ""
    for called, how in ((impacts.COMPILED, "compiled"), (impacts.PYTHON, "called from Python")):
        lost = impacts.lost_to_rivals(numbers, called)
        cases = numbers.where(called=called).select(("contacts", "problem")).rows
        told = []
        for c in dict.fromkeys(lost.column("contacts")):
            here = lost.where(contacts=c).records()
            best = max(here, key=lambda row: float(row["ratio"]))
            told.append(f"{len({row['problem'] for row in here})} of {len({case for case in cases if case[0] == c})} "
                        f"with {_contacts(best)} ({best['solver']} by up to {best['ratio']:.2g} times)")
        said += (f"Hard impacts on which another solver is faster than IAPB, both {how}, with an error of at most "
                 f"1e-6: {'; '.join(told) or 'none'}. ")
    return said + ("From Python, IAPB also checks its arguments, bounds the change of energy and computes the impulses "
                   "of least norm, which takes most of the time at hundreds of contacts; DAQP does none of this. ")


@recipe(
    "impact-accuracy", "What a microsecond buys", "work_precision", section="accuracy",
    caption="Lower left is better. Each mark is the median of nine hard impacts of that size; the thin line above it "
    "reaches to the largest error. A curve joins the results of one method stopped early (IAPB after 1, 2, 4 ... rows, "
    "Gauss-Seidel after 1, 4, 16 ... sweeps). Filled marks: compiled; empty marks: called from Python. The grey steps "
    "join the marks that no other method beats in both time and error. A red ring: the method created energy in some "
    "of the nine. A cross at the rim: it failed on some or took more than 10 ms.",
)  # fmt: skip
def impact_accuracy(numbers: Table) -> Drawn:
    """Draw a panel per size."""
    panels = []
    for c, d in dict.fromkeys(numbers.select(("contacts", "coordinates")).rows):
        here = numbers.where(contacts=c, coordinates=d)
        with Plot(f"impact-accuracy-{c}", (4.1, 3.2)) as plot:
            front: list[tuple[float, float]] = []
            for method, look in _LOOKS.items():
                points = []
                for rows in impacts.by_way(here.where(method=method)).values():
                    good = [row for row in rows if row["outcome"] == "ok"]
                    lost = [row["failed after"] for row in rows if row["outcome"] != "ok"]
                    if lost:
                        plot.lost([min(float(np.median(lost)), 1e6 * impacts.LONGEST)], look, 0.985)
                    if len(good) < len(rows) / 2:
                        continue
                    time = float(np.median([row["time"] for row in good]))
                    errors = [max(row["relative error"], 1e-17) for row in good]
                    middle = float(np.median(errors))
                    points.append((time, middle))
                    plot.axes.vlines(time, middle, max(errors), color=look.color, linewidth=0.7, alpha=0.6)
                    if any(row["relative energy gain"] > impacts.NO_GAIN for row in good):
                        plot.axes.plot(time, middle, "o", markersize=9, markerfacecolor="none", markeredgecolor=FORCE)
                front += points
                plot.curve(sorted(points), look)
            _draw_front(plot, front, 1e6 * impacts.LONGEST)
            plot.log("time of one impact [µs]", "relative error", xlim=(0.05, 4e5), ylim=(1e-17, 10.0))
            plot.axes.set_xticks([10.0**k for k in range(-1, 5)])
        alt = f"Error against time with {c} contacts on {d} coordinates for {', '.join(_LOOKS)}."
        panels.append(Panel(plot.svg, alt, f"{c} contact{'s' * (c > 1)}, {d} coordinates"))
    return Drawn(tuple(panels), numbers, tuple((look.name, look) for look in _LOOKS.values()))


@recipe(
    "budget-share", "How many hard impacts a budget solves", "work_precision", section="accuracy",
    caption="Share of the 54 hard impacts of all sizes that a method solves to the given error within the time budget, "
    "without creating energy; higher and further left is better. A curve that ends below 100 % never solves the rest: "
    "the method stays too inexact, creates energy, finds no solution or needs more than 10 ms.",
)  # fmt: skip
def budget_share(numbers: Table) -> Drawn:
    """Draw a panel per tolerance."""
    cases, panels = len(set(numbers.select(("contacts", "problem")).rows)), []
    for tolerance in (1e-3, 1e-6, 1e-9):
        with Plot(f"budget-share-{power_of_error(tolerance)}", (4.1, 3.0)) as plot:
            ends: list[tuple[float, str, LineStyle]] = []
            for method, look in _LOOKS.items():
                first: dict[tuple[int, str], float] = {}
                for row in numbers.where(method=method, outcome="ok").records():
                    if row["relative error"] <= tolerance and row["relative energy gain"] <= impacts.NO_GAIN:
                        case = row["contacts"], row["problem"]
                        first[case] = min(row["time"], first.get(case, np.inf))
                times = sorted(first.values())
                heights = [100.0 * k / cases for k in range(len(times) + 1)]
                plot.axes.step([0.05, *times, 1e6 * impacts.LONGEST], [*heights, heights[-1]], where="post",
                               **line_arguments(look, marked=False))
                ends.append((heights[-1], f"{look.name} {heights[-1]:.0f} %", look))
            plot.log("time budget [µs]", "impacts solved [%]", "x", xlim=(0.05, 1e8 * impacts.LONGEST), ylim=(0, 104))
            plot.axes.set_yticks(range(0, 101, 20), [str(height) for height in range(0, 101, 20)])
            plot.axes.set_xticks([10.0**k for k in range(-1, 5)])
            place = np.inf
            for height, name, look in sorted(ends, key=lambda end: -end[0]):
                place = min(height, place - 6.5)
                plot.axes.text(1.2e6 * impacts.LONGEST, place, name, fontsize=SIZE, color=look.color, va="center")
        alt = f"Share of impacts solved to {tolerance:g} against time for {', '.join(_LOOKS)}."
        panels.append(Panel(plot.svg, alt, f"error below {power_of_error(tolerance)}"))
    return Drawn(tuple(panels), None, tuple((look.name, look) for look in _LOOKS.values()))


_ENGINES = {method: replace(STYLES[method], filled=False) for method in motion.WORLDS if method in STYLES}
_WORLDS = {motion.IMPULSES: STYLES["IAPB"], motion.STIFFENED: STYLES["PB, stiffened"],
           IDEAL: STYLES["ideal, Python"], **_ENGINES}  # fmt: skip
_NAMES = ("IAPB, Euler", "IAPB, midpoint", "IAPB, RK4", "PB, Euler", "PB, RK4", "PB, stiffened")
_INTEGRATORS = {method: STYLES[name] for method, name in zip(motion.INTEGRATORS, _NAMES, strict=True)}
_FRONT = LineStyle(MUTED, "", (), 3.0)  # in the legend alone; `_draw_front` draws it
_READ = (
    "Lower left is better. Each mark is a run with one time step; finer steps are further right. Filled marks: "
    "compiled; hollow marks: called from Python. Small pale marks, filled or hollow: the finer step divides the error"
    f" by less than {motion.GAINED:g}, so the number at the curve does not use them. “10× costs 4×”: ten times the "
    f"accuracy takes four times as long, a power (thick straight line) fitted to at least {motion.FIT_RUNS} runs over "
    f"which the error falls at least {motion.FIT_FALL:g}-fold. “7× costs 2× (2 runs)”: fewer runs or a smaller fall; "
    "this is only the measured factor from the first to the last of them. The error depends on where an impact falls "
    "within a step, so curves are uneven. The table gives the median of the fits, in brackets their range, then the "
    "number of scenes with a fit. Smallest error: the median over the scenes. “Then level”, “stays at”: no shorter "
    "step reduces this error, which comes from the contact model. “Too few runs”, “cut short”: finer steps would take"
    " longer than allowed, though the error still falls. The grey steps join the runs that no other run beats in both"
    f" time and error, among errors up to {motion.USEFUL:g}. “Never worth its time”: no run of the method is on the "
    "grey steps of any scene. Crosses at the upper rim: the run failed or took too long. An arrow at the lower rim: "
    "the error is below the accuracy of the exact motion (about 1e-10), because a step happens to end at the instant "
    "of impact; it is not used either. "
)


@recipe(
    "trajectory-precision", "What accuracy of a whole motion costs, by world", "haptic-rate/motions",
    section="accuracy",
    caption=_READ + "Worlds: IAPB by semi-implicit Euler with the paper's walls (1000 N/m); PB with walls "
    "as stiff as the step allows and Runge-Kutta 4. Its damping gives the restitution at one contact; at the four and "
    "sixteen of the boxes it is too strong, as for an author who does not know how many will touch; ideal: rigid "
    "contacts by a QP per step, written in Python. Other engines run their own compiled steps; Python calls them and "
    "records. "
    "CBuc is not drawn: it differs from ideal only in its coupling to a device, and these scenes have no device. "
    "Energy made: the largest excess of kinetic plus potential energy over its value at the start, relative to the "
    "largest kinetic energy.",
)  # fmt: skip
def trajectory_precision(motions: Table) -> Drawn:
    """Draw the worlds: a panel with a table, and a panel per scene."""
    return _precision("trajectory-precision", motions, _WORLDS)


@recipe(
    "integrator-precision", "What a better integrator buys in a whole motion", "haptic-rate/motions",
    section="accuracy",
    caption="The same worlds with other integrators; the grey steps join the best of these runs. PB with the "
    "paper's walls, which do not depend on the step, keeps the error of its springs; “stiffened” as above. An "
    "integrator of higher order is more exact only between impacts. The step that contains an impact dominates the "
    "error, so Runge-Kutta 4 needs four evaluations and gains little. All are compiled, so all marks are filled; small "
    "pale marks, grey steps and numbers as above.",
)  # fmt: skip
def integrator_precision(motions: Table) -> Drawn:
    """Draw the integrators in the same way as the worlds."""
    return _precision("integrator-precision", motions, _INTEGRATORS)


def _precision(key: str, motions: Table, drawn: Mapping[str, LineStyle]) -> Drawn:
    looks = {name: look for name, look in drawn.items() if name in motions.column("method")}
    found = motion.curves(motions, tuple(looks))
    told = motion.worth(motions, tuple(looks))
    lines = "; ".join(_worth_said(row, looks)[0] for row in told.records())
    table: dict[str, Sequence[Cell]] = {}
    for row in told.records():
        look = looks[row["method"]]
        table[Markup("{} {}").format(swatch(look), look.name)] = [
            Cell(Markup("<b>{}</b>").format(words) if words == _NEVER else words)
            for words in _worth_said(row, looks)[1]]
    panels = [Panel(grid(_HEADINGS, table, "plain"), lines, wide=True)]
    for number, scene in enumerate(dict.fromkeys(motions.column("scene"))):
        here = [curve for curve in found if curve.scene == scene]
        said = ", ".join(f"{looks[curve.method].name}: {curve.words}" for curve in here)
        lost = motions.only(outcome != "ok" for outcome in motions.column("outcome")).where(scene=scene)
        panels.append(Panel(_motions(f"{key}-{number}", here, lost, looks),
                            f"{scene}: error of position against computing time. {said}.", scene))
    return Drawn(tuple(panels), told, (*((look.name, look) for look in looks.values()), ("best for its time", _FRONT)))


_HEADINGS = ("called", "ten times the accuracy costs (scenes)", "smallest error", "best for its time (grey), errors",
             "energy made")
_NEVER = "never worth its time here"


def _worth_said(row: Row, looks: Mapping[str, LineStyle]) -> tuple[str, tuple[str, ...]]:
    """Return a line of the table of main numbers, as one text and as the text of each column."""
    name, scenes = looks[row["method"]].name, row["scenes"]
    cost = "no step buys it: the error stays" if row["error stays"] == scenes else "too few runs for a fit"
    if row["scenes fitted"]:
        typical, *ends = (motion.times(row[key]) for key in ("tenfold accuracy costs", "least cost", "largest cost"))
        span = f" ({' to '.join(ends)})" if row["scenes fitted"] > 1 else ""
        cost = f"{typical} the time{span}, {row['scenes fitted']} of {scenes}"
    best = f"undecided: {row['cut short']} of {scenes} cut short" if row["cut short"] else _NEVER
    if row["best for its time"]:
        errors = dict.fromkeys(power_of_error(row[key]) for key in ("most exact there", "least exact there"))
        best = f"{row['best for its time']} of {scenes} scenes, {' to '.join(errors)}"
    made = f"up to {100 * row['energy made']:.2g} %" if row["energy made"] > impacts.NO_GAIN else "none"
    cells = (row["called"], cost, power_of_error(row["least error"]), best, made)
    return f"{name}: ten times the accuracy: {cost}; best for its time: {best}; energy made: {made}", cells


def _motions(key: str, here: Sequence[motion.Curve], lost: Table, looks: Mapping[str, LineStyle]) -> str:
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
            for run in filter(motion.by_chance, curve.left_out):
                note(plot.axes, (run["time"], 1.3 * floor), "↓", color=look.color)
            if curve.cost is not None:  # the fitted power law over the range of the fitted runs
                time, error = (np.log10(column) for column in zip(*places(curve.used), strict=True))
                ends = np.array([time.min(), time.max()])
                heights = error.mean() - (ends - time.mean()) / np.log10(curve.cost)
                plot.axes.plot(10.0**ends, 10.0**heights, color=look.color, linewidth=1.8, alpha=0.6)
            plot.words[look.name] = f": {curve.words}"
            plot.lost([time for time in lost.where(method=curve.method).column("time") if time], look, 0.98)
        plot.log("computing time [ms per simulated second]", "error of position [lengths]", ylim=(floor, 30.0))
    return plot.svg


_PALE = 0.45  # strength of marks that are not used


def _draw_front(plot: Plot, points: Iterable[tuple[float, float]], until: float | None = None) -> None:
    """Draw grey steps through the points that no other point beats in both time and error, up to the time `until`."""
    steps, least = list[tuple[float, float]](), np.inf
    for time, error in sorted(points):
        if error < least:
            steps += [(time, least), (time, error)] if np.isfinite(least) else [(time, error)]
            least = error
    if steps:
        end = [(until, least)] if until else []
        plot.axes.plot(*zip(*steps, *end, strict=True), color=MUTED, linewidth=3, alpha=0.25)


@recipe(
    "anytime", "What is lost when time runs out", "haptic-rate/budgets", section="accuracy", caption="",
)  # fmt: skip
def anytime(numbers: Table) -> Drawn:
    """Draw what is left to do after each share of the rows: a panel for the velocity and one for the energy."""
    sizes: dict[str, list[Row]] = {}
    for row in numbers.records():
        sizes.setdefault(f"{row['contacts']} contacts", []).append(row)
    done = {size: [row["budget"] / row["rank"] for row in rows] for size, rows in sizes.items()}
    panels, ranges = [], []
    for key, name, alt, label, height in (
        ("velocity", "velocity left [%]", "Velocity left against the share of rows done.",
         "normal velocity that is left, of that before the impact",
         lambda row, first: row["median residual"] / first["median residual"]),
        ("energy", "energy loss missing [%]", "Missing loss against the share of rows done.",
         "missing part of the energy that the complete impact takes", lambda row, _: 1.0 - row["share of the loss"]),
    ):  # fmt: skip
        left = {size: [100.0 * height(row, rows[0]) for row in rows] for size, rows in sizes.items()}
        half = {size: float(f"{np.interp(0.5, done[size], heights):.2g}") for size, heights in left.items()}
        ranges.append(f"{min(half.values()):g} to {max(half.values()):g} %")
        with Plot(f"anytime-{key}") as plot:
            plot.axes.axvspan(49.0, 51.0, color=MUTED, alpha=0.2, linewidth=0)
            for size, look in looks_of(sizes).items():
                plot.curve(zip([100.0 * share for share in done[size]], left[size], strict=True), look)
                plot.words[size] = f": {half[size]:g} % after half"
            plot.axes.set(xlabel="rows done when time runs out [%]", ylabel=name, xlim=(-2, 102), ylim=(-3, 105))
        panels.append(Panel(plot.svg, alt, label))
    needed = ", ".join(f"{rows[0]['rank']} for {name}" for name, rows in sizes.items())
    gained = sum(row["largest relative gain"] > 0.0 for row in numbers.records())
    return Drawn(tuple(panels), numbers, tuple(looks_of(sizes).items()), (
        "Plastic impacts that stop after some of their rows, because the time budget is over. The rows needed are the "
        f"rank of J ({needed}); the row with the "
        "largest residual comes first. Stopped after half of the rows (grey line), the worst contact keeps "
        f"{ranges[0]} of the normal velocity (median, relative to the median before), and the "
        f"impact takes {ranges[1]} less energy than it should. The complete impact leaves "
        f"nothing but rounding. {gained or 'None'} of the {len(numbers.rows)} budgets of rows created energy."))


_HELD = {"contacts": ("coordinates", 12), "coordinates": ("contacts", 60)}  # varied -> what is held, and at what
_FORMS = {FACTORED: STYLES["factored"], PRINTED: STYLES["printed, numpy"]}


@recipe(
    "impact-scaling", "How one impact's time grows", "haptic-rate/scaling", "haptic-rate/fitted", section="haptic-rate",
    caption="Medians with quartiles; lines are fitted powers. Each curve is labelled with the exponent of its fit, and "
    "with the range in which it is steepest, which the fit hides. Each contact adds one row to the factored impact, "
    "and the work per row depends only on the rank. The printed formula forms the pseudo-inverse of a matrix of all "
    "contacts.",
)  # fmt: skip
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
                row = powers[method, axis]
                power = row["exponent"]
                level = np.exp(np.mean(np.log(middle) - power * np.log(size)))
                plot.axes.plot(size, level * size**power, color=look.color, linewidth=0.9)
                plot.words[look.name] = (f": exponent {power:.2f}, {row['there']:.2f} from {row['steepest from']:g} to "
                                         f"{row['to']:g}")
            plot.log(axis, "time of one impact [µs]")
        panels.append(Panel(plot.svg, f"Time of one impact against the number of {axis}.",
                            f"{axis}, with {count} {other}"))
    return Drawn(tuple(panels), numbers, tuple((look.name, look) for look in _FORMS.values()))


@recipe(
    "effect-steps", "What a step takes, and which effects take it", "effect_steps", "machine", section="effects",
    caption="",
)  # fmt: skip
def effect_steps(numbers: Table, machine: str) -> Drawn:
    """Draw for each scene a dot, a mark for the time with every effect on, and the largest savings as text."""
    rows = sorted(numbers.records(), key=lambda row: -float(row["step"]))
    places, longest, height = range(len(rows)), max(row["all on"] for row in rows), 0.27 * len(rows) + 0.8
    with Plot("effect-steps", (8.6, height), frame=(0.225, 0.5 / height, 0.19, 1.0 - 0.5 / height)) as plot:
        axes = plot.axes
        axes.hlines(places, [row["step"] for row in rows], [row["all on"] for row in rows], color=FORCE, linewidth=1)
        axes.plot([row["all on"] for row in rows], places, "|", color=FORCE, markersize=9, markeredgewidth=2)
        axes.plot([row["step"] for row in rows], places, "o", color=BLUE, markersize=5)
        beside = axes.get_yaxis_transform()
        for place, row in zip(places, rows, strict=True):
            largest = ", ".join(row["shares of the step"].split(", ")[:3])
            axes.text(1.06, place, largest, va="center", fontsize=7.5, color=INK, transform=beside)
        axes.text(1.06, len(rows) - 0.4, "saved by leaving out one effect: share of the step (and time)", va="bottom",
                  fontsize=7.5, color=MUTED, transform=beside)
        plot.log("time of a step [µs]", "", "x", xlim=(0.1, 2.0 * longest), ylim=(-0.6, len(rows) + 0.2))
        axes.set_xticks([10.0**k for k in range(-1, int(np.log10(2.0 * longest)) + 1)])
        axes.set_yticks(places, [f"{row['scene'].replace('_', ' ')}: {row['step']:.2g} µs" for row in rows])
    told = "; ".join(f"{row['scene']} {row['step']:.2g} µs, with all on {row['all on']:.2g} µs, without "
                     f"{row['shares of the step']} less" for row in rows[::-1])  # fmt: skip
    return Drawn((Panel(plot.svg, told, wide=True),), numbers, caption=(
        "Blue dot: time of a recorded step of the scene in the world IAPB, with the effects that it needs. Red mark: "
        "the same with every effect switched on; the added effects change nothing. From dot to mark is what leaving "
        "out unneeded effects saves; a few per cent are noise. Right: the time that leaving out one effect saves, for "
        "the three effects that save most, above the noise of nine rounds (the numbers have all); about one effect in "
        "26 exceeds it by chance. Shares need not add up: for example, a tool without hand force touches nothing. "
        "Only this page measures the time of a step: "
        f"{machine}."))


_NOTHING = 1e-4  # [mm] where an error of zero is drawn


@recipe(
    "effect-costs", "What leaving an effect out saves, and what it breaks", "effect_costs", section="effects",
    caption="Each mark is one effect left out of a scene that needs it: further right saves more time, further up "
    "means a larger error in the position of the tool. Filled, joined marks: no other effect saves more time for a "
    "smaller error. Marks on the lowest line change nothing in this run; marks at 0 % save less than the noise of the "
    "clock.",
)  # fmt: skip
def effect_costs(numbers: Table) -> Drawn:
    """Draw a panel per scene."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    panels, looks = [], {"yes": STYLES["IAPB"], "no": OUTCOMES["cannot tell"]}
    for scene in dict.fromkeys(numbers.column("scene")):
        rows = [row | {"place": (row["time saved"], max(row["error"], _NOTHING))}
                for row in numbers.where(scene=scene).records()]  # fmt: skip
        best, others = ([row["place"] for row in rows if row["best of its error"] == kind] for kind in looks)
        with Plot(f"effect-costs-{scene}", (4.6, 3.6)) as plot:
            plot.curve(sorted(best), looks["yes"], linewidth=0.8)
            plot.marks(others, looks["no"])
            plot.axes.set(yscale="log", xlabel="time of the step saved [%]", ylabel="error [mm]")
            saved = [row["time saved"] for row in rows]
            least, span = min(0.0, *saved), max(saved) - min(0.0, *saved)
            plot.axes.set_xlim(least - 0.62 * span, least + 1.4 * span)
            plot.axes.set_xticks([x for x in plot.axes.get_xticks() if least <= x <= least + 1.4 * span])
            plot.axes.margins(y=0.12)
            plot.axes.yaxis.set_major_locator(LogLocator(numticks=8))
            plot.axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: power_of_ten(y) if y > _NOTHING else "none"))
            plot.axes.yaxis.set_minor_locator(NullLocator())
            label_marks(plot.axes, [row["effect"].replace("_", " ") for row in rows], [row["place"] for row in rows],
                        [looks[row["best of its error"]].color for row in rows])
        names = ", ".join(row["effect"] for row in rows)
        panels.append(Panel(plot.svg, f"{scene}: error against time saved for {names}.", scene))
    return Drawn(tuple(panels), numbers)

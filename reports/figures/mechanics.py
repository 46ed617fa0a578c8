"""Checks of the mechanics: other coordinates (C06), false collisions (C18), impacts of touching balls.

The outcomes of the impacts are labelled with the changes of energy and momentum. All treatments except per-body rows
conserve both, but their outcomes differ nevertheless, because the choice of rows decides the outcome.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.plot import Plot, arrow, note
from reports.figures.style import BOUND, FORCE, INK, MUTED, PAPER, STYLES, LineStyle, line_arguments, looks_of
from verification.table import Table

_LOOKS = looks_of(("absolute angles", "place of the hand"))
_STRAIGHT = 1e-13  # [rad] where the straight arm itself is drawn, on an axis that has no zero
_SMALLEST = 1e-18  # an error of zero is drawn here
_SHOWN = ("one", "two, separated")  # contacts of the first panel: well conditioned ones


@recipe("coordinate-invariance", "mechanics/coordinate invariance")
def coordinate_invariance(numbers: Table) -> Drawn:
    """Draw the motion through the singular pose, and the error of every case against its bound."""
    rows = [row | {"elbow": max(row["elbow"], _STRAIGHT),
                   "drawn": None if row["error"] is None else max(row["error"], _SMALLEST)}
            for row in numbers.records()]  # fmt: skip
    told = [row for row in rows if row["bound"] < 1.0 and row["error"] is not None]
    share = max(row["error"] / row["bound"] for row in told)
    words = f"{len(told)} cases with a bound below 1; the largest error is {share:.1e} of its bound."
    size = (4.3, 3.3)
    with Plot("coordinate-invariance-pose", size) as pose, Plot("coordinate-invariance-bound", size) as bound:
        for name, look in _LOOKS.items():
            mine = [row for row in rows if row["coordinates"] == name]
            shown = [row for row in mine if row["contacts"] in _SHOWN]
            bounds: dict[float, float] = {}
            for row in sorted(shown, key=lambda row: -float(row["elbow"])):
                bounds[row["elbow"]] = max(row["bound"], bounds.get(row["elbow"], 0.0))
            pose.curve(bounds.items(), LineStyle(look.color, "", BOUND.dash, 1.3))
            pose.marks([(row["elbow"], row["drawn"]) for row in shown if row["drawn"]], look, markersize=5)
            bound.marks([(row["bound"], row["drawn"]) for row in mine if row["drawn"]], look, markersize=5)
        pose.axes.axhline(1.0, color=MUTED, linewidth=0.8)
        pose.axes.xaxis.set_inverted(True)
        pose.log("angle of the elbow [rad], straight at the right end", "error of v⁺, kinetic metric")
        note(pose.axes, (1.0, 1.0), "no digit is right above", (0, 7), ha="left", color=MUTED, fontsize=8)
        high = max(row["bound"] for row in rows)
        bound.curve([(1e-15, 1e-15), (high, high)], BOUND, marked=False)
        bound.axes.axvline(1.0, color=MUTED, linewidth=0.8)
        bound.log("bound C ε κ(M) κ(∂f/∂r)² / σ_min", "error of v⁺", ylim=(0.3 * _SMALLEST, 1e4))
        note(bound.axes, (1.0, 1e-17), "the bound says nothing beyond", (4, 0), ha="left", color=MUTED, fontsize=8)
    panels = Panel(pose.svg, words, "Towards the straight arm"), Panel(bound.svg, words, "Error against bound")
    names = ("in absolute angles", "in the place of the hand", "bound")
    return Drawn(panels, numbers, zip(names, (*_LOOKS.values(), BOUND), strict=True))


FILTERS = looks_of(("no filter", "coherence alone", "clustering alone", "both filters"))
_DAMPING = 40.0  # [N s/m] of the panels in time: the scene's own
_DURATION = 2.0  # [s]


@recipe("socket-collisions", "mechanics/false collisions in time", "mechanics/false collisions")
def socket_collisions(times: Table, counts: Table) -> Drawn:
    """Draw collision counts and energy losses over time, and the counts over damping."""
    found = ", ".join(f"{row['filters']} {row['false collisions']}"
                      for row in counts.where(damping=_DAMPING).records())  # fmt: skip
    words = f"False collisions in two seconds at {_DAMPING:g} N s/m: {found}."
    panels, here = [], times.where(damping=_DAMPING)
    none = " and ".join(setting for setting in FILTERS if setting not in here.column("filters"))
    for column, label, alt, title in (
        ("false collisions so far", "false collisions so far", words, f"False collisions, {_DAMPING:g} N s/m"),
        ("energy lost so far, share of the fall", "lost in them, share of the fall",
         "Energy lost in false collisions, cumulative.", "Energy that they take"),
    ):  # fmt: skip
        with Plot(f"socket-collisions-{times.keys.index(column)}") as plot:
            for setting, style in FILTERS.items():
                mine = here.where(filters=setting)
                time, value = [0.0, *mine.column("time"), _DURATION], [0.0, *mine.column(column)]
                look = line_arguments(style, marked=bool(mine.rows)) | {"markevery": 4, "clip_on": False}
                look["gid"] = look["gid"] if mine.rows else None  # the note below names it
                plot.axes.step(time, [*value, value[-1]], where="post", **look)
            plot.axes.set(xlabel="time [s]", ylabel=label, xlim=(0.0, _DURATION))
            plot.axes.set_ylim(bottom=0.0)
            note(plot.axes, (_DURATION, 0.0), f"{none}: none" if none else "", (-2, 8), ha="right", fontsize=8.5)
        panels.append(Panel(plot.svg, alt, title))
    dampings = sorted(set(counts.column("damping")))
    with Plot("socket-collisions-damping") as plot:
        for number, (setting, style) in enumerate(FILTERS.items()):
            mine = counts.where(filters=setting)
            places = [dampings.index(damping) + 0.2 * (number - 1.5) for damping in mine.column("damping")]
            bars = plot.axes.bar(places, mine.column("false collisions"), width=0.17, color=style.color)
            plot.axes.bar_label(bars, fontsize=8, padding=2)
        plot.axes.set_xticks(range(len(dampings)), [f"{b:g}" for b in dampings])
        plot.axes.grid(visible=False, axis="x")
        plot.axes.set(xlabel="damping of the contact [N s/m]", ylabel="false collisions in 2 s")
    panels.append(Panel(plot.svg, words, "By damping of the contact"))
    return Drawn(panels, counts, FILTERS)


# start of a treatment's name -> its look
TREATMENTS = {
    "simultaneous, relative": STYLES["relative rows (12)"],
    "simultaneous, per-body": STYLES["per-body rows (13)-(14)"],
    "event-driven": STYLES["event by event"],
}
CRADLE, BERNOULLI = "cradle of 5", "Bernoulli"
ROUNDING = 1e-12  # smaller changes count as none
_ORDERS = {"contact 0, then 1": "the upper ball first", "contact 1, then 0": "the lower ball first"}


class Outcome(NamedTuple):
    """One treatment of one problem: velocities after the impact [m/s], and relative changes of energy and momentum."""

    treatment: str
    rows: str
    velocity: tuple[tuple[float, float], ...]
    energy: float
    momentum: float

    @property
    def look(self) -> LineStyle:
        """Return the colour and marker of the treatment."""
        return next(look for start, look in TREATMENTS.items() if self.treatment.startswith(start))

    @property
    def label(self) -> str:
        """Return the name of the treatment in a picture."""
        if self.treatment.startswith("event"):
            return _ORDERS.get(self.rows, self.rows)
        return f"{self.treatment.split(', ')[1].split(' (')[0]}:\n{self.rows}"


def outcomes(numbers: Table, problem: str) -> list[Outcome]:
    """Return the outcomes of one problem from the table, which has a row per ball."""
    found: dict[tuple[str, str], list[Any]] = {}
    for row in numbers.where(problem=problem).records():
        found.setdefault((row["treatment"], row["rows or order"]), []).append(row)
    return [Outcome(*names, tuple((r["v_x after"], r["v_y after"]) for r in rows), rows[0]["energy change"],
                    rows[0]["momentum change"]) for names, rows in found.items()]  # fmt: skip


@recipe("linked-impacts", "mechanics/linked impacts")
def linked_impacts(numbers: Table) -> Drawn:
    """Draw both problems, and the velocity of the last ball of cradles of several lengths."""
    panels = []
    for problem, title in ((CRADLE, "Newton's cradle of five"), (BERNOULLI, "Bernoulli's three balls")):
        found: dict[Any, Outcome] = {}
        for outcome in outcomes(numbers, problem):  # one picture of a treatment and its velocities for both choices
            key = (outcome.treatment, tuple(round(v, 9) + 0.0 for ball in outcome.velocity for v in ball))
            rows = f"{found[key].rows.split()[0]} or {outcome.rows}" if key in found else outcome.rows
            found[key] = outcome._replace(rows=rows)
        lost = sum(abs(outcome.momentum) > ROUNDING for outcome in found.values())
        words = (f"{len(found)} outcomes of one impact; {len(found) - lost} conserve energy and momentum, {lost} by "
                 "per-body rows conserve energy only.")  # fmt: skip
        panels.append(Panel(_balls(problem, list(found.values())), words, f"{title}: velocities after", wide=True))
    panels.append(Panel(_last_ball(numbers), "Velocity of the last ball of cradles of 2 to 7 balls, by treatment.",
                        "Cradles of two to seven balls: what the last ball gets"))
    return Drawn(panels, numbers, {look.name: look for look in TREATMENTS.values()})


# problem -> places of its balls, width and height of a picture (in radii, about the first ball), pictures in a row
_PLACES = {
    CRADLE: ([(k, 0.0) for k in range(5)], (-1.6, 6.2), (-1.5, 1.6), 3),
    BERNOULLI: ([(0.0, 0.0), (0.75**0.5, 0.5), (0.75**0.5, -0.5)], (-2.0, 3.2), (-1.9, 2.1), 4),
}


def _balls(problem: str, found: Sequence[Outcome]) -> str:
    """Draw the balls of each outcome with their velocities, its name above, and what it changes below."""
    from matplotlib.patches import Circle

    centers, across, up, columns = _PLACES[problem]
    rows = -(-len(found) // columns)
    height = 8.6 / columns * (up[1] - up[0]) / (across[1] - across[0])
    frames = [(k % columns / columns, 1 - (1 + k // columns) / rows, 1 / columns, 1 / rows) for k in range(len(found))]
    with Plot(f"linked-impacts-{problem.split()[0].lower()}", (8.6, height * rows), bare=True, frames=frames) as plot:
        for axes, outcome in zip(plot.each, found, strict=True):
            axes.set(xlim=across, ylim=up)
            color, middle = outcome.look.color, sum(across) / 2
            for center, velocity in zip(centers, outcome.velocity, strict=True):
                axes.add_patch(Circle(center, 0.5, facecolor=PAPER, edgecolor=MUTED, linewidth=1.0, zorder=2))
                if max(abs(v) for v in velocity) > ROUNDING:
                    arrow(axes, center, [1.6 * v for v in velocity], color=color, width=1.8, head=10.0)
            note(axes, (middle, up[1] - 0.45), outcome.label, color=color, fontsize=8.5, gid="name=")
            changed = [f"{name} changed ×{change:.2g}" for name, change in zip(("energy", "momentum"), outcome[3:],
                       strict=True) if abs(change) >= ROUNDING]  # fmt: skip
            note(axes, (middle, up[0] + 0.3), ", ".join(changed) or "all kept", color=FORCE if changed else INK,
                 fontsize=8.5, fontweight="bold" if changed else "normal")  # fmt: skip
    return plot.svg


def _last_ball(numbers: Table) -> str:
    series: dict[tuple[str, str], list[Outcome]] = {}
    for problem in dict.fromkeys(numbers.column("problem")):
        for outcome in outcomes(numbers, problem) if problem.startswith("cradle") else ():
            # the LCP is as simultaneous with all rows, per-body with all rows as with the approaching ones
            if "LCP" not in outcome.rows and not ("per-body" in outcome.treatment and "all" in outcome.rows):
                series.setdefault(outcome[:2], []).append(outcome)
    with Plot("linked-impacts-last") as plot:
        for (treatment, rows), found in series.items():
            look, values = found[0].look, [outcome.velocity[-1][0] for outcome in found]
            words = rows.removesuffix(" contacts").removesuffix(" along the row")
            mine = replace(look, name="per-body rows" if "per-body" in treatment else words)
            plot.curve(zip([len(outcome.velocity) for outcome in found], values, strict=True), mine)
        plot.axes.set(xlabel="balls in the cradle", ylabel="velocity of the last ball [m/s]", ylim=(-0.18, 1.2))
    return plot.svg

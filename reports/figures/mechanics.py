"""Checks of the mechanics: other coordinates (C06), a tumbling body, and false collisions in a socket (C18)."""

from __future__ import annotations

from reports.figures.canvas import note
from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.plot import Plot
from reports.figures.style import BOUND, MUTED, STYLES, LineStyle, line_arguments, looks_of
from verification.table import Table

_LOOKS = looks_of(("absolute angles", "place of the hand"))
_STRAIGHT = 1e-13  # [rad] where the straight arm itself is drawn, on an axis that has no zero
_SMALLEST = 1e-18  # an error of zero is drawn here
_SHOWN = ("one", "two, separated")  # contacts of the first panel: well conditioned ones


@recipe(
    "coordinate-invariance", "The same impact in other coordinates", "mechanics/coordinate invariance",
    section="mechanics",
    caption="An impact on an arm is solved in joint angles and in other coordinates; the error is the difference after "
    "transforming back. First panel: the elbow straightens from left to right. At the singular pose the position of "
    "the hand is no valid coordinate, and on the way there bound (dashed) and error grow. Absolute angles stay "
    "accurate; their last mark is the straight arm itself. Second panel: every case, including nearly dependent rows; "
    "below the dashed line the error is below the bound C ε κ/σ_min.",
)  # fmt: skip
def coordinate_invariance(numbers: Table) -> Drawn:
    """Draw the motion through the singular pose, and the error of every case against its bound."""
    rows = [row | {"drawn": None if row["error"] is None else max(row["error"], _SMALLEST)}
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
            pose.curve([(max(elbow, _STRAIGHT), most) for elbow, most in bounds.items()], _dashed(look, 1.3))
            places = [(max(row["elbow"], _STRAIGHT), row["drawn"]) for row in shown if row["drawn"]]
            pose.marks(places, look, markersize=5)
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
    angles, hand = _LOOKS.values()
    legend = (("in absolute angles", angles), ("in the place of the hand", hand), ("bound", BOUND))
    return Drawn(panels, numbers, legend)


def _dashed(look: LineStyle, width: float) -> LineStyle:
    return LineStyle(look.color, "", BOUND.dash, width)


_QUANTITIES = {
    "energy drift": ("Kinetic energy", "energy drift (relative)"),
    "momentum drift": ("Angular momentum", "momentum drift (relative)"),
    "attitude error": ("Attitude", "attitude error [rad]"),
}
INTEGRATORS = {
    "momentum": STYLES["momentum"],
    "semi_implicit_euler": STYLES["semi-implicit Euler"],
    "midpoint": STYLES["midpoint"],
    "runge_kutta_4": STYLES["Runge-Kutta 4"],
    "commutator_free_4": STYLES["commutator-free Runge-Kutta 4"],
}


@recipe(
    "tumbling-drift", "A free body tumbles", "mechanics/tumbling", section="mechanics",
    caption="A free body tumbles about its axis of middle inertia; its motion is known in closed form. Each mark is a "
    "run of two seconds. The dashed lines have the slope of the order that the integrator declares. Runge-Kutta 4 adds "
    "its stages as one rotation vector, so it declares order 2 for rotations. Its energy drift does not depend on the "
    "attitude and coincides with that of the commutator-free method, which has order 4.",
)  # fmt: skip
def tumbling_drift(numbers: Table) -> Drawn:
    """Draw attitude error and drifts of each integrator against the step, with the declared slopes."""
    series = [(look, numbers.where(integrator=integrator, motion="turning over").records())
              for integrator, look in INTEGRATORS.items()]  # fmt: skip
    panels = []
    for column, (name, label) in _QUANTITIES.items():
        with Plot(f"tumbling-drift-{name.split()[-1].lower()}") as plot:
            for look, rows in series:
                steps, values, order = ([row[key] for row in rows] for key in ("step", column, "declared order"))
                size = 5 if look.filled else 9  # so that marks which coincide are both seen
                plot.marks(zip(steps, values, strict=True), look, markersize=size)
                plot.curve([(step, values[0] * (step / steps[0]) ** order[0]) for step in steps], _dashed(look, 1.2))
            plot.log("step [s]", label)
        ends = "; ".join(f"{look.name} {rows[0][column]:.1e} to {rows[-1][column]:.1e}" for look, rows in series)
        panels.append(Panel(plot.svg, f"{name} against the step, coarsest to finest: {ends}.", name))
    legend = (*((look.name, look) for look in INTEGRATORS.values()), ("declared slope", BOUND))
    return Drawn(tuple(panels), numbers, legend)


FILTERS = looks_of(("no filter", "coherence alone", "clustering alone", "both filters"))
_DAMPING = 40.0  # [N s/m] of the panels in time: the scene's own
_DURATION = 2.0  # [s]


@recipe(
    "socket-collisions", "A ball rolls in a faceted socket", "mechanics/false collisions in time",
    "mechanics/false collisions", section="mechanics",
    caption="The facets approximate a round socket, in which the ball collides once and then rolls. Every further "
    "collision is false. With temporal coherence the contact on the next facet is not new. Clustering alone leaves one "
    "contact, which jumps from facet to facet and is new each time. Last panel: at low damping the ball bounces off "
    "the edges, and its next contact is new to both filters.",
)  # fmt: skip
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
                plot.axes.step(time, [*value, value[-1]], where="post", **look)
            plot.axes.set(xlabel="time [s]", ylabel=label, xlim=(0.0, _DURATION))
            plot.axes.set_ylim(bottom=0.0)
            note(plot.axes, (_DURATION, 0.0), f"{none}: none" if none else "", (-2, 8), ha="right", fontsize=8.5)
        panels.append(Panel(plot.svg, alt, title))
    dampings = sorted(set(counts.column("damping")))
    with Plot("socket-collisions-damping") as plot:
        for number, (setting, style) in enumerate(FILTERS.items()):
            for k, b in enumerate(dampings):
                height = counts.where(filters=setting, damping=b).column("false collisions")[0]
                plot.axes.bar(k + 0.2 * (number - 1.5), height, width=0.17, color=style.color)
                note(plot.axes, (k + 0.2 * (number - 1.5), height), str(height), (0, 6), fontsize=8)
        plot.axes.set_xticks(range(len(dampings)), [f"{b:g}" for b in dampings])
        plot.axes.grid(visible=False, axis="x")
        plot.axes.set(xlabel="damping of the contact [N s/m]", ylabel="false collisions in 2 s")
    panels.append(Panel(plot.svg, words, "By damping of the contact"))
    return Drawn(tuple(panels), counts, tuple(FILTERS.items()))

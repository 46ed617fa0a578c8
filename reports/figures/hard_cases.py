"""The hard cases: the failing motion, and impacts at the touch."""

from __future__ import annotations

from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.plot import Plot, note
from reports.figures.style import MUTED, STYLES, LineStyle
from verification.table import Table

WORDS = {"PB": "spring only", "ideal": "rigid wall"}
# world -> share of the time at which its name stands, and the way to it [points]
_NAMES_AT = {"IAPB": (0.1, (34.0, 6.0)), "PB": (0.5, (0.0, 12.0)), "ideal": (0.7, (0.0, 10.0))}


@recipe("the-failure", "hard-cases/the failure")
def the_failure(numbers: Table) -> Drawn:
    """Draw the kinetic energy over time in each world of the motion that fails."""
    with Plot("the-failure", (6.6, 2.9)) as plot:
        for world in dict.fromkeys(numbers["world"]):
            shown = numbers.where(world=world).select(("time", "kinetic energy")).rows
            words = WORDS.get(world, world)
            look = STYLES[world]
            plot.curve(shown, look, marked=False)
            share, offset = _NAMES_AT.get(world, (0.5, (0.0, 8.0)))
            place = min(shown, key=lambda point: abs(point[0] - share * shown[-1][0]))
            note(plot.axes, place, words, offset, color=look.color, fontweight="bold")
        plot.axes.set(xlabel="time [s]", ylabel="kinetic energy [mJ]")
    title = numbers.rows[0][0] if numbers.rows else ""
    return Drawn([Panel(plot.svg, f"Kinetic energy over time: {title}.")], numbers)


# column of the table -> name and look of its curve
_RULES = {
    "error, impacts at the touch": ("IAPB, impacts at the touch", STYLES["IAPB"]),
    "error, impacts at the step": ("IAPB, impacts at steps", LineStyle(MUTED, "s", (5, 1.6))),
    "error of MuJoCo": ("MuJoCo", STYLES["MuJoCo"]),
}
_FLOOR = 1e-16  # errors below are drawn here


@recipe("impacts-at-the-touch", "hard-cases/touch")
def impacts_at_the_touch(numbers: Table) -> Drawn:
    """Draw the error of each motion over the step, for both rules and for MuJoCo."""
    panels = []
    rules = {key: rule for key, rule in _RULES.items() if key in numbers.keys}
    for motion in dict.fromkeys(numbers["motion"]):
        shown = numbers.where(motion=motion)
        with Plot(f"touch-{motion.replace(' ', '-')}", (3.1, 2.5)) as plot:
            for key, (_, look) in rules.items():
                points = shown.select(("step", key)).rows
                plot.curve([(step, max(error, _FLOOR)) for step, error in points], look)
            plot.log("step [ms]", "error, of its length", ylim=(1e-16, 1e2))
            plot.ticks("x", sorted(shown["step"]))
        panels.append(Panel(plot.svg, f"Error over the step: {motion}.", motion))
    return Drawn(panels, numbers, rules.values())

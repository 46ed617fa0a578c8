"""The hard cases: the failing motion, and impacts at the touch."""

from __future__ import annotations

from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.plot import Plot, note
from reports.figures.style import MUTED, STYLES, LineStyle
from verification.table import Table

# world -> its name, the share of its rows after which that stands, and the way to it [points]
_NAMES = {
    "IAPB": ("IAPB", 0.1, (34.0, 6.0)),
    "PB": ("spring only", 0.5, (0.0, 12.0)),
    "ideal": ("rigid wall", 0.8, (0.0, 10.0)),
}


@recipe("the-failure", "hard-cases/the failure")
def the_failure(numbers: Table) -> Drawn:
    """Draw the kinetic energy over time in each world of the motion that fails."""
    with Plot("the-failure", (6.6, 2.9)) as plot:
        for world, (name, share, offset) in _NAMES.items():
            shown = numbers.where(world=world).select(("time", "kinetic energy")).rows
            look = STYLES[world]
            plot.curve(shown, look, marked=False)
            place = shown[int(share * len(shown))]
            note(plot.axes, place, name, offset, color=look.color, fontweight="bold")
        plot.axes.set(xlabel="time [s]", ylabel="kinetic energy [mJ]")
    alt = f"Kinetic energy over time: {numbers['case'][0]}."
    return Drawn([Panel(plot.svg, alt)], numbers)


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
            steps = sorted(shown["step"])
            plot.axes.set_xticks(steps, [f"{step:g}" for step in steps])
        panels.append(Panel(plot.svg, f"Error over the step: {motion}.", motion))
    return Drawn(panels, numbers, rules.values())

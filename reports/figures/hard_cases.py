"""The hard cases: the failing motion, every method on every case, and impacts at the touch."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from markupsafe import Markup

from reports.figures.figure import Drawn, Panel, cell, grid, recipe
from reports.figures.numbers import power_of_ten
from reports.figures.plot import Plot, note
from reports.figures.style import FORCE, GREEN, MUTED, STYLES, LineStyle
from verification.hard_cases.topic import ENGINE, IMPACT, MOTION
from verification.table import Table

# outcome -> mark, colour and strength of its cell
MARKS: Mapping[str, tuple[str, str, float]] = {
    "stable": ("✓", GREEN, 0.16),
    "gains energy": ("E", FORCE, 0.75),
    "wrong motion": ("W", FORCE, 0.32),
    "restitution unmet": ("R", FORCE, 0.32),
    "depends on rounding": ("N", FORCE, 0.32),
    "refused": ("X", MUTED, 0.3),
    "failed": ("X", MUTED, 0.3),
    "not tried": ("·", MUTED, 0.0),
}
WORDS = {
    "factored": "IAPB",
    "factored, no clamp": "IAPB, no clamp",
    "gram_pinv": "printed formula",
    "gram_cholesky": "Cholesky",
    "damped": "damped inverse",
    "svd": "SVD",
    "PB": "spring only",
    "ideal": "rigid wall",
    "ideal-friction": "rigid, friction",
    "Newton with Coulomb": "Newton, Coulomb",
}
# world -> share of the time at which its name stands, and the way to it [points]
_NAMES_AT = {"IAPB": (0.1, (34.0, 6.0)), "PB": (0.5, (0.0, 12.0)), "ideal": (0.7, (0.0, 10.0))}
Rows = list[dict[str, Any]]


@recipe("the-failure", "hard-cases/the failure")
def the_failure(numbers: Table) -> Drawn:
    """Draw the kinetic energy over time in each world of the motion that fails."""
    with Plot("the-failure", (6.6, 2.9)) as plot:
        for world in dict.fromkeys(numbers["world"]):
            shown = numbers.where(world=world).select(("time", "kinetic energy")).rows
            words = WORDS.get(world, world)
            look = replace(STYLES[world], name=words)
            plot.curve(shown, look, marked=False)
            share, offset = _NAMES_AT.get(world, (0.5, (0.0, 8.0)))
            place = min(shown, key=lambda point: abs(point[0] - share * shown[-1][0]))
            note(plot.axes, place, words, offset, color=look.color, fontweight="bold")
        plot.axes.set(xlabel="time [s]", ylabel="kinetic energy [mJ]")
    title = numbers.rows[0][0] if numbers.rows else ""
    return Drawn([Panel(plot.svg, f"Kinetic energy over time: {title}.")], numbers)


@recipe("method-map", "hard-cases/every method")
def method_map(numbers: Table) -> Drawn:
    """Draw a map of cases and methods for the impacts and one for the motions; cases in which no
    method fails share a row."""
    panels = []
    for kind, title in ((IMPACT, "Impacts"), (MOTION, "Motions")):
        rows = numbers.where(kind=kind).records()
        cases = len({row["case"] for row in rows})
        panels.append(
            Panel(_map_of(rows), f"{title} by method.", f"{title}: {cases} cases", wide=True)
        )
    return Drawn(panels)


def _map_of(rows: Rows) -> str:
    """Return the map of one kind as HTML: the engine's failures first, then those of most others."""
    methods = sorted({row["method"] for row in rows}, key=_order(rows))
    outcomes: dict[str, dict[str, str]] = {}
    for row in rows:
        outcomes.setdefault(row["case"], {})[row["method"]] = row["outcome"]
    hard = sorted(
        filter(lambda case: _fails(outcomes[case]), outcomes),
        key=lambda case: _rank(outcomes[case]),
    )
    lines: dict[str, Sequence[Markup]] = {
        _in_powers(case): [_cell(outcomes[case].get(method, "not tried")) for method in methods]
        for case in hard
    }
    easy = [found for case, found in outcomes.items() if case not in hard]
    lines[f"{len(easy)} more: no method fails"] = [
        _cell("stable" if any(method in found for found in easy) else "not tried")
        for method in methods
    ]
    lines["right, of all tried"] = [cell(_counted(rows, method)) for method in methods]
    return grid([WORDS.get(method, method) for method in methods], lines, "narrow")


def _in_powers(words: str) -> str:
    """Return the words with 1e-6 as 10⁻⁶."""
    return re.sub(r"\b1e-?\d+", lambda found: power_of_ten(float(found[0])), words)


def _cell(outcome: str) -> Markup:
    mark, color, strength = MARKS[outcome]
    return cell(mark, color=color, strength=strength)


def _fails(found: Mapping[str, str]) -> int:
    """Return the number of methods that were tried and are not right."""
    return sum(outcome not in ("stable", "not tried") for outcome in found.values())


def _rank(found: Mapping[str, str]) -> tuple[bool, int]:
    ours = next((found[name] for name in ENGINE if name in found), "stable")
    return ours == "stable", -_fails(found)


def _order(rows: Rows) -> Any:
    """Return the key that sorts methods: ours first, the others as they appear."""
    names = [*ENGINE, *dict.fromkeys(row["method"] for row in rows)]
    return names.index


def _counted(rows: Rows, method: str) -> str:
    tried = [
        row["outcome"] for row in rows if row["method"] == method and row["outcome"] != "not tried"
    ]
    return f"{tried.count('stable')}/{len(tried)}"


_RULES = {
    "error, impacts at the touch": STYLES["IAPB"],
    "error, impacts at the step": LineStyle(MUTED, "s", (5, 1.6), name="impacts at steps"),
    "error of MuJoCo": STYLES["MuJoCo"],
}
_TITLES = {
    "error, impacts at the touch": "IAPB, impacts at the touch",
    "error, impacts at the step": "IAPB, impacts at steps",
    "error of MuJoCo": "MuJoCo",
}
_FLOOR = 1e-16  # errors below are drawn here


@recipe("impacts-at-the-touch", "hard-cases/touch")
def impacts_at_the_touch(numbers: Table) -> Drawn:
    """Draw the error of each motion over the step, for both rules and for MuJoCo."""
    panels = []
    rules = [key for key in _RULES if key in numbers.keys]
    for motion in dict.fromkeys(numbers["motion"]):
        shown = numbers.where(motion=motion)
        with Plot(f"touch-{motion.replace(' ', '-')}", (3.1, 2.5)) as plot:
            for key in rules:
                points = shown.select(("step", key)).rows
                plot.curve([(step, max(error, _FLOOR)) for step, error in points], _RULES[key])
            plot.log("step [ms]", "error, of its length", ylim=(1e-16, 1e2))
            plot.ticks("x", sorted(shown["step"]))
        panels.append(Panel(plot.svg, f"Error over the step: {motion}.", motion))
    legend = {_TITLES[key]: _RULES[key] for key in rules}
    return Drawn(panels, numbers, legend)

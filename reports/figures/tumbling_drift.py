"""A free body tumbles: attitude error and drifts of each integrator against the step, with the declared slopes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from reports.figures.energy_gains import plain_powers
from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.style import CYCLE, PANEL, STYLES, LineStyle, line_arguments, styled
from reports.figures.svg import to_svg
from verification.finding import Table

KEY, TITLE, INPUT = "tumbling-drift", "A free body tumbles", "mechanics/tumbling"
MOTION = "turning over"
PANELS = {
    "energy drift": "Kinetic energy", "momentum drift": "Angular momentum",
    "attitude error": "Attitude",
}  # fmt: skip
_LABELS = {"energy drift": "energy drift (relative)", "momentum drift": "momentum drift (relative)",
           "attitude error": "attitude error [rad]"}  # fmt: skip
CAPTION = (
    "A body turns over and over near its middle axis, with no force on it; its motion is known in closed form. Each "
    "mark is a run of two seconds; the dashed lines have the slope that the integrator declares. Runge-Kutta 4 is "
    "there twice: the compiled step adds up its stages in one displacement and declares order 2 on rotations for "
    "that. Its energy needs no attitude, so that it falls as fast as in the other form (the marks coincide)."
)
# (integrator, form) -> (name, look); in the other integrators both forms are the same
SERIES = {
    ("semi_implicit_euler", "compiled step"): ("semi-implicit Euler", CYCLE[0]),
    ("midpoint", "compiled step"): ("midpoint", CYCLE[1]),
    ("runge_kutta_4", "compiled step"): ("Runge-Kutta 4, compiled step", replace(CYCLE[2], filled=False)),
    ("runge_kutta_4", "Integrator.step"): ("Runge-Kutta 4, Integrator.step", CYCLE[3]),
}


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw one panel per quantity."""
    numbers: Table = inputs[INPUT]
    rows = numbers.records()
    series = {key: [row for row in rows if (row["integrator"], row["form"]) == key and row["motion"] == MOTION]
              for key in SERIES}  # fmt: skip
    panels = tuple(Panel(_panel(series, column, name), _words(series, column, name), name)
                   for column, name in PANELS.items())  # fmt: skip
    legend = (*SERIES.values(), ("declared slope", STYLES["bound"]))
    return Figure(KEY, "", TITLE, CAPTION, panels, numbers, legend, (INPUT,))


Series = Mapping[tuple[str, str], Sequence[Mapping[str, Any]]]


def _panel(series: Series, column: str, name: str) -> str:
    with styled() as new_figure:
        drawing = new_figure(figsize=PANEL, layout="constrained")
        axes = drawing.add_subplot()
        for key, (_, look) in SERIES.items():
            steps = [row["step"] for row in series[key]]
            values = [row[column] for row in series[key]]
            order = series[key][0]["declared order"]
            size = 5 if look.filled else 9  # so that marks which coincide are both seen
            axes.plot(steps, values, **line_arguments(look) | {"linestyle": "none", "markersize": size})
            axes.plot(steps, [values[0] * (step / steps[0]) ** order for step in steps],
                      **line_arguments(LineStyle(look.color, "", STYLES["bound"].dash, 1.2)))  # fmt: skip
        axes.set(xscale="log", yscale="log", xlabel="step [s]", ylabel=_LABELS[column])
        plain_powers(axes)
        return to_svg(drawing, f"{KEY}-{name.split()[-1].lower()}")


def _words(series: Series, column: str, name: str) -> str:
    ends = "; ".join(f"{SERIES[key][0]} {rows[0][column]:.1e} to {rows[-1][column]:.1e}"
                     for key, rows in series.items())  # fmt: skip
    return f"{name} against the step, coarsest to finest: {ends}."


RECIPE = Recipe(KEY, "", TITLE, (INPUT,), draw, section="mechanics")

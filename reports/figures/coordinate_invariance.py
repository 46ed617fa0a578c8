"""C06: the same impact in two parametrizations, its error against the bound, through the singular pose of the arm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from reports.figures.canvas import note
from reports.figures.energy_gains import plain_powers
from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.style import CYCLE, MUTED, STYLES, LineStyle, line_arguments, styled
from reports.figures.svg import to_svg
from verification.finding import Table

KEY, TITLE, INPUT = "coordinate-invariance", "The same impact in other coordinates", "mechanics/coordinate invariance"
CAPTION = (
    "An arm is struck; the outcome in joint angles is compared with the one computed in other coordinates and "
    "brought back. First panel: the elbow straightens from left to right. At the singular pose the place of the "
    "hand is no coordinate any more: bound (dashed) and error climb on the way. Absolute angles pass through it "
    "unharmed; their last mark is the straight arm itself. Second panel: every case, nearly dependent rows among "
    "them; below the dashed line the bound C ε κ/σ_min is kept."
)
ANGLES, HAND = "absolute angles", "place of the hand"
LOOKS = {ANGLES: CYCLE[0], HAND: CYCLE[1]}
ZERO = 1e-13  # [rad] where the straight arm itself is drawn, on an axis that has no zero
SMALLEST = 1e-18  # an error of zero is drawn here
SHOWN = ("one", "two, separated")  # contacts of the first panel: well conditioned ones
_SIZE = (4.3, 3.3)


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw both panels."""
    numbers: Table = inputs[INPUT]
    rows = numbers.records()
    panels = (Panel(_through_the_pose(rows), _words(rows), "Towards the straight arm"),
              Panel(_against_the_bound(rows), _words(rows), "Error against bound"))  # fmt: skip
    legend = (*((f"in {name}" if name == ANGLES else f"in the {name}", look) for name, look in LOOKS.items()),
              ("bound", STYLES["bound"]))  # fmt: skip
    return Figure(KEY, "", TITLE, CAPTION, panels, numbers, legend, (INPUT,))


def _through_the_pose(rows: Sequence[Mapping[str, Any]]) -> str:
    with styled() as new_figure:
        drawing = new_figure(figsize=_SIZE, layout="constrained")
        axes = drawing.add_subplot()
        for name, look in LOOKS.items():
            mine = [row for row in rows if row["coordinates"] == name and row["contacts"] in SHOWN]
            elbows = sorted({row["elbow"] for row in mine}, reverse=True)
            bounds = [max(row["bound"] for row in mine if row["elbow"] == elbow) for elbow in elbows]
            axes.plot([max(e, ZERO) for e in elbows], bounds, **_dashed(look))
            errors = [(max(row["elbow"], ZERO), max(row["error"], SMALLEST)) for row in mine
                      if row["error"] is not None]  # fmt: skip
            axes.plot(*zip(*errors, strict=True), **_marks(look))
        axes.axhline(1.0, color=MUTED, linewidth=0.8)
        axes.set(xscale="log", yscale="log", xlabel="angle of the elbow [rad], straight at the right end",
                 ylabel="error of v⁺, kinetic metric")
        axes.xaxis.set_inverted(True)
        plain_powers(axes)
        note(axes, (1.0, 1.0), "no digit is right above", (0, 7), ha="left", color=MUTED, fontsize=8)
        return to_svg(drawing, f"{KEY}-pose")


def _against_the_bound(rows: Sequence[Mapping[str, Any]]) -> str:
    with styled() as new_figure:
        drawing = new_figure(figsize=_SIZE, layout="constrained")
        axes = drawing.add_subplot()
        for name, look in LOOKS.items():
            points = [(row["bound"], max(row["error"], SMALLEST)) for row in rows
                      if row["coordinates"] == name and row["error"] is not None]  # fmt: skip
            axes.plot(*zip(*points, strict=True), **_marks(look))
        low, high = 1e-15, max(row["bound"] for row in rows)
        axes.plot([low, high], [low, high], **line_arguments(STYLES["bound"], marked=False))
        axes.axvline(1.0, color=MUTED, linewidth=0.8)
        axes.set(xscale="log", yscale="log", xlabel="bound C ε κ(M) κ(∂f/∂r)² / σ_min", ylabel="error of v⁺",
                 ylim=(0.3 * SMALLEST, 1e4))
        plain_powers(axes)
        note(axes, (1.0, 1e-17), "the bound says nothing beyond", (4, 0), ha="left", color=MUTED, fontsize=8)
        return to_svg(drawing, f"{KEY}-bound")


def _marks(look: LineStyle) -> dict[str, Any]:
    return {**line_arguments(look), "linestyle": "none", "markersize": 5}


def _dashed(look: LineStyle) -> dict[str, Any]:
    return line_arguments(LineStyle(look.color, "", STYLES["bound"].dash, 1.3))


def _words(rows: Sequence[Mapping[str, Any]]) -> str:
    told = [row for row in rows if row["bound"] < 1.0 and row["error"] is not None]
    share = max(row["error"] / row["bound"] for row in told)
    return f"{len(told)} cases with a bound below 1; the largest error is {share:.1e} of its bound."


RECIPE = Recipe(KEY, "", TITLE, (INPUT,), draw, section="mechanics")

"""Passivity in floating point: the largest relative energy gain of random impacts, over the condition of M."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.style import CYCLE, STYLES, line_arguments, series_legend, styled
from reports.figures.svg import to_svg
from verification.finding import Table

KEY, TITLE = "energy-gains", "Does rounding make energy?"
INPUT = "energy_gains"  # Table with at least the columns below, one row per method and decade of κ(M)
METHOD, CONDITION, GAIN, SHARE = (
    "method", "condition of M from", "largest relative energy gain", "gain / (10 d ε √κ)",
)
CAPTION = (
    "The worst of all random impacts in each decade of κ(M). First picture: the gain itself; second: the gain as a "
    "share of the bound 10 d ε √κ that the factored form promises. Above the dashed line the promise is broken."
)
_SIZE = (4.1, 3.0)
_SMALLEST = 1e-18  # no gain at all is drawn here: a tenth of what double precision can show


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw both panels from the table of the bulk study."""
    numbers: Table = inputs[INPUT]
    methods = tuple(dict.fromkeys(numbers.column(METHOD)))
    panels = (Panel(_curves(numbers, GAIN, methods, "relative gain", None), _words(numbers), "largest gain"),
              Panel(_curves(numbers, SHARE, methods, "gain / bound", 1.0), "The same as a share of the bound.",
                    "as a share of 10 d ε √κ"))
    return Figure(KEY, "", TITLE, CAPTION, panels, numbers, series_legend(methods), (INPUT,))


def series(numbers: Table, method: str, column: str) -> tuple[list[float], list[float]]:
    """Return the conditions and the values of one method, without the row that sums up all of them."""
    rows = [row for row in numbers.where(method=method).records() if row[CONDITION] != "all"]
    return [float(row[CONDITION]) for row in rows], [float(row[column]) for row in rows]


def _curves(numbers: Table, column: str, methods: tuple[str, ...], label: str, bound: float | None) -> str:
    with styled() as new_figure:
        drawing = new_figure(figsize=_SIZE, layout="constrained")
        axes = drawing.add_subplot()
        for number, method in enumerate(methods):
            condition, value = series(numbers, method, column)
            axes.plot(condition, [max(v, _SMALLEST) for v in value], **line_arguments(CYCLE[number % len(CYCLE)]))
        if bound is not None:
            axes.axhline(bound, **line_arguments(STYLES["bound"]))
        axes.set(xscale="log", yscale="log", xlabel="condition κ(M), from", ylabel=label)
        plain_powers(axes)
        return to_svg(drawing, f"{KEY}-{'share' if bound else 'gain'}")


def plain_powers(axes: Any) -> None:
    """Label logarithmic axes with powers of ten as plain text (mathematical text is no text in an SVG)."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    from reports.figures.numbers import power_of_ten

    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(numticks=7))
        axis.set_major_formatter(FuncFormatter(lambda value, _: power_of_ten(value)))
        axis.set_minor_locator(NullLocator())


def _words(numbers: Table) -> str:
    worst = {row[METHOD]: row[GAIN] for row in numbers.records() if row[CONDITION] == "all"}
    return "Largest relative energy gain of all impacts: " + ", ".join(f"{m} {g:.1e}" for m, g in worst.items()) + "."


RECIPE = Recipe(KEY, "", TITLE, (INPUT,), draw, section="properties")

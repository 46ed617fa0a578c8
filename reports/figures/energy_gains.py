"""Passivity in floating point: the largest relative energy gain of random impacts, over the
condition of M."""

from __future__ import annotations

from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.plot import Plot
from reports.figures.style import BOUND, line_arguments, looks_of
from verification.table import Table

_SMALLEST = 1e-18  # no gain at all is drawn here: a tenth of what double precision can show
# columns of the input, which has a row per method and decade of κ(M), and a last row of each method
# for all of them
METHOD, CONDITION, GAIN, SHARE = (
    "method",
    "condition of M from",
    "largest relative energy gain",
    "gain / (10 d ε √κ)",
)


@recipe("energy-gains", "energy-gains/impacts")
def energy_gains(numbers: Table) -> Drawn:
    """Draw both panels from the table of the bulk study."""
    looks, panels = looks_of(numbers.column(METHOD)), []
    worst = ", ".join(
        f"{row[METHOD]} {row[GAIN]:.1e}" for row in numbers.where(**{CONDITION: "all"}).records()
    )
    decades = numbers.only(condition != "all" for condition in numbers.column(CONDITION))
    for key, column, label, alt, title in (
        (
            "gain",
            GAIN,
            "relative gain",
            f"Largest relative energy gain of all impacts: {worst}.",
            "largest gain",
        ),
        (
            "share",
            SHARE,
            "gain / bound",
            "The same as a share of the bound.",
            "as a share of 10 d ε √κ",
        ),
    ):
        with Plot(f"energy-gains-{key}") as plot:
            for method, look in looks.items():
                points = decades.where(method=method).select((CONDITION, column)).rows
                plot.curve(
                    [(float(condition), max(value, _SMALLEST)) for condition, value in points], look
                )
            if key == "share":
                plot.axes.axhline(1.0, **line_arguments(BOUND))
            plot.log("condition κ(M), from", label)
        panels.append(Panel(plot.svg, alt, title))
    return Drawn(panels, numbers, looks)

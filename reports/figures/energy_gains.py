"""Passivity in floating point: the largest relative energy gain of random impacts, over the condition of M."""

from __future__ import annotations

from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.plot import Plot
from reports.figures.style import BOUND, line_arguments, looks_of
from verification.table import Table

_SMALLEST = 1e-18  # no gain at all is drawn here: a tenth of what double precision can show
# columns of the input, which has a row per method and decade of κ(M)
METHOD, CONDITION, GAIN, SHARE = "method", "condition of M from", "largest relative energy gain", "gain / (10 d ε √κ)"


@recipe(
    "energy-gains", "Does rounding make energy?", "energy-gains/impacts", section="properties",
    caption="The largest energy gain of all random impacts in each decade of the condition number κ(M). First picture: "
    "the relative gain. Second picture: the gain divided by the bound 10 d ε √κ of the factored form; above the dashed "
    "line a method exceeds this bound.",
)  # fmt: skip
def energy_gains(numbers: Table) -> Drawn:
    """Draw both panels from the table of the bulk study."""
    looks = looks_of(numbers.column(METHOD))
    worst = ", ".join(f"{row[METHOD]} {row[GAIN]:.1e}" for row in numbers.where(**{CONDITION: "all"}).records())
    panels = []
    for column, label, bound, alt, title in (
        (GAIN, "relative gain", None, f"Largest relative energy gain of all impacts: {worst}.", "largest gain"),
        (SHARE, "gain / bound", 1.0, "The same as a share of the bound.", "as a share of 10 d ε √κ"),
    ):  # fmt: skip
        with Plot(f"energy-gains-{'share' if bound else 'gain'}") as plot:
            for method, look in looks.items():
                condition, value = series(numbers, method, column)
                plot.curve(zip(condition, [max(v, _SMALLEST) for v in value], strict=True), look)
            if bound is not None:
                plot.axes.axhline(bound, **line_arguments(BOUND))
            plot.log("condition κ(M), from", label)
        panels.append(Panel(plot.svg, alt, title))
    return Drawn(tuple(panels), numbers, tuple(looks.items()))


def series(numbers: Table, method: str, column: str) -> tuple[list[float], list[float]]:
    """Return the condition numbers and the values of one method, without its summary row."""
    rows = [row for row in numbers.where(method=method).records() if row[CONDITION] != "all"]
    return [float(row[CONDITION]) for row in rows], [float(row[column]) for row in rows]

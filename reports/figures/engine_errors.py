"""Tables of coloured cells by engine and scene: energy error, momentum error and overlap."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.plot import Plot
from reports.figures.style import AMBER, BLUE, INK, MUTED, RULE, SKY, VERMILION, LineStyle
from verification.finding import Table

LEVELS = ((1e-6, BLUE, 0.75), (1e-2, SKY, 0.55), (1e-1, AMBER, 0.6), (float("inf"), VERMILION, 0.75))
NAMES = ("to 10⁻⁶", "to 10⁻²", "to 10⁻¹", "above")
ROUNDING = 1e-15
ENGINE, SCENE, CHOICE, LAW = "engine", "scene", "settings", "law"
PANELS = (("energy error", "energy error"), ("momentum error", "momentum error"), ("overlap / size", "overlap"))


@recipe(
    "engine-errors", "Energy, momentum and overlap, by engine", "engines/errors", section="engines",
    caption="One row per engine and choice of settings, one column per scene. First picture: error of the energy at "
    "the end, relative to the energy at the start (resting scenes: its largest rise). Second: error of the momentum at "
    "the end, relative to the sum of m |v|; resting scenes have none. Third: the deepest overlap, relative to the "
    "bodies' size. The numbers are powers of ten; ε means rounding or zero. A cross: the run failed. Hatching: the "
    "engine is not installed.",
)  # fmt: skip
def engine_errors(numbers: Table) -> Drawn:
    """Draw the three tables."""
    rows = numbers.records()
    panels = tuple(Panel(_cells(rows, column, label), _words(rows, column), label) for column, label in PANELS)
    legend = tuple((name, LineStyle(color, "s", (), 0.0)) for name, (_, color, _) in zip(NAMES, LEVELS, strict=True))
    return Drawn(panels, numbers, legend)


def value_of(row: Mapping[str, Any], column: str) -> float | None:
    """Return the absolute value of a cell; without an energy error, return the largest rise of energy."""
    value = row[column]
    if value is None and column == "energy error":
        value = row["largest rise of energy"]
    return None if value is None else abs(value)


def _cells(rows: list[dict[str, Any]], column: str, label: str) -> str:
    lines = list(dict.fromkeys((row[ENGINE], row[CHOICE]) for row in rows))
    scenes = list(dict.fromkeys(row[SCENE] for row in rows))
    with Plot(f"engine-errors-{label.replace(' ', '-')}", (5.4, 0.25 * len(lines) + 1.75)) as plot:
        axes = plot.axes
        for row in rows:
            _cell(axes, scenes.index(row[SCENE]), lines.index((row[ENGINE], row[CHOICE])), row, column)
        axes.set_xticks(range(len(scenes)), scenes, rotation=40, ha="left", rotation_mode="anchor")
        axes.xaxis.tick_top()
        axes.set_yticks(range(len(lines)), [f"{engine}, {_at(choice)}" for engine, choice in lines])
        axes.set(xlim=(-0.5, len(scenes) - 0.5), ylim=(len(lines) - 0.5, -0.5))
        axes.tick_params(length=0)
        plot.without_lines()
    return plot.svg


def _cell(axes: Any, x: int, y: int, row: Mapping[str, Any], column: str) -> None:
    from matplotlib.patches import Rectangle

    corner = (x - 0.46, y - 0.44)
    value = value_of(row, column)
    if row[LAW] == "not installed":
        axes.add_patch(Rectangle(corner, 0.92, 0.88, facecolor="none", edgecolor=MUTED, hatch="////", linewidth=0.4))
    elif row[LAW] == "failed":
        axes.plot(x, y, "X", color=VERMILION, markersize=7)
    elif value is None:
        axes.add_patch(Rectangle(corner, 0.92, 0.88, facecolor=RULE, alpha=0.35, linewidth=0))
    else:
        color, strength = next((color, strength) for most, color, strength in LEVELS if value <= most)
        axes.add_patch(Rectangle(corner, 0.92, 0.88, facecolor=color, alpha=strength, linewidth=0))
        axes.text(x, y, exponent(value), ha="center", va="center", fontsize=8, color=INK)


def exponent(value: float) -> str:
    """Return the nearest power of ten as text, or ε for a value below rounding."""
    from math import log10

    return "ε" if value < ROUNDING else f"{round(log10(value))}".replace("-", "\N{MINUS SIGN}")


def _at(choice: str) -> str:
    return "own" if choice == "own" else "1 ms"


def _words(rows: list[dict[str, Any]], column: str) -> str:
    said = []
    for engine in dict.fromkeys(row[ENGINE] for row in rows):
        mine = [row for row in rows if row[ENGINE] == engine]
        known = [(value, row) for row in mine if (value := value_of(row, column)) is not None]
        if known:
            worst, where = max(known, key=lambda pair: pair[0])
            said.append(f"{engine} at most {worst:.1e}, in {where[SCENE]} ({_at(where[CHOICE])})")
        else:
            said.append(f"{engine}: none, {mine[0][LAW]}")
    return f"{column.capitalize()}: " + "; ".join(said) + "."

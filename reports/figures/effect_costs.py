"""What leaving an effect out would save, against the error that this would make: a panel per scene."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.labels import label_marks
from reports.figures.numbers import power_of_ten
from reports.figures.style import STYLES, line_arguments, styled
from reports.figures.svg import to_svg
from verification.finding import Table

KEY, TITLE, INPUT = "effect-costs", "What leaving an effect out saves, and what it breaks", "effect_costs"
SCENE, EFFECT, SAVED, ERROR, BEST = "scene", "effect", "time saved", "error", "best of its error"
CAPTION = (
    "Each mark is one effect left out of a scene that calls for it: to the right it saves time, upwards it takes the "
    "tool away from where it should be. Filled marks, joined: no other effect saves more for less error. Marks on the "
    "lowest line change nothing on this run; a few per cent to either side are within the noise of the clock."
)
_NOTHING = 1e-4  # [mm] where an error of zero is drawn
_SIZE = (4.6, 3.6)


def draw(inputs: Mapping[str, Any]) -> Figure:
    """A panel per scene."""
    numbers: Table = inputs[INPUT]
    rows = numbers.records()
    panels = tuple(
        Panel(_marks([row for row in rows if row[SCENE] == scene], scene),
              f"{scene}: error against time saved for {', '.join(row[EFFECT] for row in rows if row[SCENE] == scene)}.",
              scene) for scene in dict.fromkeys(row[SCENE] for row in rows)
    )  # fmt: skip
    return Figure(KEY, "", TITLE, CAPTION, panels, numbers, (), (INPUT,))


def _marks(rows: list[dict[str, Any]], scene: str) -> str:
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    with styled() as new_figure:
        drawing = new_figure(figsize=_SIZE, layout="constrained")
        axes = drawing.add_subplot()
        look = line_arguments(STYLES["IAPB"])
        front = sorted((row[SAVED], max(row[ERROR], _NOTHING)) for row in rows if row[BEST] == "yes")
        axes.plot(*zip(*front, strict=True), **look | {"linewidth": 0.8})
        others = [(row[SAVED], max(row[ERROR], _NOTHING)) for row in rows if row[BEST] != "yes"]
        if others:
            axes.plot(*zip(*others, strict=True), **line_arguments(STYLES["cannot tell"]) | {"linestyle": "none"})
        axes.set(yscale="log", xlabel="time of the step saved [%]", ylabel="error [mm]")
        axes.margins(x=0.35, y=0.12)
        axes.yaxis.set_major_locator(LogLocator(numticks=8))
        axes.yaxis.set_major_formatter(FuncFormatter(_tick))
        axes.yaxis.set_minor_locator(NullLocator())
        label_marks(axes, [row[EFFECT].replace("_", " ") for row in rows],
                    [(row[SAVED], max(row[ERROR], _NOTHING)) for row in rows])  # fmt: skip
        return to_svg(drawing, f"{KEY}-{scene}")


def _tick(error: float, _: int) -> str:
    return power_of_ten(error) if error > _NOTHING else "none"


RECIPE = Recipe(KEY, "", TITLE, (INPUT,), draw, section="effects")

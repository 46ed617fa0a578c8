"""Figure: one drawing of the report as plain values. Recipe: the inputs of a figure and its drawing function.

A figure consists of a few SVG panels (they wrap on a narrow screen), a legend, a caption that says what to see, and
the numbers behind it. This module depends neither on matplotlib nor on the page.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from reports.figures.style import LineStyle
from verification.finding import Table

Legend = tuple[tuple[str, LineStyle], ...]


@dataclass(frozen=True)
class Panel:
    """One SVG drawing; `label` is its heading, `alt` its description for readers who cannot see it."""

    svg: str
    alt: str
    label: str = ""
    wide: bool = False  # take the whole width of the page
    film: bool = False  # played by the browser (reports/figures/film.py)


@dataclass(frozen=True)
class Drawn:
    """The result of a recipe's function; a non-empty `caption` replaces the caption of the recipe."""

    panels: tuple[Panel, ...]
    numbers: Table | None = None
    legend: Legend = ()
    caption: str = ""


@dataclass(frozen=True)
class Figure:
    """A drawn figure. `number` is its number in the paper ("Figure 7"), or empty for a figure of this project."""

    key: str
    number: str
    title: str
    caption: str
    panels: tuple[Panel, ...]
    numbers: Table | None = None
    legend: Legend = ()
    inputs: tuple[str, ...] = ()  # names of the runs and tables it was drawn from


@dataclass(frozen=True)
class NotComputed:
    """The substitute for a figure that was not drawn: its title, and which inputs are missing."""

    key: str
    number: str
    title: str
    missing: tuple[str, ...] = field(default=())


@dataclass(frozen=True)
class Recipe:
    """The recipe of a figure: `draw` gets the inputs named in `needs`, by name, and returns the Figure.

    If an input in `needs` is missing, the figure is not drawn, and the page says so.
    """

    key: str
    number: str
    title: str
    needs: tuple[str, ...]
    draw: Callable[[Mapping[str, Any]], Figure | NotComputed]
    section: str = "figures"

    def missing(self, inputs: Mapping[str, Any]) -> tuple[str, ...]:
        """Return the names in `needs` for which there is no input."""
        return tuple(name for name in self.needs if inputs.get(name) is None)


def recipe(
    key: str, title: str, *needs: str, caption: str, section: str = "figures", number: str = ""
) -> Callable[[Callable[..., Drawn]], Recipe]:
    """Make a recipe from the decorated function, which gets one argument per input."""

    def made(function: Callable[..., Drawn]) -> Recipe:
        def draw(inputs: Mapping[str, Any]) -> Figure:
            drawn = function(*(inputs[name] for name in needs))
            told = drawn.caption or caption
            return Figure(key, number, title, told, drawn.panels, drawn.numbers, drawn.legend, needs)

        return Recipe(key, number, title, needs, draw, section)

    return made


def draw(recipe: Recipe, inputs: Mapping[str, Any]) -> Figure | NotComputed:
    """Draw one figure, or return which of its inputs are missing."""
    missing = recipe.missing(inputs)
    if missing:
        return NotComputed(recipe.key, recipe.number, recipe.title, missing)
    return recipe.draw({name: inputs[name] for name in recipe.needs})

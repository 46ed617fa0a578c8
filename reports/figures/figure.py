"""Figure: one drawing of the report as plain values. Recipe: the inputs of a figure and its drawing function.

A figure consists of a few panels (they wrap on a narrow screen), each one SVG or a table of coloured cells, a legend, a
caption that says what to see, and the numbers behind it. This module depends neither on matplotlib nor on the page.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from markupsafe import Markup

from reports.figures.style import LineStyle, css
from verification.table import Table

Legend = tuple[tuple[str, LineStyle], ...]


@dataclass(frozen=True)
class Panel:
    """One drawing; `label` is its heading, `alt` its description for readers who cannot see it."""

    svg: str  # or the HTML of a table (`grid`)
    alt: str
    label: str = ""
    wide: bool = False  # take the whole width of the page
    film: bool = False  # played by the browser (reports/figures/film.py)

    @property
    def is_table(self) -> bool:
        """Whether the panel is a table."""
        return self.svg.startswith("<table")


@dataclass(frozen=True)
class Cell:
    """A cell of a table: its text, a smaller note below, and a colour of the text or, with a strength, of the cell."""

    text: str | Markup = ""
    note: str = ""
    color: str = ""
    strength: float = 0.0
    hatched: bool = False

    @property
    def html(self) -> Markup:
        """The cell as HTML."""
        look = f"color: {css(self.color)}" if self.color else ""
        if self.strength:
            look = f"background: color-mix(in srgb, {css(self.color)} {100 * self.strength:g}%, transparent)"
        note = Markup("<small>{}</small>").format(self.note) if self.note else ""
        marked = Markup(' class="hatched"') if self.hatched else ""
        return Markup('<td{}{}>{}{}</td>').format(marked, Markup(' style="{}"').format(look) if look else "",
                                                  self.text, note)


def grid(columns: Sequence[str], rows: Mapping[str, Sequence[Cell]], kind: str = "") -> str:
    """Return a table of cells as HTML: a heading for each column and, as text or Markup, for each row.

    kind : "upright" for headings of columns that take less width, "plain" for texts instead of coloured cells
    """
    join = Markup("").join
    head = join(Markup('<th scope="col"><span>{}</span></th>').format(column) for column in columns)
    body = join(Markup('<tr><th scope="row">{}</th>{}</tr>').format(name, join(cell.html for cell in cells))
                for name, cells in rows.items())  # fmt: skip
    return Markup('<table class="grid {}"><thead><tr><td></td>{}</tr></thead><tbody>{}</tbody></table>').format(
        kind, head, body)  # fmt: skip


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

"""A drawn figure as plain values, and the recipe that draws it.

A figure has a few panels (they wrap on a narrow screen), a legend, a caption that says what to see,
and the numbers behind it. Titles and captions are in figures.toml, in page order. This module
depends neither on matplotlib nor on the page.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.resources import files
from typing import Any

from markupsafe import Markup

from reports.figures.style import PAPER, LineStyle, css
from verification.finding import Failure, attempt
from verification.table import Table, titled

Legend = Mapping[str, LineStyle] | Iterable[tuple[str, LineStyle]]


@dataclass(frozen=True)
class Panel:
    """One drawing; `label` is its heading, `alt` its description for readers who cannot see it."""

    svg: str
    alt: str
    label: str = ""
    wide: bool = False  # take the whole width of the page


def diagram(name: str, alt: str, label: str = "") -> Panel:
    """Return a diagram of the folder drawings/, which was drawn once."""
    svg = files(__package__).joinpath("drawings", f"{name}.svg").read_text("utf-8")
    return Panel(svg, alt, label)


@dataclass(frozen=True)
class Drawn:
    """The result of a recipe's function.

    told : the values that the texts name
    same : whether our numbers say each statement of the paper, by its name
    dots : titles of the columns of `numbers` that the page draws as dots
    """

    panels: Sequence[Panel]
    numbers: Table | None = None
    legend: Legend = ()
    told: Mapping[str, Any] = field(default_factory=dict)
    same: Mapping[str, bool] = field(default_factory=dict)
    dots: tuple[str, ...] = ()


@dataclass(frozen=True)
class Figure:
    """A figure. `number` is its number in the paper ("Figure 7"), or empty for a figure of this
    project.

    Attributes
    ----------
    inputs : names of the runs and tables it was drawn from; missing : those that it lacks, so that
        it has no panels
    said : what the paper says, and what we find; same : whether our numbers say the same, by
        statement
    claims : the claims that it shows
    dots : columns of `numbers` that are drawn as dots
    """

    key: str
    number: str
    title: str
    caption: str = ""
    panels: tuple[Panel, ...] = ()
    numbers: Table | None = None
    legend: tuple[tuple[str, LineStyle], ...] = ()
    inputs: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    said: tuple[str, ...] = ()
    same: Mapping[str, bool] = field(default_factory=dict)
    dots: tuple[str, ...] = ()
    claims: tuple[str, ...] = ()


def statements(figures: Iterable[Figure]) -> Table:
    """Return a row for each statement of the paper on a figure, and whether our numbers say the
    same."""
    rows = [(one.number, name, held) for one in figures for name, held in one.same.items()]
    return titled(("figure", "statement", "same"), rows)


def numbers_of(figures: Iterable[Figure]) -> dict[str, Any]:
    """Return how many figures say the same as the paper's, and which do so only in part or not at
    all."""
    judged = [figure for figure in figures if figure.same]
    differ = [one for one in judged if not all(one.same.values())]
    return {
        "figures": len(judged),
        "figures_same": len(judged) - len(differ),
        "figures_that_differ": " and ".join(one.number.removeprefix("Figure ") for one in differ),
    }


@dataclass(frozen=True)
class Recipe:
    """The recipe of a figure: `function` gets the inputs named in `needs`; the texts of `key` are
    in figures.toml."""

    key: str
    needs: tuple[str, ...]
    function: Callable[..., Drawn]


TEXTS: Mapping[str, Mapping[str, Any]] = tomllib.loads(
    files(__package__).joinpath("figures.toml").read_text("utf-8")
)
MADE: dict[str, Recipe] = {}


def recipe(key: str, *needs: str) -> Callable[[Callable[..., Drawn]], Recipe]:
    """Make the recipe `key` of figures.toml from the decorated function, which gets one argument
    per input."""

    def made(function: Callable[..., Drawn]) -> Recipe:
        MADE[key] = Recipe(key, needs, function)
        return MADE[key]

    return made


def draw(
    recipe: Recipe, inputs: Mapping[str, Any], failures: list[Failure] | None = None
) -> Figure:
    """Draw one figure; it has no panels if inputs are missing, which it names, or if it raises,
    which `failures` notes.

    If `failures` is None, an exception propagates.
    """
    text = TEXTS[recipe.key]
    missing = tuple(name for name in recipe.needs if inputs.get(name) is None)
    bare = Figure(
        recipe.key,
        text.get("number", ""),
        text["title"],
        missing=missing,
    )

    def drawn() -> Figure:
        made = recipe.function(*(inputs[name] for name in recipe.needs))
        caption, *said = (
            " ".join(words.split()).format(**made.told)
            for words in (text.get("caption", ""), *text.get("said", ()))
        )
        return replace(
            bare,
            caption=caption,
            panels=tuple(made.panels),
            numbers=made.numbers,
            legend=tuple(dict(made.legend).items()),
            inputs=recipe.needs,
            said=tuple(said),
            same=made.same,
            dots=made.dots,
            claims=text.get("claims", ()),
        )

    return (None if missing else attempt(recipe.key, drawn, failures)) or bare


_MARKERS = {  # paths around (18, 7)
    "o": "M14.4 7a3.6 3.6 0 1 0 7.2 0a3.6 3.6 0 1 0 -7.2 0z",
    "s": "M14.6 3.6h6.8v6.8h-6.8z",
    "^": "M18 2.6 22 10.4 14 10.4z",
    "v": "M18 11.4 22 3.6 14 3.6z",
    "<": "M13.6 7 21.4 11V3z",
    ">": "M22.4 7 14.6 11V3z",
    "D": "M18 2.4 22.6 7 18 11.6 13.4 7z",
    "d": "M18 2 20.6 7 18 12 15.4 7z",
    "P": "M16.4 3h3.2v2.4H22v3.2h-2.4V11h-3.2V8.6H14V5.4h2.4z",
    "|": "M17 2h2v10h-2z",
    "X": "M14.5 5 16 3.5l2 2 2-2L21.5 5l-2 2 2 2L20 10.5l-2-2-2 2L14.5 9l2-2z",
    "*": "M18 2l1.4 3.4 3.6.2-2.8 2.3 1 3.6L18 9.5l-3.2 2 1-3.6L13 5.6l3.6-.2z",
}


def swatch(look: LineStyle) -> Markup:
    """Return the line and marker of a style, for legends, as a small inline SVG."""
    line = marker = ""
    if look.width:
        dash = (
            f' stroke-dasharray="{" ".join(f"{1.6 * part:g}" for part in look.dash)}"'
            if look.dash
            else ""
        )
        line = f'<path d="M1 7H35" fill="none" stroke="{css(look.color)}" stroke-width="{look.width * 1.25:g}"{dash}/>'
    if look.marker:
        fill, edge = (look.color, PAPER) if look.filled else (PAPER, look.color)
        marker = f'<path fill="{css(fill)}" stroke="{css(edge)}" d="{_MARKERS[look.marker]}"/>'
    return Markup(
        f'<svg class="swatch" viewBox="0 0 36 14" aria-hidden="true">{line}{marker}</svg>'
    )

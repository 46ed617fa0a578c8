"""One colour and one marker per world and per method in every figure; at most six series in a plot, each named at its
curve. The tests read what was drawn: every call of matplotlib, every panel, every legend."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from matplotlib.axes import Axes

import reports.figures
from iapb.run import Run
from reports.figures import RECIPES, corner, plot
from reports.figures.figure import Figure, draw
from reports.figures.labels import name_curves
from reports.figures.style import CYCLE, LOOKS, STYLES, LineStyle
from reports.figures.two_link_arm import arm_energies
from tests.reports.browser.conftest import made_motion
from tests.reports.figure_inputs import tables
from tests.reports.test_figure_labels import crossed

MOST_SERIES = 6
# modules that choose colours themselves -> why those are no series
OWN_COLOURS = {
    "style": "the table itself",
    "film": "marks of contacts", "stability": "marks of a verdict", "complementarity": "marks of a verdict",
    "engine_errors": "cells of a table", "cost": "cells of a table", "scenes_ledger": "layers of energy",
    "fig05_couplings": "wires of a diagram", "two_link_arm": "arrows of a drawing",
    "scenes_plane": "arrows of a drawing", "mechanics": "bounds without a mark",
}  # fmt: skip
COLOURS = {"BLUE", "VERMILION", "GREEN", "PURPLE", "AMBER", "SKY"}


class Drawn(NamedTuple):
    """One line as matplotlib was asked to draw it."""

    figure: str
    name: str
    color: str
    marker: str
    joined: bool


def _name(line: Any) -> str:
    return str(line.get_gid()).removeprefix("curve=") if str(line.get_gid()).startswith("curve=") else ""


def recorded(patch: pytest.MonkeyPatch, lines: list[Drawn], figure: list[str]) -> None:
    """Write down every line that is plotted."""
    plot = Axes.plot

    def noted(self: Axes, *args: Any, **how: Any) -> Any:
        made = plot(self, *args, **how)
        lines.extend(Drawn(figure[0], _name(line), str(line.get_color()), str(line.get_marker()),
                           line.get_linestyle() != "None") for line in made)  # fmt: skip
        return made

    patch.setattr(Axes, "plot", noted)


def strangers(lines: list[Drawn]) -> list[Drawn]:
    """Return the lines with a look that is not that of their name, or with a world's look and not its name."""
    worlds = {(look.color, look.marker): names for names, look in LOOKS[:7] if look.marker}
    wrong = []
    for line in lines:
        own = STYLES.get(line.name)
        other = own is not None and (line.color != own.color or line.marker not in (own.marker, "", "None"))
        known = worlds.get((line.color, line.marker))
        taken = known is not None and line.joined and line.name not in known
        taken = taken and (own is None or (own.color, own.marker) != (line.color, line.marker))
        if other or taken:
            wrong.append(line)
    return wrong


@pytest.fixture(scope="module")
def inputs(make_run: Callable[..., Run]) -> dict[str, Any]:
    names = sorted({name for recipe in RECIPES for name in recipe.needs if name.startswith(("corner/", "device/"))})
    runs = {name: made_motion(make_run, "peg_corner", k) for k, name in enumerate(names)}
    return {**runs, **tables(), "arm_energies": arm_energies(), "machine": "a processor, report of today"}


@pytest.fixture(scope="module")
def struck() -> list[tuple[str, str, str]]:
    """Figure, name at a curve and the line that runs through it; `seen` fills it."""
    return []


@pytest.fixture(scope="module")
def seen(inputs: dict[str, Any], struck: list[tuple[str, str, str]]) -> Iterator[tuple[list[Drawn], list[Figure]]]:
    """Every line of every figure, and the figures."""
    lines: list[Drawn] = []
    key = [""]
    figures = []
    with pytest.MonkeyPatch.context() as patch:
        recorded(patch, lines, key)

        def named(axes: Axes, *words: Any) -> None:
            name_curves(axes, *words)
            struck.extend((key[0], *each) for each in crossed(axes))

        patch.setattr(plot, "name_curves", named)
        for recipe in RECIPES:
            key[0] = recipe.key
            figure = draw(recipe, inputs)
            if isinstance(figure, Figure):
                figures.append(figure)
    yield lines, figures


def test_all_figures_but_drawings_and_bars_are_drawn(seen: tuple[list[Drawn], list[Figure]]) -> None:
    drawn = {figure.key for figure in seen[1]}
    drawings = {"fig01", "fig02", "fig04", "fig05", "scenes", "scenes-space"}
    absent = {recipe.key for recipe in RECIPES if not recipe.key.startswith("film-")} - drawn
    assert absent <= drawings


def test_no_line_runs_through_a_name(
    seen: tuple[list[Drawn], list[Figure]], struck: list[tuple[str, str, str]]
) -> None:
    assert len(seen[1]) > 20
    assert struck == []


def test_the_way_of_time_is_drawn_on_paths_of_the_hand(seen: tuple[list[Drawn], list[Figure]]) -> None:
    panels = [(figure.key, panel) for figure in seen[1] for panel in figure.panels]
    paths = {key: panel.svg for key, panel in panels if "path of the hand" in panel.label}
    assert set(paths) == {"hero", "fig07", "fig09", "fig10", "fig12"}
    assert all(">time</text>" in svg for svg in paths.values())


def test_no_two_rows_of_the_table_look_alike() -> None:
    looks = [(look.color, look.marker, look.filled) for _, look in LOOKS]
    assert len(set(looks)) == len(looks)
    names = [name for row, _ in LOOKS for name in row]
    assert len(set(names)) == len(names)
    assert not {(look.color, look.marker) for look in CYCLE} & {(look.color, look.marker) for _, look in LOOKS[:7]}


def test_a_name_has_one_colour_and_one_marker_in_every_figure(seen: tuple[list[Drawn], list[Figure]]) -> None:
    lines, figures = seen
    assert strangers(lines) == []
    assert {line.name for line in lines} >= {"ideal", "IAPB", "PB", "CBuc", "psaturated", "Lemke", "daqp",
                                             "printed, numpy"}
    for figure in figures:
        for text, look in figure.legend:
            assert look.color == STYLES.get(text, look).color and look.marker == STYLES.get(text, look).marker, text


def test_a_figure_in_another_worlds_look_is_noticed(inputs: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """As Figure 9 was: its saturated curve in the look of PB."""
    lines: list[Drawn] = []
    recorded(monkeypatch, lines, ["fig09"])
    monkeypatch.setattr(corner, "STYLES", STYLES | {"psaturated": STYLES["PB"]})
    draw(next(recipe for recipe in RECIPES if recipe.key == "fig09"), inputs)
    assert not strangers(lines)  # the curve and its name are PB's: the legend shows it, below
    lines.clear()
    planted = LineStyle(STYLES["PB"].color, STYLES["PB"].marker, name="psaturated")
    monkeypatch.setattr(corner, "STYLES", STYLES | {"psaturated": planted})
    draw(next(recipe for recipe in RECIPES if recipe.key == "fig09"), inputs)
    assert {line.name for line in strangers(lines)} == {"psaturated"}
    nobody = LineStyle(STYLES["PB"].color, STYLES["PB"].marker)
    lines.clear()
    monkeypatch.setattr(corner, "STYLES", STYLES | {"psaturated": nobody})
    draw(next(recipe for recipe in RECIPES if recipe.key == "fig09"), inputs)
    assert strangers(lines)


def test_a_plot_has_at_most_six_series_each_named_at_its_curve(seen: tuple[list[Drawn], list[Figure]]) -> None:
    checked = 0
    for figure in seen[1]:
        for panel in figure.panels:
            names = list(dict.fromkeys(re.findall(r'data-curve="([^"]+)"', panel.svg)))
            assert len(names) <= MOST_SERIES, (figure.key, panel.label, names)
            written = re.findall(r">([^<>]+)</text>", panel.svg)
            for name in names if len(names) > 1 else ():
                assert any(text.startswith(name) for text in written), (figure.key, panel.label, name)
                checked += 1
    assert checked > 100


@pytest.mark.parametrize("path", sorted(Path(reports.figures.__file__).parent.glob("*.py")), ids=lambda path: path.stem)
def test_a_module_takes_its_series_from_the_table(path: Path) -> None:
    """Only `OWN_COLOURS` name a colour or make a look: marks of verdicts, cells and drawings."""
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    made = [node.lineno for node in nodes
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "LineStyle"]  # fmt: skip
    named = {alias.name for node in nodes if isinstance(node, ast.ImportFrom) for alias in node.names} & COLOURS
    assert bool(made or named) == (path.stem in OWN_COLOURS), (made, named)

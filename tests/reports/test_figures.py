"""Figures, each drawn once from made-up inputs: bytes, colours, names at curves, and the numbers of Figure 3.

One colour and one marker per world and per method in every figure; at most six series in a plot, each named at its
curve. The tests read what was drawn: every call of matplotlib, every panel, every legend.
"""

from __future__ import annotations

import ast
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

import reports.figures
from iapb.run import Run
from reports.figures import RECIPES, corner, energy_gains, plot
from reports.figures.condition_map import condition_map
from reports.figures.corner import penetration_over_time
from reports.figures.figure import Figure, NotComputed, Recipe, draw
from reports.figures.labels import name_curves
from reports.figures.numbers import format_cell, format_number
from reports.figures.standalone import standalone
from reports.figures.style import CYCLE, LOOKS, STYLES, VARIABLES, LineStyle
from reports.figures.svg import to_svg
from reports.figures.two_link_arm import arm_energies
from tests.reports.figure_inputs import all_inputs
from tests.reports.test_figure_labels import crossed
from verification.table import titled

GAINS = titled(
    (energy_gains.METHOD, energy_gains.CONDITION, energy_gains.GAIN, energy_gains.SHARE),
    (("factored", "1e2", 0.0, 0.0), ("factored", "1e4", 1e-16, 0.1), ("printed", "1e2", 1e-3, 1e11),
     ("printed", "all", 1e-3, 1e11)),
)


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


class Gallery(NamedTuple):
    """All figures, every line that was drawn for them, and (figure, name at a curve, line that runs through it)."""

    inputs: dict[str, Any]
    figures: dict[str, Figure | NotComputed]
    lines: list[Drawn]
    struck: list[tuple[str, str, str]]

    @property
    def drawn(self) -> list[Figure]:
        """The figures that had their inputs."""
        return [figure for figure in self.figures.values() if isinstance(figure, Figure)]


@pytest.fixture(scope="module")
def gallery(make_run: Callable[..., Run]) -> Gallery:
    """Every figure, drawn once."""
    made, key = Gallery(all_inputs(make_run), {}, [], []), [""]
    with pytest.MonkeyPatch.context() as patch:
        recorded(patch, made.lines, key)

        def named(axes: Axes, *words: Any) -> None:
            name_curves(axes, *words)
            made.struck.extend((key[0], *each) for each in crossed(axes))

        patch.setattr(plot, "name_curves", named)
        for recipe in RECIPES:
            key[0] = recipe.key
            made.figures[recipe.key] = draw(recipe, made.inputs)
    return made


@pytest.fixture(params=RECIPES, ids=lambda recipe: recipe.key)
def recipe(request: pytest.FixtureRequest) -> Recipe:
    return request.param


@pytest.fixture
def figure(recipe: Recipe, gallery: Gallery) -> Figure:
    """The recipe's figure."""
    drawn = gallery.figures[recipe.key]
    if isinstance(drawn, NotComputed):
        pytest.skip(f"no made-up {drawn.missing}")
    return drawn


def test_all_figures_but_drawings_and_bars_are_drawn(gallery: Gallery) -> None:
    drawn = {figure.key for figure in gallery.drawn}
    drawings = {"fig01", "fig02", "fig04", "fig05", "scenes", "scenes-space"}
    absent = {recipe.key for recipe in RECIPES if not recipe.key.startswith("film-")} - drawn
    assert absent <= drawings


def test_no_line_runs_through_a_name(gallery: Gallery) -> None:
    assert len(gallery.drawn) > 20
    assert gallery.struck == []


def test_the_way_of_time_is_drawn_on_paths_of_the_hand(gallery: Gallery) -> None:
    panels = [(figure.key, panel) for figure in gallery.drawn for panel in figure.panels]
    paths = {key: panel.svg for key, panel in panels if "path of the hand" in panel.label}
    assert set(paths) == {"hero", "fig07", "fig09", "fig10", "fig12"}
    assert all(">time</text>" in svg for svg in paths.values())


def test_no_two_rows_of_the_table_look_alike() -> None:
    looks = [(look.color, look.marker, look.filled) for _, look in LOOKS]
    assert len(set(looks)) == len(looks)
    names = [name for row, _ in LOOKS for name in row]
    assert len(set(names)) == len(names)
    assert not {(look.color, look.marker) for look in CYCLE} & {(look.color, look.marker) for _, look in LOOKS[:7]}


def test_a_name_has_one_colour_and_one_marker_in_every_figure(gallery: Gallery) -> None:
    assert strangers(gallery.lines) == []
    assert {line.name for line in gallery.lines} >= {"ideal", "IAPB", "PB", "CBuc", "psaturated", "Lemke", "daqp",
                                             "printed, numpy"}
    for figure in gallery.drawn:
        for text, look in figure.legend:
            assert look.color == STYLES.get(text, look).color and look.marker == STYLES.get(text, look).marker, text


@pytest.mark.parametrize("name", ["IAPB LM", ""])
def test_a_figure_in_another_worlds_look_is_noticed(
    name: str, gallery: Gallery, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As Figure 9 was: its saturated curve in the look of PB."""
    lines: list[Drawn] = []
    recorded(monkeypatch, lines, ["fig12"])
    planted = LineStyle(STYLES["PB"].color, STYLES["PB"].marker, name=name)
    monkeypatch.setattr(corner, "STYLES", STYLES | {"IAPB LM": planted})
    draw(next(recipe for recipe in RECIPES if recipe.key == "fig12"), gallery.inputs)
    assert {line.name for line in strangers(lines)} == {name}


def test_a_plot_has_at_most_six_series_each_named_at_its_curve(gallery: Gallery) -> None:
    checked = 0
    for figure in gallery.drawn:
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


def test_figure_3_has_the_energies_that_follow_from_the_geometry() -> None:
    table = arm_energies()
    assert table["uniform rods, KE0"][0] == pytest.approx(7 / 3, abs=1e-15)
    assert table["point masses, KE0"][0] == pytest.approx(5, abs=1e-15)
    assert table["uniform rods, B"][0] == pytest.approx(0, abs=1e-12)
    assert table["uniform rods, A"][0] == pytest.approx(0.379845, abs=1e-6)
    assert table["point masses, A"][0] == pytest.approx(0.0345, abs=5e-5)
    assert table["point masses, B"][0] == pytest.approx(1.0, abs=1e-12)


def test_figure_3_loses_in_proportion_to_one_minus_e_squared() -> None:
    table = arm_energies()
    share = 1 - table["restitution"] ** 2
    for reading in ("uniform rods", "point masses"):
        for contact in "AB":
            lost = table[f"{reading}, KE0"] - table[f"{reading}, {contact}"]
            np.testing.assert_allclose(lost, share * lost[0], atol=1e-13)


@pytest.mark.parametrize("key", ["hero", "fig05", "every-scene", "film-hole", "effect-costs"])
def test_a_drawing_repeats_byte_for_byte(key: str, gallery: Gallery) -> None:
    again = draw(next(recipe for recipe in RECIPES if recipe.key == key), gallery.inputs)
    assert isinstance(again, Figure) and again.panels == gallery.figures[key].panels  # type: ignore[union-attr]


def test_a_drawing_is_a_whole_svg_that_asks_for_nothing(figure: Figure) -> None:
    for panel in figure.panels:
        ElementTree.fromstring(panel.svg)
        links = re.findall(r'(?:href|src)="([^"]*)"', panel.svg) + re.findall(r"url\(([^)]*)\)", panel.svg)
        assert all(link.startswith("#") for link in links)
        identifiers = set(re.findall(r'\sid="([^"]*)"', panel.svg))
        assert {link[1:] for link in links} <= identifiers
        assert "<style" not in panel.svg  # would apply to the whole page
        assert panel.alt


def test_every_colour_of_a_drawing_follows_the_page(figure: Figure) -> None:
    known = {f"var(--{name}, {value})" for value, name in VARIABLES.items()}
    for panel in figure.panels:
        used = set(re.findall(r"(?:fill|stroke): ([^;\"]+)", panel.svg))
        assert {color for color in used if not color.startswith("url(#")} <= known | {"none"}  # url: a hatch, drawn so


def test_a_table_is_html_in_the_page_and_in_its_own_file(gallery: Gallery) -> None:
    tables = {figure.key: [panel for panel in figure.panels if panel.is_table] for figure in gallery.drawn}
    assert {key: len(found) for key, found in tables.items() if found} == {
        "which-method": 1, "trajectory-precision": 1, "integrator-precision": 1, "engine-errors": 3}  # fmt: skip
    energy = ElementTree.fromstring(tables["engine-errors"][0].svg)
    assert {len(row) for row in energy.iter("tr")} == {7} and len(list(energy.iter("tr"))) == 9
    marks = {"".join(cell.itertext()): cell.get("style") for cell in energy.iter("td")}
    assert marks["−14"] == "background: color-mix(in srgb, var(--blue, #0072b2) 75%, transparent)"
    assert marks["✕"] == "color: var(--vermilion, #d55e00)"
    whole = standalone(next(figure for figure in gallery.drawn if figure.key == "engine-errors"))
    assert whole.startswith("<!DOCTYPE html>") and all(panel.svg in whole for panel in tables["engine-errors"])


def test_rows_of_a_table_have_as_many_cells_as_there_are_columns(figure: Figure) -> None:
    numbers = figure.numbers
    assert numbers is None or all(len(row) == len(numbers.columns) for row in numbers.rows)


def test_a_figure_without_its_inputs_is_not_drawn(recipe: Recipe) -> None:
    absent = draw(recipe, {})
    assert isinstance(absent, NotComputed)
    assert absent.missing == recipe.needs


def test_keys_of_figures_are_unique() -> None:
    keys = [recipe.key for recipe in RECIPES]
    assert len(keys) == len(set(keys))


def test_curves_of_one_figure_differ_without_their_colour(figure: Figure) -> None:
    looks = [(look.marker, look.dash, look.filled, look.width > 0) for _, look in figure.legend if look.name]
    assert len(set(looks)) == len(looks)


def test_numbered_series_differ_without_their_colour() -> None:
    assert len({(style.marker, style.dash) for style in CYCLE}) == len(CYCLE)


def test_rounding_coordinates_leaves_the_numbers_on_the_axes_alone() -> None:
    figure = condition_map("m", "t", "c", ("x", [0.0, 0.001]), ("y", [0.0, 1.0]), [True, True])
    labels = re.findall(r">([\d.]+)</text>", figure.panels[0].svg)
    assert "0.0002" in labels
    assert not re.search(r'="[^"]*\d\.\d{3}', figure.panels[0].svg)


def test_markers_of_one_style_say_it_once_and_every_one_of_another_keeps_its_own() -> None:
    drawing = Drawing()
    axes = drawing.subplots()
    axes.scatter(range(20), range(20), color=["#112233"] * 10 + ["#445566"] * 10)
    root = ElementTree.fromstring(to_svg(drawing, "key"))
    markers = {colour: [use for group in root.iter() if colour in group.get("style", "") for use in
                        group.iter("{http://www.w3.org/2000/svg}use")] for colour in ("#112233", "#445566")}
    assert [len(found) for found in markers.values()] == [10, 10]
    assert not any(use.get("style") for found in markers.values() for use in found)


def test_a_map_counts_what_holds() -> None:
    figure = condition_map("m", "t", "c", ("x", [0, 1, 1]), ("y", [0, 0, 0]), [True, False, True])
    assert "2 of 3" in figure.panels[0].alt


@pytest.mark.parametrize(("value", "text"), [
    (0.0, "0"), (-1.5, "−1.500"), (123456.0, "1.235 × 10⁵"), (1e-9, "1 × 10⁻⁹"), (99999.9, "100000"),
    (float("inf"), "∞"), (float("nan"), "not a number"),
])
def test_numbers_for_people(value: float, text: str) -> None:
    assert format_number(value) == text


@pytest.mark.parametrize(("value", "text"), [
    (None, "–"), (True, "yes"), (12345, "12\u202f345"), (np.int64(3), "3"), (np.float64(0.25), "0.2500"), ("x", "x"),
])
def test_cells(value: object, text: str) -> None:
    assert format_cell(value) == text


def test_penetration_is_that_of_the_deepest_contact(gallery: Gallery) -> None:
    run = gallery.inputs["corner/IAPB"]
    assert isinstance(run, Run)
    depth = penetration_over_time(run)
    rows = run.contacts
    for k in range(run.steps):
        gaps = rows.gap[rows.offsets[k] : rows.offsets[k + 1]]
        assert depth[k] == max(-gaps.min(), 0) if len(gaps) else depth[k] == 0


def test_the_row_that_sums_up_all_conditions_is_no_point_of_the_curve() -> None:
    assert energy_gains.series(GAINS, "printed", energy_gains.GAIN) == ([1e2], [1e-3])

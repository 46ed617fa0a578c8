"""Figures: the numbers of Figure 3, drawings that repeat byte for byte and can stand inside a page."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from iapb import load_scene
from iapb.run import Run
from iapb.scene import find_scene
from reports.figures import RECIPES, energy_gains
from reports.figures.condition_map import condition_map
from reports.figures.figure import Figure, NotComputed, Recipe, draw
from reports.figures.numbers import format_cell, format_number
from reports.figures.style import CYCLE, VARIABLES
from reports.figures.two_link_arm import arm_energies
from tests.reports.figure_inputs import tables
from verification.finding import titled

GAINS = titled(
    (energy_gains.METHOD, energy_gains.CONDITION, energy_gains.GAIN, energy_gains.SHARE),
    (("factored", "1e2", 0.0, 0.0), ("factored", "1e4", 1e-16, 0.1), ("printed", "1e2", 1e-3, 1e11),
     ("printed", "all", 1e-3, 1e11)),
)


@pytest.fixture(scope="module")
def inputs() -> dict[str, object]:
    """What the recipes ask for, but for some films: two short runs stand for all the runs, the tables are real."""
    from iapb.contact.laws import ImpulseAugmented
    from iapb.haptics.coupling import FourChannel
    from iapb.simulation import simulate

    scene = load_scene(find_scene("peg_corner"))
    gains = scene.couplings.four_channel
    coupling = FourChannel(tuple(gains.stiffness), tuple(gains.damping))
    run = simulate(scene, ImpulseAugmented(), coupling, world="IAPB", steps=400)
    group = simulate(load_scene(find_scene("arm_pushing")), ImpulseAugmented(), world="IAPB", steps=600)
    names = {name for recipe in RECIPES for name in recipe.needs}
    given: dict[str, object] = {name: run for name in names if name.startswith(("corner/", "device/"))}
    given |= {name: load_scene(find_scene(name[6:])).resolved() for name in names if name.startswith("scene/")}
    return given | tables() | {"arm_energies": arm_energies(), "group/IAPB": group, "machine": "a processor"}


@pytest.fixture(params=RECIPES, ids=lambda recipe: recipe.key)
def recipe(request: pytest.FixtureRequest) -> Recipe:
    return request.param


@pytest.fixture(scope="module")
def figures(inputs: dict[str, object]) -> dict[str, Figure | NotComputed]:
    return {recipe.key: draw(recipe, inputs) for recipe in RECIPES}


@pytest.fixture
def figure(recipe: Recipe, figures: dict[str, Figure | NotComputed]) -> Figure:
    """The recipe's figure, drawn once."""
    drawn = figures[recipe.key]
    if isinstance(drawn, NotComputed):
        pytest.skip(f"the fixture has no {drawn.missing}")
    return drawn


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


def test_a_drawing_repeats_byte_for_byte(recipe: Recipe, figure: Figure, inputs: dict[str, object]) -> None:
    again = draw(recipe, inputs)
    assert isinstance(again, Figure)
    assert [panel.svg for panel in figure.panels] == [panel.svg for panel in again.panels]


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
    from matplotlib.figure import Figure as Drawing

    from reports.figures.svg import to_svg

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


def test_penetration_is_that_of_the_deepest_contact(inputs: dict[str, object]) -> None:
    from reports.figures.corner import penetration_over_time

    run = inputs["corner/IAPB"]
    assert isinstance(run, Run)
    depth = penetration_over_time(run)
    rows = run.contacts
    for k in range(run.steps):
        gaps = rows.gap[rows.offsets[k] : rows.offsets[k + 1]]
        assert depth[k] == max(-gaps.min(), 0) if len(gaps) else depth[k] == 0


def test_the_row_that_sums_up_all_conditions_is_no_point_of_the_curve() -> None:
    assert energy_gains.series(GAINS, "printed", energy_gains.GAIN) == ([1e2], [1e-3])

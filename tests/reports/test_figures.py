"""Figures, each drawn once: bytes, colours, looks of worlds, numbers of Figure 3."""

import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import numpy as np
import pytest

from iapb.scene import find_scene, load_scene
from reports.figures import RECIPES
from reports.figures.condition_map import condition_map
from reports.figures.corner import _same_9
from reports.figures.figure import diagram, draw
from reports.figures.numbers import format_number
from reports.figures.paper import CONTACTS, arm_energies
from reports.figures.plot import Plot
from reports.figures.style import OUTCOMES, STYLES, VARIABLES
from tests.reports.made_up import figure_inputs
from verification.check import Study
from verification.complementarity.landings import LANDINGS
from verification.table import titled


@pytest.fixture(scope="module")
def gallery():
    """All figures by key."""
    return {recipe.key: draw(recipe, figure_inputs()) for recipe in RECIPES}


def test_a_figure_without_its_inputs_names_them():
    assert all(draw(recipe, {}).missing == recipe.needs for recipe in RECIPES if recipe.needs)


def test_a_world_keeps_its_colour_and_marker_in_every_figure(gallery):
    looks = {(look.color, look.marker, look.filled) for look in STYLES.values()}
    assert len(looks) == len(STYLES) - 4  # two names of one curve
    seen = set()
    for figure in gallery.values():
        for name, look in figure.legend:
            if name in STYLES:
                assert look == STYLES[name]
                assert all(look.color in panel.svg for panel in figure.panels), (figure.key, name)
                seen.add(name)
    assert seen >= {"ideal", "IAPB", "PB", "CBuc", "psaturated"}


@pytest.mark.parametrize("key", [recipe.key for recipe in RECIPES])
def test_a_drawing_is_whole_asks_for_nothing_and_takes_the_colours_of_the_page(key, gallery):
    figure = gallery[key]
    known = {f"var(--{name}, {value})" for value, name in VARIABLES.items()} | {"none"}
    assert figure.panels
    for panel in figure.panels:
        ElementTree.fromstring(panel.svg)
        links = set(re.findall(r'(?:href|src)="([^"]*)"|url\(([^)]*)\)', panel.svg))
        ids = {f"#{name}" for name in re.findall(r'\sid="([^"]*)"', panel.svg)}
        assert {one or other for one, other in links} <= ids
        used = set(re.findall(r"(?:fill|stroke): ([^;\"]+)", panel.svg))
        assert used <= known
        assert "<style" not in panel.svg and panel.alt and not re.search(r"\bnan\b", panel.svg)
    said = "".join((figure.caption, *figure.said))
    assert len(said) > 80 and "{" not in said


def test_what_the_paper_says_of_figure_9_can_be_wrong():
    lost = {name: {"distance": k} for k, name in enumerate(("pspread", "pscaled", "psaturated"))}
    assert all(_same_9(lost).values())
    lost["pscaled"] = {"distance": 4.0}
    assert list(_same_9(lost).values()) == [False, True]


def test_the_landings_are_drawn_with_their_impulses(gallery):
    rows = LANDINGS.table(Study()).records()
    for row, panel in zip(rows[:2], gallery["condition"].panels[:2], strict=True):
        for side in ("left", "right"):
            impulse = row[f"impulse at the {side}"]
            words = f"{'pushes' if impulse > 0 else 'pulls'} {format_number(abs(impulse), 2)}"
            assert f">{words}<" in panel.svg


def test_figure_3_has_the_energies_that_follow_from_the_geometry():
    table = arm_energies()
    share = 1 - np.linspace(0.0, 1.0, 41) ** 2
    for reading, before, at_a, at_b in (
        ("uniform rods", 7 / 3, 0.379845, 0.0),
        ("point masses", 5.0, 0.0345, 1.0),
    ):
        assert table[f"{reading}, KE0"] == pytest.approx(before, abs=1e-15)
        assert table[f"{reading}, A"][0] == pytest.approx(at_a, abs=5e-5)
        assert table[f"{reading}, B"][0] == pytest.approx(at_b, abs=1e-12)
        for contact in "AB":  # the loss is proportional to 1 - e²
            lost = before - table[f"{reading}, {contact}"]
            np.testing.assert_allclose(lost, share * lost[0], atol=1e-13)


def test_a_map_counts_what_holds_and_keeps_the_numbers_of_its_axes(monkeypatch):
    marks = []
    monkeypatch.setattr(Plot, "marks", lambda plot, found, look, **how: marks.append((look, found)))
    rows = [(0, 0, "a"), (1e-3, 0, "a"), (1e-3, 0, "a")]
    table = replace(titled(("x", "y", "part"), rows), holds=(True, False, True))
    panel = condition_map("m", "t", "c", table, "x", "y", "part").panels[0]
    assert "2 of 3" in panel.alt and "0.001" in re.findall(r">([\d.]+)</text>", panel.svg)
    crossed = [found for look, found in marks if look == OUTCOMES["fails"]]
    assert crossed == [[[1.0, 0.0]]] and len(marks) == 3  # a full dot, a smaller one


def test_the_frozen_drawing_of_the_peg_is_its_scene():
    drawing = diagram("peg", "").svg
    right, floor = (
        float(re.search(pattern, drawing).group(1))  # type: ignore[union-attr]
        for pattern in (r'"M(\S+) 7036', r'"M\S+ (155\.\d+)L')
    )
    outline = re.search(r'"M([^"]*)z"[^>]*--peg', drawing).group(1)  # type: ignore[union-attr]
    corners = np.array([point.split() for point in outline.split("L")], float)
    scene = load_scene(find_scene("peg_corner"))
    width, height = scene.bodies[0].shapes[0].size
    sides = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    scale = sides[0] / width
    along = corners[1] - corners[0]
    x, y = corners.mean(axis=0)
    seen = ((right - x) / scale, (y - floor) / scale, -np.arctan2(along[1], along[0]))
    assert sides[1] / scale == pytest.approx(height, rel=1e-3)
    assert seen == pytest.approx(scene.bodies[0].position, abs=2e-5)


def test_the_frozen_drawing_of_the_arm_is_struck_where_the_text_says():
    drawing = diagram("arm", "").svg
    joint, tip = (float(y) for y in re.search(r"M129.6 (113\S+)L129.6 (\S+)", drawing).groups())  # type: ignore[union-attr]
    arrows = [float(y) for y in re.findall(r'"M86\.95 (\S+)Q', drawing)]
    assert [(joint - y) / (joint - tip) for y in arrows] == pytest.approx(
        [*CONTACTS.values()], abs=1e-3
    )
    for name, distance in CONTACTS.items():
        assert f">{name}, {distance} m<" in drawing

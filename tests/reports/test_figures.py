"""Figures, each drawn once from made-up inputs: bytes, colours, names at curves, shapes, numbers of Figure 3."""

import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.axes import Axes
from matplotlib.cbook import STEP_LOOKUP_MAP
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from iapb.scene import find_scene, load_scene, scene_names
from iapb.system import System
from reports.figures import RECIPES, plot
from reports.figures.condition_map import condition_map
from reports.figures.figure import draw, standalone
from reports.figures.geometry import body_placements, is_spatial, solids
from reports.figures.labels import arrow_of_time, label_marks, name_curves
from reports.figures.numbers import format_number
from reports.figures.paper import arm_energies
from reports.figures.plot import Plot
from reports.figures.style import CYCLE, LOOKS, STYLES, VARIABLES
from tests.reports.made_up import all_inputs
from verification.scenes.measures import trace_of
from verification.table import titled

MOST_SERIES = 6
WORLDS = {(look.color, look.marker): names for names, look in LOOKS[:7] if look.marker}


def crossed(axes):
    """Return the names at curves that a line runs through, or another name covers."""
    axes.figure.draw_without_rendering()
    boxes = {text.get_text(): Text.get_window_extent(text) for text in axes.texts
             if text.get_text() and str(text.get_gid()).startswith("name=")}  # fmt: skip
    lines = [line for line in axes.lines if line.get_linestyle() != "None" and (line.get_alpha() or 1.0) > 0.3]
    values = [STEP_LOOKUP_MAP[line.get_drawstyle()](*np.asarray(line.get_xydata(), dtype=float).T) for line in lines]
    paths = [line.get_transform().transform_path(Path(np.column_stack(value)))
             for line, value in zip(lines, values, strict=True)]  # fmt: skip
    cores = {name: Bbox.from_extents(box.x0 + 1, box.y0 + box.height / 4, box.x1 - 1, box.y1 - box.height / 4)
             for name, box in boxes.items()}  # fmt: skip
    return [name for name, core in cores.items()
            if any(path.intersects_bbox(core, False) for path in paths)
            or any(core.overlaps(other) for own, other in cores.items() if own != name)]  # fmt: skip


@pytest.fixture(scope="module")
def gallery():
    """All figures by key; the lines drawn for them, and (figure, name at a curve) where a line crosses the name."""
    made, key, plotted = SimpleNamespace(inputs=all_inputs(), figures={}, lines=[], struck=[]), "", Axes.plot

    def noted(axes, *args, **how):
        lines = plotted(axes, *args, **how)
        made.lines.extend(lines)
        return lines

    def named(axes, *words):
        name_curves(axes, *words)
        made.struck.extend((key, each) for each in crossed(axes))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Axes, "plot", noted)
        patch.setattr(plot, "name_curves", named)
        for recipe in RECIPES:
            key = recipe.key
            made.figures[key] = draw(recipe, made.inputs)
    made.drawn = [figure for figure in made.figures.values() if figure.panels]
    return made


@pytest.fixture(params=[recipe.key for recipe in RECIPES if recipe.key not in ("film-two-link-arm", "film-cradle")])
def figure(request, gallery):
    return gallery.figures[request.param]


def test_every_figure_is_drawn_that_has_its_inputs_and_no_line_and_no_other_name_covers_a_name(gallery):
    absent = {key for key, figure in gallery.figures.items() if not figure.panels}
    assert absent == {"film-two-link-arm", "film-cradle"}
    assert all(draw(recipe, {}).missing == recipe.needs for recipe in RECIPES)
    assert len({recipe.key for recipe in RECIPES}) == len(RECIPES) and gallery.struck == []


@settings(max_examples=15, deadline=None)
@given(st.lists(st.tuples(st.floats(0.1, 0.9), st.floats(-0.7, 0.7)), min_size=2, max_size=4, unique=True))
def test_names_of_curves_and_marks_cover_nothing(lines):
    x = np.linspace(0.0, 1.0, 50)
    with Plot("any") as plot:
        plot.axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
        for number, (height, slope) in enumerate(lines):
            plot.axes.plot(x, height + slope * (x - 0.5), gid=f"curve={number} name")
        label_marks(plot.axes, ["a long name"], [(0.5, 0.5)], ["black"])
        name_curves(plot.axes)
        assert crossed(plot.axes) == []
        for text in plot.axes.texts:
            box, frame = Text.get_window_extent(text), plot.axes.get_window_extent()
            assert frame.x0 <= box.x0 and box.x1 <= frame.x1 and frame.y0 <= box.y0 and box.y1 <= frame.y1


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_the_arrow_of_time_points_along_the_path(way):
    with Plot("any") as plot:
        plot.axes.plot(way * np.linspace(0.0, 1.0, 50), way * np.linspace(0.0, 2.0, 50))
        arrow_of_time(plot.axes)
        tip, tail = (np.asarray(end) for end in (plot.axes.texts[0].xy, plot.axes.texts[0].xyann))
    assert (way * (tip - tail) > 0.0).all()


def test_a_name_has_one_colour_and_one_marker_in_every_figure(gallery):
    """A world keeps its look in all figures, and nothing else that is joined by a line has it."""
    seen, looks = set(), [(look.color, look.marker, look.filled) for _, look in LOOKS]
    assert len(set(looks)) == len(looks) and not {(look.color, look.marker) for look in CYCLE} & set(WORLDS)
    for line in gallery.lines:
        name, look = str(line.get_gid()).removeprefix("curve="), (line.get_color(), line.get_marker())
        if name in STYLES:
            seen.add(name)
            assert look[0] == STYLES[name].color and look[1] in (STYLES[name].marker, "", "None"), name
        elif look in WORLDS and line.get_linestyle() != "None":
            raise AssertionError((name, look))
    assert seen >= {"ideal", "IAPB", "PB", "CBuc", "psaturated", "Lemke", "printed, numpy"}
    for figure in gallery.drawn:
        for text, look in figure.legend:
            assert (look.color, look.marker) == (STYLES.get(text, look).color, STYLES.get(text, look).marker), text


def test_a_plot_has_at_most_six_series_each_named_at_its_curve_in_a_style_of_its_own(figure):
    styles = [(look.marker, look.dash, look.filled, look.width > 0) for _, look in figure.legend if look.name]
    assert len(set(styles)) == len(styles)  # even without their colour
    for panel in figure.panels:
        names = set(re.findall(r'data-curve="([^"]+)"', panel.svg))
        assert len(names) <= MOST_SERIES
        written = re.findall(r">([^<>]+)</text>", panel.svg)
        for name in names if len(names) > 1 else ():
            assert any(text.startswith(name) for text in written), (panel.label, name)


@pytest.mark.parametrize("key", ["hero", "fig05", "every-scene", "film-hole", "effect-costs"])
def test_a_drawing_repeats_byte_for_byte(key, gallery):
    again = draw(next(recipe for recipe in RECIPES if recipe.key == key), gallery.inputs)
    assert again.panels and again.panels == gallery.figures[key].panels


def test_a_drawing_is_whole_asks_for_nothing_and_takes_the_colours_of_the_page(figure):
    known = {f"var(--{name}, {value})" for value, name in VARIABLES.items()}
    for panel in figure.panels:
        ElementTree.fromstring(panel.svg)
        links = re.findall(r'(?:href|src)="([^"]*)"', panel.svg) + re.findall(r"url\(([^)]*)\)", panel.svg)
        assert set(links) <= {f"#{name}" for name in re.findall(r'\sid="([^"]*)"', panel.svg)}
        used = set(re.findall(r"(?:fill|stroke): ([^;\"]+)", panel.svg))
        assert {color for color in used if not color.startswith("url(#")} <= known | {"none"}  # url: a hatch
        assert "<style" not in panel.svg and panel.alt and not re.search(r"\bnan\b", panel.svg)
    assert figure.numbers is None or all(len(row) == len(figure.numbers.columns) for row in figure.numbers.rows)
    said = figure.caption, *figure.said
    assert len("".join(said)) > 80 and "{" not in "".join(said) and len(figure.said) in (0, 4)


def test_a_table_is_html_in_the_page_and_in_its_own_file(gallery):
    tables = {figure.key: [panel for panel in figure.panels if panel.is_table] for figure in gallery.drawn}
    assert {key: len(found) for key, found in tables.items() if found} == {
        "which-method": 1, "where-iapb-loses": 1, "trajectory-precision": 1, "integrator-precision": 1}
    best = ElementTree.fromstring(tables["which-method"][0].svg)
    assert {len(row) for row in best.iter("tr")} == {6} and len(list(best.iter("tr"))) == 3
    marks = {next(cell.itertext()): cell.get("style") for cell in best.iter("td") if cell.text}
    assert marks["IAPB"] == "background: color-mix(in srgb, var(--blue, #0072b2) 16%, transparent)"
    whole = standalone(gallery.figures["which-method"])
    assert whole.startswith("<!DOCTYPE html>") and tables["which-method"][0].svg in whole


def test_figure_3_has_the_energies_that_follow_from_the_geometry():
    table, share = arm_energies(), 1 - np.linspace(0.0, 1.0, 41) ** 2
    for reading, before, at_a, at_b in (("uniform rods", 7 / 3, 0.379845, 0.0), ("point masses", 5.0, 0.0345, 1.0)):
        assert table[f"{reading}, KE0"] == pytest.approx(before, abs=1e-15)
        assert table[f"{reading}, A"][0] == pytest.approx(at_a, abs=5e-5)
        assert table[f"{reading}, B"][0] == pytest.approx(at_b, abs=1e-12)
        for contact in "AB":  # the loss is proportional to 1 - e²
            lost = before - table[f"{reading}, {contact}"]
            np.testing.assert_allclose(lost, share * lost[0], atol=1e-13)


def test_penetration_is_that_of_the_deepest_contact(gallery):
    run = gallery.inputs["corner/IAPB"]
    depth, rows = trace_of(run).penetration, run.contacts
    for k in range(run.steps):
        gaps = rows.gap[rows.offsets[k] : rows.offsets[k + 1]]
        assert depth[k] == max(-gaps.min(), 0) if len(gaps) else depth[k] == 0


def test_a_map_counts_what_holds_and_keeps_the_numbers_of_its_axes():
    table = replace(titled(("x", "y"), [(0, 0), (1e-3, 0), (1e-3, 0)]), holds=(True, False, True))
    panel = condition_map("m", "t", "c", table, "x", "y").panels[0]
    assert "2 of 3" in panel.alt and "0.001" in re.findall(r">([\d.]+)</text>", panel.svg)
    assert not re.search(r'="[^"]*\d\.\d{3}', panel.svg)  # coordinates are rounded


@pytest.mark.parametrize(("value", "text"), [
    (0.0, "0"), (-1.5, "−1.500"), (123456.0, "1.235 × 10⁵"), (1e-9, "1 × 10⁻⁹"), (99999.9, "100000"),
    (float("inf"), "∞"), (float("nan"), "not a number"),
])  # fmt: skip
def test_numbers_for_people(value, text):
    assert format_number(value) == text


@pytest.mark.parametrize("name", scene_names())
def test_bodies_are_closed_with_their_outside_out_and_where_the_engine_has_them(name):
    """Triangles for the browser."""
    scene = load_scene(find_scene(name))
    resolved, mechanism = scene.resolved(), System(scene).mechanism
    for piece in solids(resolved):
        edges = {(face[i], face[i - 2]) for face in piece.faces.tolist() for i in range(3)}
        volumes = np.linalg.det(piece.vertices[piece.faces] - piece.vertices.mean(axis=0))
        assert volumes.sum() > 0.0 and volumes.min() >= -1e-12 * volumes.sum()
        if len(piece.vertices) < 100:  # the poles of a ball are many corners in one place
            assert all((b, a) in edges for a, b in edges)
    q = mechanism.integrate(System(scene).make_state().q, np.random.default_rng(4).normal(size=mechanism.nv), 0.7)
    rotations, origins = mechanism.placements(q)
    for name, place in body_placements(resolved, mechanism.poses(q[None], planar=not is_spatial(resolved))[0]).items():
        body = mechanism.index(name)
        assert place.origin == pytest.approx(origins[body], abs=1e-12)
        assert place.rotation == pytest.approx(rotations[body], abs=1e-12)

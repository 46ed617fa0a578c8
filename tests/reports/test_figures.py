"""Figures, each drawn once from made-up inputs: bytes, colours, names at curves, shapes, numbers of
Figure 3."""

import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from math import sin
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.axes import Axes

from reports.evidence.runs import CORNER_SCENE, TILTED, corner_scene
from reports.figures import RECIPES
from reports.figures.condition_map import condition_map
from reports.figures.corner import UNLIMITED
from reports.figures.figure import draw
from reports.figures.paper import arm_energies
from reports.figures.plot import Plot
from reports.figures.style import OUTCOMES, STYLES, VARIABLES
from tests.reports.made_up import made_motion
from verification.check import Study
from verification.complementarity.agreement import TWO_CONTACTS
from verification.complementarity.landings import LANDINGS
from verification.cost.trajectories import BELOW, OK, TIMED_OUT, WORLDS
from verification.stability.port import COUPLINGS
from verification.table import titled

SCENES = tuple(f"scene {k}" for k in range(6))
CHECKS = {
    "complementarity": [TWO_CONTACTS, LANDINGS],
}
METHODS = tuple(WORLDS)


def tables():
    """Return a made-up table for each input of a figure that is a table and takes long to
    compute."""
    made = {
        "energy/impacts": (
            "method; family; impacts; gains; largest relative gain; "
            "median relative gain of those that gain",
            (
                ("IAPB", "any rank", 1000, 0, 0.0, 0.0),
                ("IAPB", "ordinary", 1000, 0, 0.0, 0.0),
                ("printed formula", "any rank", 100, 37, 24.0, 1e-9),
            ),
        ),
        "energy/scenes": (
            "scene; left open at the scene's step [%]",
            ((scene, 0.0 if k == 0 else 0.8 * k) for k, scene in enumerate(SCENES)),
        ),
        "hard-cases/the failure": (
            "case; world; time [s]; kinetic energy [mJ]",
            (
                ("stiff wall", world, 0.1 * n, 10.0 * k * abs(sin(0.5 * n)))
                for k, world in enumerate(("IAPB", "PB", "ideal"))
                for n in range(30)
            ),
        ),
        "hard-cases/touch": (
            "motion; motions; step [ms]; error, impacts at the touch; error, impacts at the step; "
            "error of MuJoCo",
            (
                (motion, 1, step, 0.0 if k else 1e-12, 0.1 * step, 0.3 * step)
                for k, motion in enumerate(("a toss", "a bounce"))
                for step in (4.0, 1.0, 0.25)
            ),
        ),
        "haptic-rate/motions": (
            "scene; method; step [ms]; time [ms/s]; position; energy; signed energy; energy made; outcome; note",
            (
                (
                    scene,
                    method,
                    h,
                    (k + 1) * 4.0 / h,
                    0.02 * (0.5 * k + m + 1) * h ** (0.5 + 0.2 * k) if k < 6 else 0.05,
                    1e-10,
                    -1e-10,
                    0.01 * (k == 3),
                    TIMED_OUT if h < 0.1 and k == 1 else OK,
                    f"position {BELOW}" if (h, k) == (0.5, 2) else "",
                )
                for m, scene in enumerate(SCENES)
                for k, method in enumerate(METHODS)
                for h in (8.0, 2.0, 0.5, 0.1, 0.02)
            ),
        ),
        "stability/edges": (
            "law; damping [N s/m]; friction [N]",
            (
                (law, 0.5 * n, max(0.0, 5.0 + k - 0.5 * n))
                for k, law in enumerate(name for name in COUPLINGS if "," not in name)
                for n in range(20)
            ),
        ),
    }
    return {name: titled(columns.split("; "), rows) for name, (columns, rows) in made.items()}


def all_inputs():
    """Return the inputs of all figures: made up or computed at once."""
    needed = sorted({name for recipe in RECIPES for name in recipe.needs})
    runs = {
        name: made_motion("peg_corner", k)
        for k, name in enumerate(needed)
        if name.split("/")[0] in ("corner", "device")
    }
    tilted = {
        tilt: {name: runs[f"corner/{name}"] for name in UNLIMITED}
        | {"IAPB-push": runs["corner/IAPB"]}
        for tilt in (0.015, 0.2)
    }
    study = Study()
    checks = {f"{topic}/{check.key}": check for topic, checks in CHECKS.items() for check in checks}
    computed = {name: checks[name].table(study) for name in needed if name in checks}
    return {
        **runs,
        CORNER_SCENE: corner_scene(),
        **tables(),
        **computed,
        TILTED: tilted,
        "arm_energies": arm_energies(),
    }


@pytest.fixture(scope="module")
def gallery():
    """All figures by key, and the lines drawn for them."""
    made = SimpleNamespace(inputs=all_inputs(), figures={}, lines=[])
    plotted = Axes.plot

    def noted(axes, *args, **how):
        lines = plotted(axes, *args, **how)
        made.lines.extend(lines)
        return lines

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Axes, "plot", noted)
        for recipe in RECIPES:
            made.figures[recipe.key] = draw(recipe, made.inputs)
    made.drawn = [figure for figure in made.figures.values() if figure.panels]
    return made


@pytest.fixture(params=[recipe.key for recipe in RECIPES])
def figure(request, gallery):
    return gallery.figures[request.param]


def test_every_figure_is_drawn_that_has_its_inputs(gallery):
    assert all(figure.panels for figure in gallery.figures.values())
    assert all(draw(recipe, {}).missing == recipe.needs for recipe in RECIPES)
    assert len({recipe.key for recipe in RECIPES}) == len(RECIPES)


def test_a_world_keeps_its_colour_and_marker_in_every_figure(gallery):
    looks = {(look.color, look.marker, look.filled) for look in STYLES.values()}
    assert len(looks) == len(STYLES) - 4  # two names of one curve
    seen = set()
    for line in gallery.lines:
        name = str(line.get_gid()).removeprefix("curve=")
        if name in STYLES:
            seen.add(name)
            assert line.get_color() == STYLES[name].color, name
            assert line.get_marker() in (STYLES[name].marker, "", "None"), name
    assert seen >= {"ideal", "IAPB", "PB", "CBuc", "psaturated"}


def test_a_drawing_is_whole_asks_for_nothing_and_takes_the_colours_of_the_page(figure):
    known = {f"var(--{name}, {value})" for value, name in VARIABLES.items()} | {"none"}
    for panel in figure.panels:
        ElementTree.fromstring(panel.svg)
        links = set(re.findall(r'(?:href|src)="([^"]*)"|url\(([^)]*)\)', panel.svg))
        ids = {f"#{name}" for name in re.findall(r'\sid="([^"]*)"', panel.svg)}
        assert {one or other for one, other in links} <= ids
        used = set(re.findall(r"(?:fill|stroke): ([^;\"]+)", panel.svg))
        assert {color for color in used if not color.startswith("url(#")} <= known  # url: a hatch
        assert "<style" not in panel.svg and panel.alt and not re.search(r"\bnan\b", panel.svg)
    said = "".join((figure.caption, *figure.said))
    assert len(said) > 80 and "{" not in said


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
    table = replace(titled(("x", "y"), [(0, 0), (1e-3, 0), (1e-3, 0)]), holds=(True, False, True))
    panel = condition_map("m", "t", "c", table, "x", "y").panels[0]
    assert "2 of 3" in panel.alt and "0.001" in re.findall(r">([\d.]+)</text>", panel.svg)
    crossed = [found for look, found in marks if look == OUTCOMES["fails"]]
    assert crossed == [[(1.0, 0.0)]] and len(marks) == 3  # a full dot, a smaller one

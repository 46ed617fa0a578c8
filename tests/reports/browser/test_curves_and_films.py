"""Curves and films in the browser: worlds can be hidden, the cursor reads values, films show the poses of the run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from reports.figures.corner import UNLIMITED
from reports.figures.film import SIZE, Film, bounds_of
from reports.figures.geometry import outline
from reports.pages.records import Evidence

pytestmark = pytest.mark.thorough

READ = """() => [...document.querySelector("#fig07 .readout:not([hidden])").children]
    .map((row) => [row.firstChild.textContent, row.querySelector("b").textContent])"""
PLACE = """() => {
    const body = document.querySelector('#film-corner svg > g > g');
    const t = body.ownerSVGElement.getCTM().inverse().multiply(body.getCTM());
    return [t.a, t.b, t.c, t.d, t.e, t.f];
}"""
MOVED = "(old) => String((" + PLACE + ")()) !== String(old)"
TO_THE_END = "(input) => { input.value = input.max; input.dispatchEvent(new Event('input')); }"


def test_a_world_can_be_hidden_and_shown(desk: Any) -> None:
    button = desk.page.locator("#fig07 .legend button", has_text="PB").filter(has_not_text="IAPB")
    curves = desk.page.locator("#fig07 [data-trace] [data-curve='PB']")
    assert curves.count() == 6 and curves.first.is_visible()
    button.click()
    assert button.get_attribute("aria-pressed") == "false"
    assert not any(curve.is_visible() for curve in curves.all())
    assert desk.page.locator("#fig07 [data-trace] [data-curve='IAPB']").first.is_visible()
    button.press("Enter")
    assert all(curve.is_visible() for curve in curves.all())


def test_the_cursor_reads_the_values_of_the_run(desk: Any, evidence: Evidence) -> None:
    """To within what the drawing keeps: 0.02 of its 180 points of height; the cursor stands between two steps."""
    plot = desk.page.locator("#fig07 svg[data-trace=time]").first
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    desk.page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.4 * box["height"])
    rows = {name: value.replace("\N{MINUS SIGN}", "-") for name, value in desk.ask(READ)}
    run = evidence.inputs["corner/ideal"]
    x = 1e3 * run.device_q[:, 0]
    near = x[np.abs(run.time - float(rows["t [s]"])) < 1.1 * run.dt]
    kept = np.ptp(x) * 0.02 / 180
    assert near.min() - kept <= float(rows["ideal"]) <= near.max() + kept
    assert np.ptp(near) < np.ptp(x) / 10  # or the bracket would say nothing
    assert desk.page.locator("#fig07 .readout:visible").count() == 5  # the panels over time read together


def test_the_slider_shows_one_tilt_at_a_time(see: Callable[..., Any], first: Path) -> None:
    shown = """() => [...document.querySelectorAll("#hero [data-state]:not([display=none])")]
        .map((each) => each.dataset.state)"""
    with see(first) as desk:
        assert desk.ask(shown) == ["1", "1"]  # the tilt of the scene, in both pictures
        desk.page.locator("#hero input[type=range]").evaluate(TO_THE_END)
        assert desk.ask(shown) == ["2", "2"] and desk.page.locator("#hero text", has_text="Tilt 17.19°").is_visible()


def test_a_film_plays_stops_and_shows_the_poses_of_the_run(
    see: Callable[..., Any], first: Path, evidence: Evidence
) -> None:
    """It begins shortly before the first contact; at the end, the corners of the peg are where the run has them."""
    runs = [evidence.inputs[name] for name in UNLIMITED.values()]
    touched = min(run.time[np.flatnonzero(np.diff(run.contacts.offsets))[0]] for run in runs)
    with see(first) as desk:
        player, start = desk.page.locator("#film-corner"), desk.ask(PLACE)
        button, slider = player.locator(".controls button"), player.locator("input[type=range]")
        assert 0.0 < touched - 0.031 <= float(slider.input_value()) <= touched - 0.03 + 5 * runs[0].dt
        button.click()
        desk.page.wait_for_function(MOVED, arg=start)
        button.click()
        stopped = desk.ask(PLACE)
        desk.page.wait_for_timeout(100)
        assert desk.ask(PLACE) == stopped
        slider.evaluate(TO_THE_END)
        a, b, c, d, e, f = desk.ask(PLACE)
        drawn = desk.page.locator("#film-corner svg > g > g > path").first.get_attribute("d")
    low, high = bounds_of(runs)
    made = Film(runs[0], low, SIZE[0] / float(high[0] - low[0]), 1.0, 1)
    x, y, angle = runs[0].pose[-1, 0]
    corners = outline(runs[0].scene_resolved["bodies"][0]["shapes"][0])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    expected = made.flat(corners @ turn.T + [x, y])
    local = np.array([list(map(float, pair.split())) for pair in drawn.strip("Mz").split("L")])
    np.testing.assert_allclose(local @ [[a, b], [c, d]] + [e, f], expected, atol=0.3)  # of 400 units of the picture

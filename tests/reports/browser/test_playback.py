"""Playback in the browser: it moves, it stops, and it shows the poses of the run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from reports.figures.corner import UNLIMITED
from reports.figures.film import LARGEST, film, frames
from reports.figures.films import SIGHT, bodies_markup
from reports.pages.records import Evidence

MOVED = "(old) => document.querySelector('#film-corner [data-layer=bodies] path').getAttribute('d') !== old"
DRAWN = """() => [...document.querySelectorAll("#film-obstacles [data-layer=bodies] path")]
    .map((path) => path.getAttribute("d"))"""
TO_THE_END = "(input) => { input.value = input.max; input.dispatchEvent(new Event('input')); }"


@pytest.fixture
def desk(see: Callable[..., Any], first: Path) -> Iterator[Any]:
    """The first page, where the corner is played back."""
    with see(first) as seen:
        yield seen


def test_playback_moves_and_stops(desk: Any) -> None:
    player = desk.page.locator("#film-corner")
    body = player.locator("[data-layer=bodies] path").first
    start = body.get_attribute("d")
    button = player.locator(".controls button")
    button.click()
    desk.page.wait_for_function(MOVED, arg=start)
    button.click()
    stopped = body.get_attribute("d")
    desk.page.wait_for_timeout(100)
    assert body.get_attribute("d") == stopped
    assert float(player.locator("input[type=range]").input_value()) > 0.0


def test_playback_shows_the_poses_of_the_run(desk: Any, evidence: Evidence) -> None:
    """The corners of the peg at the end of the run, against what the run itself says."""
    runs = [evidence.inputs[name] for name in UNLIMITED.values()]
    made = film(runs[0], None, runs)
    ring = made.parts.rings[0]
    (place,) = frames(runs[0].scene_resolved, made.parts.seen, runs[0].pose[-1])
    expected = made.flat(place.of(ring.corners))
    slider = desk.page.locator("#film-corner input[type=range]")
    slider.evaluate(TO_THE_END)
    drawn = desk.page.locator("#film-corner [data-layer=bodies] path").first.get_attribute("d")
    corners = np.array([list(map(float, pair.split())) for pair in drawn.strip("Mz").split("L")])
    np.testing.assert_allclose(corners, expected, atol=0.1)  # units of the picture, of which there are 400


def test_bodies_in_space_are_drawn_where_they_are(see: Callable[..., Any], evidence: Evidence) -> None:
    """The player and the still picture find the same faces, from quaternions and from matrices."""
    with see("scene-ledger") as sight:
        sight.page.locator("#film-obstacles input[type=range]").evaluate(TO_THE_END)
        drawn = sight.ask(DRAWN)
    run = evidence.inputs["space/arm_obstacles"]
    made = film(run, SIGHT["space/arm_obstacles"], [run])
    expected = [text for text in bodies_markup(made, run.steps) if "<path" in text]
    faces = [text for text in drawn if "a" not in text]
    assert len(faces) == len(expected)
    np.testing.assert_allclose(_numbers(faces), _numbers([text.split('"')[1] for text in expected]), atol=0.3)


def _numbers(paths: list[str]) -> np.ndarray:
    """All corners, sorted: two faces at one depth may be drawn in either order."""
    pairs = [list(map(float, pair.split())) for path in paths for pair in path.strip("Mz").split("L")]
    return np.array(sorted(pairs))


def test_no_film_is_large(evidence: Evidence) -> None:
    run = evidence.inputs["corner/ideal"]
    assert len(film(run, None, [run]).text) <= LARGEST


def test_a_film_begins_shortly_before_the_first_contact(desk: Any, evidence: Evidence) -> None:
    runs = [evidence.inputs[name] for name in UNLIMITED.values()]
    touched = min(run.time[np.flatnonzero(np.diff(run.contacts.offsets))[0]] for run in runs)
    begins = float(desk.page.locator("#film-corner input[type=range]").input_value())
    assert touched > 0.07
    assert touched - 0.031 <= begins <= touched - 0.03 + 5 * runs[0].dt

"""Films in the browser: they play, they stop, and they show the poses of the run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from reports.figures.corner import UNLIMITED
from reports.figures.film import SIZE, Film, _bounds
from reports.figures.geometry import outline
from reports.pages.records import Evidence

PLACE = """() => {
    const body = document.querySelector('#film-corner svg > g > g');
    const t = body.ownerSVGElement.getCTM().inverse().multiply(body.getCTM());
    return [t.a, t.b, t.c, t.d, t.e, t.f];
}"""
MOVED = "(old) => String((" + PLACE + ")()) !== String(old)"
TO_THE_END = "(input) => { input.value = input.max; input.dispatchEvent(new Event('input')); }"


@pytest.fixture
def desk(see: Callable[..., Any], first: Path) -> Iterator[Any]:
    """The first page, where the corner is played back."""
    with see(first) as seen:
        yield seen


def test_playback_moves_and_stops(desk: Any) -> None:
    player, start = desk.page.locator("#film-corner"), desk.ask(PLACE)
    button = player.locator(".controls button")
    button.click()
    desk.page.wait_for_function(MOVED, arg=start)
    button.click()
    stopped = desk.ask(PLACE)
    desk.page.wait_for_timeout(100)
    assert desk.ask(PLACE) == stopped
    assert float(player.locator("input[type=range]").input_value()) > 0.0


def test_playback_shows_the_poses_of_the_run(desk: Any, evidence: Evidence) -> None:
    """The corners of the peg at the end of the run, against what the run itself says."""
    runs = [evidence.inputs[name] for name in UNLIMITED.values()]
    low, high = _bounds(runs)
    made = Film(runs[0], low, SIZE[0] / float(high[0] - low[0]), 1.0, 1)
    x, y, angle = runs[0].pose[-1, 0]
    corners = outline(runs[0].scene_resolved["bodies"][0]["shapes"][0])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    expected = made.flat(corners @ turn.T + [x, y])
    desk.page.locator("#film-corner input[type=range]").evaluate(TO_THE_END)
    a, b, c, d, e, f = desk.ask(PLACE)
    drawn = desk.page.locator("#film-corner svg > g > g > path").first.get_attribute("d")
    local = np.array([list(map(float, pair.split())) for pair in drawn.strip("Mz").split("L")])
    np.testing.assert_allclose(local @ [[a, b], [c, d]] + [e, f], expected, atol=0.3)  # of 400 units of the picture


def test_a_film_begins_shortly_before_the_first_contact(desk: Any, evidence: Evidence) -> None:
    runs = [evidence.inputs[name] for name in UNLIMITED.values()]
    touched = min(run.time[np.flatnonzero(np.diff(run.contacts.offsets))[0]] for run in runs)
    begins = float(desk.page.locator("#film-corner input[type=range]").input_value())
    assert touched > 0.07
    assert touched - 0.031 <= begins <= touched - 0.03 + 5 * runs[0].dt

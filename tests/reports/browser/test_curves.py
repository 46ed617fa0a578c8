"""Curves in the browser: worlds can be hidden, the cursor reads the run's values."""

from __future__ import annotations

from typing import Any

import numpy as np

from reports.pages.records import Evidence

READ = """() => [...document.querySelector("#fig07 .readout:not([hidden])").children]
    .map((row) => [row.firstChild.textContent, row.querySelector("b").textContent])"""


def test_a_world_can_be_hidden_and_shown(desk: Any) -> None:
    button = desk.page.locator("#fig07 .legend button", has_text="PB").filter(has_not_text="IAPB")
    curves = desk.page.locator("#fig07 [data-trace] [data-curve='PB']")
    assert curves.count() == 7 and curves.first.is_visible()
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
    assert desk.page.locator("#fig07 .readout:visible").count() == 6  # the panels over time read together

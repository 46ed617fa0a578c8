"""Figure 1: contact and hand forces on a contact group, at two instants of a real run: colliding and resting."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from iapb.run import Run
from reports.figures.canvas import arrow, draw_bodies, draw_walls, is_turned, make_canvas, note
from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.geometry import body_outlines, body_placements, bounds
from reports.figures.style import BLUE, FORCE, INK, PANEL, styled
from reports.figures.svg import to_svg
from verification.finding import titled

KEY, NUMBER, TITLE = "fig01", "Figure 1", "What acts on a contact group"
RUN = "group/IAPB"
CAPTION = (
    "An arm pushes a block against a wall: one contact group, two instants of one run. When a contact is new, all "
    "approaching contacts of the group share one collision (blue: impulses). While contacts last, springs "
    "and dampers (blue: forces) pass the hand's push (red) on. The longest blue arrow of a picture sets its scale."
)
_LONGEST = 0.22  # arrow length, as a share of the picture
_MARGIN = 0.12


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw the hardest collision and the last resting instant of the run."""
    run: Run = inputs[RUN]
    instants = (("(a) colliding: impulses", hardest_collision(run), run.contacts.impulse, "N s"),
                ("(b) resting: forces", last_contact(run), run.contacts.normal_force, "N"))
    shown = [(title, step, values, unit) for title, step, values, unit in instants if step is not None]
    panels = tuple(Panel(_picture(run, step, values, f"{KEY}-{number}"), _words(run, step, values, unit), title)
                   for number, (title, step, values, unit) in enumerate(shown))
    rows = tuple((title[4:], float(run.time[step]), *map(float, 1e3 * run.contacts.point[k, :2]), float(values[k]),
                  unit) for title, step, values, unit in shown for k in contacts_of(run, step))
    columns = ("instant", "t [s]", "contact x [mm]", "y [mm]", "along the normal", "unit")
    return Figure(KEY, NUMBER, TITLE, CAPTION, panels, titled(columns, rows), (), (RUN,))


def contacts_of(run: Run, step: int) -> range:
    """Return the rows of the contact table that belong to a step."""
    return range(int(run.contacts.offsets[step]), int(run.contacts.offsets[step + 1]))


def hardest_collision(run: Run) -> int | None:
    """Return the step with the largest contact impulse, if any."""
    if not len(run.contacts.impulse) or not run.contacts.impulse.any():
        return None
    row = int(np.argmax(np.abs(run.contacts.impulse)))
    return int(np.searchsorted(run.contacts.offsets, row, side="right") - 1)


def last_contact(run: Run) -> int | None:
    """Return the last step in which something touches, if any."""
    steps = np.flatnonzero(np.diff(run.contacts.offsets))
    return int(steps[-1]) if len(steps) else None


def _picture(run: Run, step: int, values: np.ndarray, key: str) -> str:
    scene, q = run.scene_resolved, run.q[step]
    corners = [outline for _, outline in body_outlines(scene, q)]
    low, high = bounds(corners, _MARGIN)
    longest = _LONGEST * max(high - low)
    with styled() as new_figure:
        drawing = new_figure(figsize=(PANEL[0], PANEL[0] * (high - low)[1] / (high - low)[0]))
        axes = make_canvas(drawing, low, high, turned=is_turned(scene))
        draw_walls(axes, scene, reach=1.0)
        draw_bodies(axes, scene, q)
        _contact_arrows(axes, run, step, values, longest)
        _hand_arrow(axes, scene, q, 0.8 * longest)
        return to_svg(drawing, key)


def _hand_arrow(axes: Any, scene: Mapping[str, Any], q: np.ndarray, length: float) -> None:
    hand = scene["hand"]
    force = np.asarray(hand["force"][:2], dtype=float)
    point = body_placements(scene, q)[hand["body"]].of(hand["point"])
    arrow(axes, point, length * force / np.hypot(*force))
    note(axes, point, "hand", (-2, -19), color=FORCE)


def _contact_arrows(axes: Any, run: Run, step: int, values: np.ndarray, longest: float) -> None:
    rows = contacts_of(run, step)
    largest = max((abs(values[k]) for k in rows), default=0.0)
    for k in rows:
        point = run.contacts.point[k, :2]
        axes.plot(*point, "o", color=INK, markersize=3.5, zorder=7)
        if values[k]:
            arrow(axes, point, longest * values[k] / largest * run.contacts.normal[k, :2], color=BLUE)


def _words(run: Run, step: int, values: np.ndarray, unit: str) -> str:
    parts = ", ".join(f"{values[k]:.3g} {unit}" for k in contacts_of(run, step))
    return f"The group at t = {run.time[step]:.3f} s with its contacts; along their normals: {parts}."


RECIPE = Recipe(KEY, NUMBER, TITLE, (RUN,), draw, section="idea")

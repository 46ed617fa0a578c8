"""Planar scenes: Figure 1 (forces on a contact group), Figure 4 (the peg), and other scenes in their initial state."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from iapb.run import Run
from reports.figures.canvas import Canvas, arrow, draw_bodies, draw_walls, hand, is_turned, note, scale_bar
from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.geometry import body_outlines, body_placements, bounds
from reports.figures.numbers import MINUS
from reports.figures.style import BLUE, INK, MUTED, PANEL
from verification.table import titled

_LONGEST = 0.22  # arrow length, as a share of the picture


@recipe(
    "fig01", "What acts on a contact group", "group/IAPB", number="Figure 1", section="idea",
    caption="An arm pushes a block against a wall: one contact group, two instants of one run. When a contact is new, "
    "all approaching contacts of the group share one collision (blue: impulses). While contacts last, springs and "
    "dampers (blue: forces) transmit the hand force (red). The longest blue arrow of a picture sets its scale.",
)  # fmt: skip
def contact_forces(run: Run) -> Drawn:
    """Draw the hardest collision and the last resting instant of the run."""
    instants = (("(a) colliding: impulses", hardest_collision(run), run.contacts.impulse, "N s"),
                ("(b) resting: forces", last_contact(run), run.contacts.normal_force, "N"))
    panels, rows, scene = list[Panel](), list[tuple[object, ...]](), run.scene_resolved
    for title, step, values, unit in instants:
        if step is None:
            continue
        pose, contacts = run.pose[step], contacts_of(run, step)
        low, high = bounds([outline for _, outline in body_outlines(scene, pose)], 0.12)
        longest, largest = _LONGEST * max(high - low), max((abs(values[k]) for k in contacts), default=0.0)
        with Canvas(f"fig01-{len(panels)}", low, high, turned=is_turned(scene)) as canvas:
            draw_walls(canvas.axes, scene, reach=1.0)
            draw_bodies(canvas.axes, scene, pose)
            for k in contacts:
                point = run.contacts.point[k, :2]
                canvas.axes.plot(*point, "o", color=INK, markersize=3.5, zorder=7)
                if values[k]:
                    arrow(canvas.axes, point, longest * values[k] / largest * run.contacts.normal[k, :2], color=BLUE)
            hand(canvas.axes, scene, body_placements(scene, pose)[scene["hand"]["body"]], 0.8 * longest)
        told = ", ".join(f"{values[k]:.3g} {unit}" for k in contacts)
        panels.append(Panel(canvas.svg, f"The group at t = {run.time[step]:.3f} s with its contacts; along their "
                            f"normals: {told}.", title))  # fmt: skip
        rows += [(title[4:], float(run.time[step]), *map(float, 1e3 * run.contacts.point[k, :2]), float(values[k]),
                  unit) for k in contacts]  # fmt: skip
    columns = ("instant", "t [s]", "contact x [mm]", "y [mm]", "along the normal", "unit")
    return Drawn(tuple(panels), titled(columns, rows))


def contacts_of(run: Run, step: int) -> range:
    """Return the rows of the contact table that belong to a step."""
    return range(int(run.contacts.offsets[step]), int(run.contacts.offsets[step + 1]))


def hardest_collision(run: Run) -> int | None:
    """Return the step with the largest contact impulse; None without impulses."""
    if not len(run.contacts.impulse) or not run.contacts.impulse.any():
        return None
    row = int(np.argmax(np.abs(run.contacts.impulse)))
    return int(np.searchsorted(run.contacts.offsets, row, side="right") - 1)


def last_contact(run: Run) -> int | None:
    """Return the last step with a contact; None without contacts."""
    steps = np.flatnonzero(np.diff(run.contacts.offsets))
    return int(steps[-1]) if len(steps) else None


_ARROW = 0.02  # [m] on paper per newton
_AXIS = 0.006  # [m], length of the drawn axes
_WALL = 0.008  # [m], thickness of the walls shown


@recipe(
    "fig04", "The peg before the corner", "scene/peg_corner", number="Figure 4", section="idea",
    caption="Drawn from the scene file, to scale. The paper's frame has x to the left and y down. The paper gives "
    "size, mass and force of the peg. Its start and tilt are our choice and vary in the claims.",
)  # fmt: skip
def peg_corner(scene: Mapping[str, Any]) -> Drawn:
    """Draw the peg at its start, from the resolved scene."""
    low, high = bounds([*(corners for _, corners in body_outlines(scene)), np.zeros((1, 2))], 0.12)
    low, high = np.minimum(low, -_WALL), np.maximum(high, _WALL)  # x to the left, y down: show some of both walls
    with Canvas("fig04", low, high, turned=True) as canvas:
        axes = canvas.axes
        draw_walls(axes, scene, reach=1.0)
        draw_bodies(axes, scene)
        center, force = (np.asarray(each[:2]) for each in (scene["bodies"][0]["position"], scene["hand"]["force"]))
        arrow(axes, center, _ARROW * force)
        note(axes, center + _ARROW * force, "F hand", (6, -8), ha="left")
        for vector, name, offset in (((_AXIS, 0), "x", (0, 7)), ((0, _AXIS), "y", (7, 2))):  # axes of the world
            arrow(axes, (0.0, 0.0), vector, color=MUTED, width=1.1, head=7)
            note(axes, vector, name, offset, color=MUTED)
        scale_bar(axes, (high[0] - 0.002, high[1] - 0.003), 0.01, "10 mm", turned=True)
    panel = Panel(canvas.svg, "A small tilted rectangle above a floor and left of a wall, with the hand's force "
                  "pointing to the lower right.")  # fmt: skip
    body, contact = scene["bodies"][0], scene["contact"]
    x, y, angle = body["position"]
    given = (
        ("peg size [mm]", [1e3 * side for side in body["shapes"][0]["size"]], "paper"),
        ("peg mass [kg], inertia [kg m²]", (body["mass"], body["inertia"]), "paper"),
        ("peg starts at x, y [mm], θ [rad]", (1e3 * x, 1e3 * y, angle), "ours"),
        ("wall stiffness [N/m], damping [N s/m]", (contact["stiffness"], contact["damping"]), "paper"),
        ("restitution", [contact["restitution"]], "paper"),
        ("friction, its velocity threshold [m/s]", (contact["friction"], contact["friction_velocity"]), "ours"),
        ("hand force [N, N, N m]", scene["hand"]["force"], "paper"),
        ("rate [Hz]", [scene["rate"]], "paper"),
    )
    rows = tuple((quantity, ", ".join(f"{value:g}" for value in values).replace("-", MINUS), by)
                 for quantity, values, by in given)  # fmt: skip
    return Drawn((panel,), titled(("quantity", "value", "given by"), rows))


@recipe(
    "scenes", "The other scenes", "scene/peg_hole", "scene/wall_1d", section="idea",
    caption="The tight hole, in which the peg touches both sides and the end at once: six collisions, three of them "
    "redundant. Beside it a mass before a wall, the usual one-dimensional model for the stability of haptic walls.",
)  # fmt: skip
def gallery(*scenes: Mapping[str, Any]) -> Drawn:
    """Draw every scene at its start: walls, bodies and the hand's force."""
    panels = []
    for scene in scenes:
        low, high = bounds([corners for _, corners in body_outlines(scene)], 0.25)
        reach = max(high - low)
        with Canvas(f"scenes-{scene['name']}", low - 0.35 * reach, high + 0.35 * reach, PANEL,
                    turned=is_turned(scene)) as canvas:  # fmt: skip
            draw_walls(canvas.axes, scene, reach=20 * reach)
            draw_bodies(canvas.axes, scene)
            if scene["hand"]:
                hand(canvas.axes, scene, body_placements(scene)[scene["hand"]["body"]], 0.28 * reach)
        words = f"{scene['title']}: {len(scene['bodies'])} moving bodies, {len(scene['walls'])} walls, at the start."
        panels.append(Panel(canvas.svg, words, scene["title"]))
    return Drawn(tuple(panels))

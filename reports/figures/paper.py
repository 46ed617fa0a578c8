"""Figures 1 to 5 and Table I, and other scenes of the plane at their start: drawn from scene files
and one run.

The arm of Figures 2 and 3 is straight, q = (π/2, 0), q̇₀ = (1, 1) rad/s, and is struck
perpendicular to the second link at A (0.7 m) or B (0.5 m). The paper does not state the mass
distribution, so Figure 3 has two.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from typing import Any

import numpy as np

from iapb import resolve_impact
from iapb.run import Run
from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.geometry import Floats, body_outlines, body_placements, bounds, is_turned
from reports.figures.numbers import MINUS
from reports.figures.plot import Canvas, Plot, arrow, note
from reports.figures.style import (
    BLUE,
    BOUND,
    INK,
    LINK,
    MUTED,
    PAPER,
    PEG,
    STYLES,
    VERMILION,
    line_arguments,
)
from verification.table import titled

_LONGEST = 0.22  # arrow length of Figure 1, as a share of the picture
# Figure 4 [m]: an arrow per newton, the drawn axes, the walls shown
_ARROW = 0.02
_AXIS = 0.006
_WALL = 0.008


def _drawing(name: str) -> str:
    """Return a diagram that no number changes, drawn once."""
    return files(__package__).joinpath("drawings", f"{name}.svg").read_text("utf-8")


@recipe("impact-and-step")
def impact_and_step() -> Drawn:
    """Show the velocity before and after one impact, and the loop of a step."""
    panels = (
        Panel(
            _drawing("impact"),
            "An arrow v⁻, its part P v⁻ along the contact, and the velocity after the impact, which "
            "is no longer than v⁻.",
            "one impact, e = 0.5",
        ),
        Panel(
            _drawing("step"),
            "Find contacts; new ones get an impulse, lasting ones a spring; add the hand's force; "
            "move; again.",
            "one step",
        ),
    )
    return Drawn(panels)


@recipe("fig01", "group/IAPB")
def contact_forces(run: Run) -> Drawn:
    """Draw the hardest collision and the last resting instant of the run."""
    impulses = run.contacts.impulse
    forces = run.contacts.normal_force
    scene = run.scene_resolved
    touching = np.flatnonzero(np.diff(run.contacts.offsets))
    instants = []
    if impulses.any():
        hardest = (
            np.searchsorted(run.contacts.offsets, np.argmax(np.abs(impulses)), side="right") - 1
        )
        instants.append(("(a) colliding: impulses", int(hardest), impulses, "N s"))
    if len(touching):
        instants.append(("(b) resting: forces", int(touching[-1]), forces, "N"))
    panels = list[Panel]()
    rows = list[tuple[object, ...]]()
    for title, step, values, unit in instants:
        pose = run.pose[step]
        contacts = range(*map(int, run.contacts.offsets[step : step + 2]))
        low, high = bounds(body_outlines(scene, pose), 0.12)
        longest = _LONGEST * max(high - low)
        largest = max(abs(values[k]) for k in contacts)
        with Canvas(f"fig01-{len(panels)}", low, high, turned=is_turned(scene)) as canvas:
            canvas.walls(scene)
            canvas.bodies(scene, pose)
            for k in contacts:
                point = run.contacts.point[k, :2]
                canvas.axes.plot(*point, "o", color=INK, markersize=3.5, zorder=7)
                if values[k]:
                    arrow(
                        canvas.axes,
                        point,
                        longest * values[k] / largest * run.contacts.normal[k, :2],
                        color=BLUE,
                    )
            canvas.hand(scene, pose, 0.8 * longest)
        told = ", ".join(f"{values[k]:.3g} {unit}" for k in contacts)
        panels.append(
            Panel(
                canvas.svg,
                f"The group at t = {run.time[step]:.3f} s with its contacts; along their "
                f"normals: {told}.",
                title,
            )
        )
        rows += [
            (
                title[4:],
                float(run.time[step]),
                *map(float, 1e3 * run.contacts.point[k, :2]),
                float(values[k]),
                unit,
            )
            for k in contacts
        ]
    return Drawn(
        panels,
        titled(
            (
                "instant",
                "t [s]",
                "contact x [mm]",
                "y [mm]",
                "impulse or force along the normal",
                "unit",
            ),
            rows,
        ),
    )


LENGTH = 1.0  # of both links [m]
CONTACTS = {"A": 0.7, "B": 0.5}  # distance along the second link [m]
VELOCITY = np.array([1.0, 1.0])  # [rad/s]
# M of the straight arm [kg m²], its links of 1 m and 1 kg: slender uniform rods, or all mass at the
# far ends
_ROUNDING = 1e-12
READINGS = {
    "uniform rods": np.array([[8 / 3, 5 / 6], [5 / 6, 1 / 3]]),
    "point masses": np.array([[5.0, 2.0], [2.0, 1.0]]),
}
RESTITUTIONS = np.linspace(0.0, 1.0, 41)


def arm_energies() -> dict[str, Floats]:
    """Return the data of the figure: ``restitution``, and KE and KE₀ [J] by mass distribution and
    contact point."""
    table: dict[str, Floats] = {"restitution": RESTITUTIONS}
    for reading, mass in READINGS.items():
        before = 0.5 * VELOCITY @ mass @ VELOCITY
        table[f"{reading}, KE0"] = np.full(len(RESTITUTIONS), before)
        for name, distance in CONTACTS.items():
            row = -np.array([[LENGTH + distance, distance]])  # opposite to the motion
            table[f"{reading}, {name}"] = np.array(
                [
                    before + resolve_impact(mass, row, VELOCITY, e).energy_change
                    for e in RESTITUTIONS
                ]
            )
    return table


@recipe("fig02", "scene/two_link_arm_a", "scene/two_link_arm_b")
def arm(scene: Mapping[str, Any], _: Mapping[str, Any]) -> Drawn:
    """Draw the arm from the resolved scene; the two scenes differ only in the contact point."""
    poses = list(body_placements(scene).values())[:2]
    joints = np.array([poses[0].origin[:2], *(frame.of((LENGTH, 0.0)) for frame in poses)])
    pivot = joints[0]
    low = joints.min(axis=0) - (1.25, 0.22)
    high = joints.max(axis=0) + (1.25, 0.12)
    with Canvas("fig02", low, high, (3.6, 3.3)) as canvas:
        axes = canvas.axes
        axes.fill(
            pivot[0] + np.array([-0.14, 0.14, 0.14, -0.14]),
            pivot[1] + np.array([-0.16, -0.16, -0.08, -0.08]),
            facecolor=MUTED,
            edgecolor="none",
            alpha=0.6,
        )
        axes.plot([pivot[0], pivot[0]], [pivot[1] - 0.08, pivot[1]], color=INK, linewidth=2)
        for number, line in enumerate((joints[:2], joints[1:]), start=1):
            for color, width in ((LINK, 10), (PEG, 8)):
                axes.plot(*line.T, color=color, linewidth=width, solid_capstyle="round", zorder=2)
            axes.plot(
                *line[0], "o", markersize=7, markerfacecolor=PAPER, markeredgecolor=INK, zorder=5
            )
            note(axes, line.mean(axis=0), f"l{number} = 1 m, m{number} = 1 kg", (14, 0), ha="left")
            note(axes, line[0], f"q̇{number} = 1 rad/s", (14, 0), ha="left", color=MUTED)
        for (name, distance), color in zip(
            CONTACTS.items(), (BLUE, VERMILION), strict=True
        ):  # opposite to the motion
            point = poses[1].of((distance, 0.0))
            normal = -poses[1].rotation[:2, 1]
            arrow(axes, point - 0.42 * normal, 0.36 * normal, color=color)
            note(
                axes,
                point - 0.42 * normal,
                f"{name}, {distance} m",
                (-5, 0),
                color=color,
                ha="right",
            )
    words = ", ".join(
        f"{name} is {distance} m along the second link" for name, distance in CONTACTS.items()
    )
    return Drawn([Panel(canvas.svg, f"Two links in a straight line from a fixed pivot; {words}.")])


@recipe("fig03", "arm_energies")
def energy_loss(energies: Mapping[str, Floats]) -> Drawn:
    """Draw the figure from the table of `arm_energies`, a panel for each contact."""
    e = energies["restitution"]
    panels = []
    for letter, contact in zip("ab", CONTACTS, strict=True):
        with Plot(f"fig03-{contact}") as plot:
            for reading, kinetic in zip(READINGS, ("7/3", "5"), strict=True):
                before = energies[f"{reading}, KE0"]
                plot.axes.plot(e, before, **line_arguments(BOUND))
                plot.axes.plot(
                    e,
                    energies[f"{reading}, {contact}"],
                    **line_arguments(STYLES[reading]),
                    markevery=5,
                    clip_on=False,
                )
                note(
                    plot.axes,
                    (0.0, before[0]),
                    f"KE₀ = {kinetic} J",
                    (2, 4),
                    fontsize=8.5,
                    ha="left",
                    va="baseline",
                )
            plot.axes.set(
                xlim=(0, 1), ylim=(0, 6), xlabel="coefficient of restitution e", ylabel="KE [J]"
            )
        rods, masses = (energies[f"{reading}, {contact}"][0] for reading in READINGS)
        panels.append(
            Panel(
                plot.svg,
                (
                    f"Kinetic energy after a collision at {contact} over the coefficient of "
                    f"restitution. At e = 0 uniform rods "
                    f"keep {rods:.4f} J of 2.3333 J, point masses {masses:.4f} J of 5 J; at e = 1 "
                    f"all of it is kept."
                ),
                f"({letter}) Collision at {contact}, {CONTACTS[contact]} m along the second link",
            )
        )
    shown = [int(np.argmin(abs(e - at))) for at in (0.0, 0.25, 0.5, 0.75, 1.0)]
    series = [f"{reading}, {contact}" for reading in READINGS for contact in CONTACTS]
    rows = tuple((float(e[k]), *(float(energies[name][k]) for name in series)) for k in shown)
    told = "KE₀ is 7/3 J for uniform rods and 5 J for point masses at the far ends of the links."
    numbers = titled(("e", *(f"{name} [J]" for name in series)), rows, digits=6, note=told)
    rods = {name: energies[f"uniform rods, {name}"][0] for name in CONTACTS}
    whole = float(energies["uniform rods, KE0"][0])
    return Drawn(
        panels,
        numbers,
        {name: STYLES[name] for name in READINGS} | {"before the collision, KE₀": BOUND},
        {**rods, "before": whole},
        {
            "takes all at B": bool(rods["B"] < _ROUNDING * whole),
            "takes a part at A": bool(0.0 < rods["A"] < whole),
        },
    )


@recipe("fig04", "scene/peg_corner")
def peg_corner(scene: Mapping[str, Any]) -> Drawn:
    """Draw the peg at its start, from the resolved scene."""
    low, high = bounds([*body_outlines(scene), np.zeros((1, 2))], 0.12)
    # x to the left, y down: show some of both walls
    low = np.minimum(low, -_WALL)
    high = np.maximum(high, _WALL)
    with Canvas("fig04", low, high, turned=True) as canvas:
        canvas.walls(scene)
        canvas.bodies(scene)
        center, force = (
            np.asarray(each[:2])
            for each in (scene["bodies"][0]["position"], scene["hand"]["force"])
        )
        arrow(canvas.axes, center, _ARROW * force)
        note(canvas.axes, center + _ARROW * force, "F hand", (6, -8), ha="left")
        for vector, name, offset in (
            ((_AXIS, 0), "x", (0, 7)),
            ((0, _AXIS), "y", (7, 2)),
        ):  # axes of the world
            arrow(canvas.axes, (0.0, 0.0), vector, color=MUTED, width=1.1, head=7)
            note(canvas.axes, vector, name, offset, color=MUTED)
        canvas.scale_bar((high[0] - 0.002, high[1] - 0.003), 0.01, "10 mm")
    panel = Panel(
        canvas.svg,
        "A small tilted rectangle above a floor and left of a wall, with the hand's force "
        "pointing to the lower right.",
    )
    body = scene["bodies"][0]
    contact = scene["contact"]
    x, y, angle = body["position"]
    given = (
        ("peg size [mm]", [1e3 * side for side in body["shapes"][0]["size"]], "paper"),
        ("peg mass [kg], inertia [kg m²]", (body["mass"], body["inertia"]), "paper"),
        ("peg starts at x, y [mm], θ [rad]", (1e3 * x, 1e3 * y, angle), "ours"),
        (
            "wall stiffness [N/m], damping [N s/m]",
            (contact["stiffness"], contact["damping"]),
            "paper",
        ),
        ("restitution", [contact["restitution"]], "paper"),
        (
            "friction, its velocity threshold [m/s]",
            (contact["friction"], contact["friction_velocity"]),
            "ours",
        ),
        ("hand force [N, N, N m]", scene["hand"]["force"], "paper"),
        ("rate [Hz]", [scene["rate"]], "paper"),
    )
    rows = tuple(
        (quantity, ", ".join(f"{value:g}" for value in values).replace("-", MINUS), by)
        for quantity, values, by in given
    )
    return Drawn([panel], titled(("quantity", "value", "given by"), rows))


@recipe("fig05", "scene/peg_corner")
def couplings(scene: Mapping[str, Any]) -> Drawn:
    """Show both diagrams; the table repeats the scene's gains."""
    panels = (
        Panel(
            _drawing("unilateral"),
            "The hand pushes the device only; a spring and damper joins device and tool while the "
            "tool is in contact.",
            "(a) unilateral coupler: CBuc",
        ),
        Panel(
            _drawing("four_channel"),
            "The hand pushes device and tool alike; the environment force of the tool goes to the "
            "device; a spring and damper joins device and tool.",
            "(b) four channels: ideal, IAPB, PB",
        ),
    )
    names = {
        "four_channel": ("K_coord (four channels)", "B_coord (four channels)"),
        "unilateral": ("K_cpl (unilateral coupler)", "B_cpl (unilateral coupler)"),
    }
    rows = tuple(
        (name, *map(float, scene["couplings"][coupling][gain]), unit)
        for coupling, both in names.items()
        for name, gain, unit in zip(
            both, ("stiffness", "damping"), ("N/m, N m/rad", "N s/m, N m s/rad"), strict=True
        )
    )
    return Drawn(panels, titled(("Table I", "x", "y", "θ", "unit"), rows))

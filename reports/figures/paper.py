"""Figures 1 to 5 and Table I of the paper.

Diagrams are drawn once, in drawings/. The arm of Figures 2 and 3 is straight, q = (π/2, 0),
q̇₀ = (1, 1) rad/s, and is struck perpendicular to the second link at A (0.7 m) or B (0.5 m). The
paper does not state the mass distribution, so Figure 3 has two.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from iapb import resolve_impact
from reports.figures.figure import Drawn, Panel, diagram, recipe
from reports.figures.numbers import MINUS
from reports.figures.plot import Plot, note
from reports.figures.style import BOUND, STYLES, line_arguments
from verification.impacts import Floats
from verification.table import titled


@recipe("impact-and-step")
def impact_and_step() -> Drawn:
    """Show the velocity before and after one impact, and the loop of a step."""
    impact = diagram(
        "impact",
        "An arrow v⁻, its part P v⁻ along the contact, and the velocity after the impact, which "
        "is no longer than v⁻.",
        "one impact, e = 0.5",
    )
    step = diagram(
        "step",
        "Find contacts; new ones get an impulse, lasting ones a spring; add the hand's force; "
        "move; again.",
        "one step",
    )
    return Drawn([impact, step])


@recipe("fig01")
def contact_forces() -> Drawn:
    """Show the hardest collision and the last resting instant of a run of the scene
    arm_pushing."""
    colliding = diagram(
        "group_colliding",
        "The block at the wall and the arm behind it; an impulse acts at each of three contacts.",
        "(a) colliding: impulses",
    )
    resting = diagram(
        "group_resting",
        "The same, later: a spring's force acts at each contact, and the hand pushes.",
        "(b) resting: forces",
    )
    return Drawn([colliding, resting])


@recipe("fig02")
def arm() -> Drawn:
    """Show the arm, and where it is struck."""
    alt = "Two links in a straight line from a fixed pivot, struck at A or at B of the second link."
    return Drawn([diagram("arm", alt)])


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
    """Show the peg at its start, and the values of the scene."""
    alt = (
        "A small tilted rectangle above a floor and left of a wall, with the hand's force pointing "
        "to the lower right."
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
    return Drawn([diagram("peg", alt)], titled(("quantity", "value", "given by"), rows))


@recipe("fig05", "scene/peg_corner")
def couplings(scene: Mapping[str, Any]) -> Drawn:
    """Show both diagrams; the table repeats the scene's gains."""
    panels = (
        diagram(
            "unilateral",
            "The hand pushes the device only; a spring and damper joins device and tool while the "
            "tool is in contact.",
            "(a) unilateral coupler: CBuc",
        ),
        diagram(
            "four_channel",
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

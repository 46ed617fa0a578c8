"""Figure 3: kinetic energy of the two-link arm before and after one frictionless collision, over e.

The arm of Figure 2 is straight, q = (π/2, 0), q̇₀ = (1, 1) rad/s, and is struck perpendicular to the second link
at A (0.7 m) or B (0.5 m). Which mass distribution the authors used is not printed, so both are drawn.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb import resolve_impact
from reports.figures.figure import Figure, Panel, Recipe
from reports.figures.style import PANEL, STYLES, line_arguments, styled
from reports.figures.svg import to_svg
from verification.finding import titled

LENGTH, MASS = 1.0, 1.0  # of both links [m], [kg]
CONTACTS = {"A": 0.7, "B": 0.5}  # distance along the second link [m]
VELOCITY = np.array([1.0, 1.0])  # [rad/s]
READINGS = ("uniform rods", "point masses")
RESTITUTIONS = np.linspace(0.0, 1.0, 41)

Floats = NDArray[np.float64]


def mass_matrix(reading: str) -> Floats:
    """Return M of the straight arm (q2 = 0) [kg m²]: slender uniform rods, or all mass at the far ends."""
    centre, inertia = (LENGTH / 2, MASS * LENGTH**2 / 12) if reading == "uniform rods" else (LENGTH, 0.0)
    about_joint = MASS * centre**2 + inertia
    coupling = MASS * LENGTH * centre
    first = about_joint + (about_joint + MASS * LENGTH**2 + 2 * coupling)  # its own link, and the other carried along
    return np.array([[first, about_joint + coupling], [about_joint + coupling, about_joint]])


def contact_row(distance: float) -> Floats:
    """Return nᵀJ at `distance` along the second link, n against the motion of the straight arm."""
    return -np.array([[LENGTH + distance, distance]])


def energy_after(reading: str, distance: float, restitution: float) -> float:
    """Return KE after the collision [J]."""
    mass = mass_matrix(reading)
    impact = resolve_impact(mass, contact_row(distance), VELOCITY, restitution)
    return float(0.5 * VELOCITY @ mass @ VELOCITY + impact.energy_change)


def arm_energies() -> dict[str, Floats]:
    """Return the table behind the figure: ``restitution`` and, by reading and contact, KE and KE₀ [J]."""
    table: dict[str, Floats] = {"restitution": RESTITUTIONS}
    for reading in READINGS:
        mass = mass_matrix(reading)
        table[f"{reading}, KE0"] = np.full(len(RESTITUTIONS), 0.5 * VELOCITY @ mass @ VELOCITY)
        for name, distance in CONTACTS.items():
            table[f"{reading}, {name}"] = np.array([energy_after(reading, distance, e) for e in RESTITUTIONS])
    return table


def _panel(energies: Mapping[str, Floats], contact: str) -> Panel:
    e = energies["restitution"]
    with styled() as new_figure:
        drawing = new_figure(figsize=PANEL, layout="constrained")
        axes = drawing.add_subplot()
        for reading in READINGS:
            before = energies[f"{reading}, KE0"]
            axes.plot(e, before, **line_arguments(STYLES["KE₀"]))
            axes.plot(e, energies[f"{reading}, {contact}"], **line_arguments(STYLES[reading]), markevery=5)
            axes.annotate(f"KE₀ = {'7/3' if reading == 'uniform rods' else '5'} J", (0.0, before[0]),
                          xytext=(2, 4), textcoords="offset points", fontsize=8.5)
        axes.set(xlim=(0, 1), ylim=(0, 6), xlabel="coefficient of restitution e", ylabel="KE [J]")
        svg = to_svg(drawing, f"fig03-{contact}")
    left = {reading: energies[f"{reading}, {contact}"][0] for reading in READINGS}
    alt = (f"Kinetic energy after a collision at {contact} over the coefficient of restitution. "
           f"At e = 0 uniform rods keep {left['uniform rods']:.4f} J of 2.3333 J, point masses "
           f"{left['point masses']:.4f} J of 5 J; at e = 1 all of it is kept.")
    return Panel(svg, alt, f"({'a' if contact == 'A' else 'b'}) Collision at {contact}, {CONTACTS[contact]} m")


def draw(inputs: Mapping[str, Any]) -> Figure:
    """Draw the figure from the table of `arm_energies`."""
    energies = inputs["arm_energies"]
    shown = [int(np.argmin(abs(energies["restitution"] - e))) for e in (0.0, 0.25, 0.5, 0.75, 1.0)]
    series = [f"{reading}, {contact}" for reading in READINGS for contact in CONTACTS]
    rows = tuple((float(energies["restitution"][k]), *(float(energies[name][k]) for name in series)) for k in shown)
    return Figure(
        "fig03", "Figure 3", "What one collision takes from the two-link arm",
        "The same blow takes part of the energy at A and, for uniform rods, all of it at B: there the contact "
        "point is the centre of percussion of the motion. Towards e = 1 every curve returns to its KE₀. The paper "
        "prints neither the mass distribution nor values; its axis (0 to 6) leaves both readings open.",
        tuple(_panel(energies, contact) for contact in CONTACTS),
        titled(("e", *(f"{name} [J]" for name in series)), rows, digits=6,
              note="KE₀ is 7/3 J for uniform rods and 5 J for point masses at the far ends of the links."),
        (("uniform rods", "uniform rods"), ("point masses", "point masses"), ("before the collision, KE₀", "KE₀")),
        ("arm_energies",),
    )


RECIPE = Recipe("fig03", "Figure 3", "What one collision takes from the two-link arm", ("arm_energies",), draw)

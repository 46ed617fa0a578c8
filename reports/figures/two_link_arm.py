"""Figures 2 and 3: the two-link arm, and its kinetic energy before and after a frictionless collision, against e.

The arm is straight, q = (π/2, 0), q̇₀ = (1, 1) rad/s, and is struck perpendicular to the second link at A (0.7 m) or
B (0.5 m). The paper does not state the mass distribution, so both are drawn.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb import resolve_impact
from reports.figures.canvas import Canvas, arrow, note
from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.geometry import body_placements
from reports.figures.plot import Plot
from reports.figures.style import BLUE, BOUND, INK, LINK, MUTED, PAPER, PEG, STYLES, VERMILION, line_arguments
from verification.table import titled

LENGTH = 1.0  # of both links [m]
CONTACTS = {"A": 0.7, "B": 0.5}  # distance along the second link [m]
VELOCITY = np.array([1.0, 1.0])  # [rad/s]
# M of the straight arm [kg m²], its links of 1 m and 1 kg: slender uniform rods, or all mass at the far ends
READINGS = {"uniform rods": np.array([[8 / 3, 5 / 6], [5 / 6, 1 / 3]]),
            "point masses": np.array([[5.0, 2.0], [2.0, 1.0]])}  # fmt: skip
RESTITUTIONS = np.linspace(0.0, 1.0, 41)

Floats = NDArray[np.float64]


def arm_energies() -> dict[str, Floats]:
    """Return the data of the figure: ``restitution``, and KE and KE₀ [J] by mass distribution and contact point."""
    table: dict[str, Floats] = {"restitution": RESTITUTIONS}
    for reading, mass in READINGS.items():
        before = 0.5 * VELOCITY @ mass @ VELOCITY
        table[f"{reading}, KE0"] = np.full(len(RESTITUTIONS), before)
        for name, distance in CONTACTS.items():
            row = -np.array([[LENGTH + distance, distance]])  # opposite to the motion
            table[f"{reading}, {name}"] = np.array([before + resolve_impact(mass, row, VELOCITY, e).energy_change
                                                    for e in RESTITUTIONS])  # fmt: skip
    return table


@recipe(
    "fig02", "The two-link arm", "scene/two_link_arm_a", "scene/two_link_arm_b", number="Figure 2", section="idea",
    caption="Drawn from the scene files: two uniform links of 1 m and 1 kg, straight, both joints turning at 1 rad/s. "
    "The collision is at A or at B, perpendicular to the second link and without friction.",
)  # fmt: skip
def arm(scene: Mapping[str, Any], _: Mapping[str, Any]) -> Drawn:
    """Draw the arm from the resolved scene; the two scenes differ only in the contact point."""
    poses = list(body_placements(scene).values())[:2]
    ends = [frame.of((LENGTH, 0.0)) for frame in poses]
    pivot = poses[0].origin[:2]
    points = np.vstack([pivot, *ends])
    low, high = points.min(axis=0) - (1.25, 0.22), points.max(axis=0) + (1.25, 0.12)
    with Canvas("fig02", low, high, (3.6, 3.3)) as canvas:
        axes = canvas.axes
        axes.fill(pivot[0] + np.array([-0.14, 0.14, 0.14, -0.14]), pivot[1] + np.array([-0.16, -0.16, -0.08, -0.08]),
                  facecolor=MUTED, edgecolor="none", alpha=0.6)
        axes.plot([pivot[0], pivot[0]], [pivot[1] - 0.08, pivot[1]], color=INK, linewidth=2)
        for number, (frame, end) in enumerate(zip(poses, ends, strict=True), start=1):
            start = frame.origin[:2]
            line = np.vstack([start, end])
            axes.plot(*line.T, color=LINK, linewidth=10, solid_capstyle="round", zorder=2)
            axes.plot(*line.T, color=PEG, linewidth=8, solid_capstyle="round", zorder=2)
            axes.plot(*start, "o", markersize=7, markerfacecolor=PAPER, markeredgecolor=INK, zorder=5)
            note(axes, line.mean(axis=0), f"l{number} = 1 m, m{number} = 1 kg", (14, 0), ha="left")
            note(axes, start, f"q̇{number} = 1 rad/s", (14, 0), ha="left", color=MUTED)
        for (name, distance), color in zip(CONTACTS.items(), (BLUE, VERMILION), strict=True):  # opposite to the motion
            point, normal = poses[1].of((distance, 0.0)), -poses[1].rotation[:2, 1]
            arrow(axes, point - 0.42 * normal, 0.36 * normal, color=color)
            note(axes, point - 0.42 * normal, f"{name}, {distance} m", (-5, 0), color=color, ha="right")
    words = ", ".join(f"{name} is {distance} m along the second link" for name, distance in CONTACTS.items())
    return Drawn((Panel(canvas.svg, f"Two links in a straight line from a fixed pivot; {words}."),))


@recipe(
    "fig03", "What one collision takes from the two-link arm", "arm_energies", number="Figure 3",
    caption="The same plastic collision takes part of the energy at A and, for uniform rods, all of it at B, because B "
    "is the centre of percussion of the motion. At e = 1 no energy is lost. The paper gives neither the mass "
    "distribution nor values; its energy axis (0 to 6) fits uniform rods and point masses.",
)  # fmt: skip
def energy_loss(energies: Mapping[str, Floats]) -> Drawn:
    """Draw the figure from the table of `arm_energies`."""
    shown = [int(np.argmin(abs(energies["restitution"] - e))) for e in (0.0, 0.25, 0.5, 0.75, 1.0)]
    series = [f"{reading}, {contact}" for reading in READINGS for contact in CONTACTS]
    rows = tuple((float(energies["restitution"][k]), *(float(energies[name][k]) for name in series)) for k in shown)
    note = "KE₀ is 7/3 J for uniform rods and 5 J for point masses at the far ends of the links."
    numbers = titled(("e", *(f"{name} [J]" for name in series)), rows, digits=6, note=note)
    legend = (*((reading, STYLES[reading]) for reading in READINGS), ("before the collision, KE₀", BOUND))
    return Drawn(tuple(_collision(energies, contact) for contact in CONTACTS), numbers, legend)


def _collision(energies: Mapping[str, Floats], contact: str) -> Panel:
    e = energies["restitution"]
    with Plot(f"fig03-{contact}") as plot:
        for reading, kinetic in zip(READINGS, ("7/3", "5"), strict=True):
            before = energies[f"{reading}, KE0"]
            plot.axes.plot(e, before, **line_arguments(BOUND))
            plot.axes.plot(e, energies[f"{reading}, {contact}"], **line_arguments(STYLES[reading]), markevery=5)
            plot.axes.annotate(f"KE₀ = {kinetic} J", (0.0, before[0]), xytext=(2, 4), textcoords="offset points",
                               fontsize=8.5)  # fmt: skip
        plot.axes.set(xlim=(0, 1), ylim=(0, 6), xlabel="coefficient of restitution e", ylabel="KE [J]")
    rods, masses = (energies[f"{reading}, {contact}"][0] for reading in READINGS)
    alt = (f"Kinetic energy after a collision at {contact} over the coefficient of restitution. At e = 0 uniform rods "
           f"keep {rods:.4f} J of 2.3333 J, point masses {masses:.4f} J of 5 J; at e = 1 all of it is kept.")
    return Panel(plot.svg, alt, f"({'a' if contact == 'A' else 'b'}) Collision at {contact}, {CONTACTS[contact]} m")

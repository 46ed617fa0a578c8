"""C07: a plastic collision removes all or part of the kinetic energy, depending on the geometry
(Fig. 3)."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from iapb import resolve_impact
from iapb.system import System
from verification.check import Check, Study
from verification.table import Columns, Row

if TYPE_CHECKING:
    from iapb.mechanics.mechanism import Mechanism

ALL = "all"
SOME = "part"
RODS = "uniform rods"
POINTS = "point masses at the ends of the links"
PLACE_B = 0.5
ANGLES = (0.0, 0.5, 1.0, 2.0)
PLACES = (0.1, 0.3, 0.5, 0.6, 0.7, 0.9, 1.0)
VELOCITY = np.array([1.0, 1.0])
ROUNDING = 1e-12  # of one 2 x 2 factorization, as a share of an energy of about 2 J


def arm_of(study: Study, reading: str) -> Mechanism:
    """Return the mechanism of the arm: uniform rods as in the scene, or the whole mass of each link
    at its end."""
    scene = study.scene("two_link_arm_a")
    if reading == POINTS:
        for name in ("upper_arm", "forearm"):
            scene = scene.with_values(
                {f"bodies.{name}.center_of_mass": [1.0, 0.0], f"bodies.{name}.inertia": 0.0}
            )
    return System(scene).mechanism


def strike(arm: Mechanism, place: float, angle: float, restitution: float) -> dict[str, float]:
    """Energies of one frictionless impact across the second link, `place` [m] from the elbow."""
    q = np.array([0.5 * np.pi, angle])
    along = np.array([np.cos(q.sum()), np.sin(q.sum()), 0.0])
    across = np.array([-along[1], along[0], 0.0])
    elbow = np.array([np.cos(q[0]), np.sin(q[0]), 0.0])
    rows = (-across @ arm.point_jacobian(q, 1, elbow + place * along))[None, :]
    mass = arm.mass_matrix(q)
    after_velocity = resolve_impact(mass, rows, VELOCITY, restitution).velocity
    before, after = (0.5 * float(v @ mass @ v) for v in (VELOCITY, after_velocity))
    return {
        "energy before [J]": before,
        "energy after [J]": after,
        "share lost": (before - after) / before,
    }


def _struck(study: Study, case: tuple[str, float, float]) -> dict[str, Any]:
    reading, angle, place = case
    expected = ALL if case == (RODS, 0.0, PLACE_B) else SOME
    return {
        "reading": reading,
        "place along the second link [m]": place,
        "angle of the second link [rad]": angle,
        "expected": expected,
    } | strike(arm_of(study, reading), place, angle, 0.0)


def _holds(row: Row) -> bool | None:
    """Return whether the impact removes all energy where that is expected, and only a part of it
    elsewhere."""
    share = row["share lost"]
    return bool(
        abs(share - 1.0) <= ROUNDING
        if row["expected"] == ALL
        else ROUNDING < share < 1.0 - ROUNDING
    )


C07 = Check(
    key="C07",
    question="A plastic collision takes all or part of the kinetic energy, depending on the geometry.",
    cases=lambda study: list(product((RODS, POINTS), ANGLES, PLACES)),
    row=_struck,
    holds=_holds,
    columns=Columns(
        parts=("reading",), conditions=("place along the second link", "angle of the second link")
    ),
)

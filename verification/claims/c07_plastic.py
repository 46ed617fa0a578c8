"""C07: a plastic collision removes all or part of the kinetic energy, depending on the geometry (Fig. 3)."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from iapb import resolve_impact
from iapb.system import System
from verification.claims.claim import Claim
from verification.finding import Column, Row, Table

if TYPE_CHECKING:
    from iapb.mechanics.mechanism import Mechanism
    from verification.claims.study import Study

COLUMNS = (
    Column("reading", part=True),
    Column("place along the second link", "m", condition=True),
    Column("angle of the second link", "rad", condition=True),
    Column("expected"),
    Column("energy before", "J"),
    Column("energy after", "J"),
    Column("share lost"),
)
ALL, SOME = "all", "part"
RODS, POINTS = "slender rods", "point masses at the tips"
PLACE_A, PLACE_B = 0.7, 0.5
ANGLES = (0.0, 0.5, 1.0, 2.0)
PLACES = (0.1, 0.3, 0.5, 0.6, 0.7, 0.9, 1.0)
VELOCITY = np.array([1.0, 1.0])

# Rounding of one 2 x 2 factorization, as a share of an energy of about 2 J.
ROUNDING = 1e-12


def cases(study: Study) -> list[tuple[str, float, float]]:
    """Impacts across the second link of the arm of Fig. 2: at A, B and other places, and with the elbow bent."""
    return [case for case in product((RODS, POINTS), ANGLES, PLACES) if case != (POINTS, 0.0, 1.0)]


def trials(study: Study, case: tuple[str, float, float]) -> Iterator[dict[str, Any]]:
    """Yield the trial of one impact."""
    reading, angle, place = case
    expected = ALL if case == (RODS, 0.0, PLACE_B) else SOME
    yield {"reading": reading, "place along the second link": place, "expected": expected,
           "angle of the second link": angle} | strike(arm_of(study, reading), place, angle, 0.0)  # fmt: skip


def arm_of(study: Study, reading: str) -> Mechanism:
    """Return the mechanism of the arm: uniform rods as in the scene, or the whole mass of each link at its end."""
    scene = study.scene("two_link_arm_a")
    if reading == POINTS:
        for name in ("upper_arm", "forearm"):
            scene = scene.with_values({f"bodies.{name}.center_of_mass": [1.0, 0.0], f"bodies.{name}.inertia": 0.0})
    return System(scene).mechanism


def strike(arm: Mechanism, place: float, angle: float, restitution: float) -> dict[str, float]:
    """Energies of one frictionless impact across the second link, `place` [m] from the elbow."""
    q = np.array([0.5 * np.pi, angle])
    along = np.array([np.cos(q.sum()), np.sin(q.sum()), 0.0])
    across = np.array([-along[1], along[0], 0.0])
    elbow = np.array([np.cos(q[0]), np.sin(q[0]), 0.0])
    rows = (-across @ arm.point_jacobian(q, 1, elbow + place * along))[None, :]
    mass = arm.mass_matrix(q)
    before = 0.5 * float(VELOCITY @ mass @ VELOCITY)
    after_velocity = resolve_impact(mass, rows, VELOCITY, restitution).velocity
    after = 0.5 * float(after_velocity @ mass @ after_velocity)
    return {"energy before": before, "energy after": after, "share lost": (before - after) / before}


def holds(row: Row) -> bool | None:
    """Return whether the impact removes all energy where that is expected, and only a part of it elsewhere."""
    share = row["share lost"]
    if row["expected"] == ALL:
        return bool(abs(share - 1.0) <= ROUNDING)
    return bool(ROUNDING < share < 1.0 - ROUNDING)


def finding(table: Table) -> str:
    """Return the result in words, with numbers."""
    straight = {"angle of the second link": 0.0}
    texts = []
    for reading in (RODS, POINTS):
        ours = table.where(reading=reading, **straight)
        a, b = (ours.where(**{"place along the second link": place}).records()[0] for place in (PLACE_A, PLACE_B))
        texts.append(
            f"{reading}: {a['energy before']:.4f} J before, {a['energy after']:.6f} J left at A, "
            f"{b['energy after']:.1e} J at B"
        )
    shares = table.column("share lost")
    span = f"{min(shares):.3f} to {max(shares):.3f}"
    return f"With {'; with '.join(texts)}. Over all contact places and joint angles the share of energy lost is {span}."


CLAIM = Claim(
    id="C07",
    statement="A plastic collision takes all or part of the kinetic energy, depending on the geometry.",
    place="Section V-A, Fig. 2 and 3",
    quantity="Share of kinetic energy lost by the two-link arm in one frictionless collision with e = 0.",
    tolerance="All or none of the energy, to 1e-12 of it: the rounding of one 2 x 2 factorization.",
    columns=COLUMNS,
    cases=cases,
    trials=trials,
    holds=holds,
    finding=finding,
    axes=("place along the second link", "angle of the second link", "reading"),
)

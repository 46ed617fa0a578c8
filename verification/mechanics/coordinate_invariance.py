"""C06 on an arm: the same impact in joint angles, absolute angles, and hand positions, up to the singular pose.

With q = f(r), T = df/dr and v_q = T v_r, T maps the velocity found in r back to q. In exact arithmetic the result does
not depend on f. In doubles the condition number of M' = T^T M T grows by up to kappa(T)^2, and nearly dependent rows
amplify errors by 1/sigma_min.

The equations in absolute angles r_i, measured from the x axis, are independent of the engine: a point at distance s
along link k is at sum_(i<k) l_i u(r_i) + s u(r_k) with u = (cos, sin), so that M'_ij = mu_ij cos(r_i - r_j).
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from iapb import resolve_impact
from iapb.errors import IapbError
from iapb.mechanics.mechanism import Body, Joint, Mechanism
from reference import Floats
from verification.check import Check, Study
from verification.impacts import EPS
from verification.table import Row

AGREEMENT = 1e-10  # tolerance relative to the velocity in the kinetic metric, for moderate condition numbers:
MODERATE = 1e4  # largest kappa(M) and kappa(df/dr)^2 there
SEPARATED = 0.1  # and least sigma_min of independent rows of unit length
CONSTANT = 10.0  # C of the bound, times d: a Cholesky factor, two solves and a projection
SEED = 20050606

LENGTHS, MASSES = np.array([1.0, 1.0, 0.6]), np.array([1.0, 1.0, 0.5])  # [m], [kg] of a chain of slender uniform rods
LINKS = len(LENGTHS)
# Angle of the second joint [rad]. At 0, the singular pose, the hand's position is no valid coordinate, but angles are.
ELBOWS = (*(10.0**-k for k in range(13)), 0.0)
POSES = {"quick": 4, "full": 40}  # random other angles and velocities for each elbow
RESTITUTIONS = (0.0, 0.7, 1.0)
ACROSS = 0.5 * np.pi


class Contact(NamedTuple):
    """A contact on the arm: link, distance [m] from the link's joint along it, angle [rad] from link to normal."""

    link: int
    distance: float
    angle: float


_UPPER, _LAST = Contact(1, 0.7, ACROSS), Contact(2, 0.4, 0.7)
CONTACTS = {
    "one": (Contact(2, 0.4, ACROSS),),
    "two, separated": (_UPPER, _LAST),
    "three, two of them one contact twice": (_UPPER, _LAST, _UPPER),
    "one, pressed from both sides": (Contact(2, 0.4, ACROSS), Contact(2, 0.4, ACROSS - np.pi)),
}
# two contacts on one link at decreasing distance: nearly dependent rows
CLOSE = {f"two, {gap:g} m apart": (_UPPER, Contact(1, 0.7 + gap, ACROSS)) for gap in (1e-2, 1e-4, 1e-6, 1e-8)}

ABSOLUTE, HAND = "absolute angles", "place of the hand"


def arm() -> Mechanism:
    """Return the arm as a mechanism of the engine, with joints about z."""
    bodies = []
    for k, (length, mass) in enumerate(zip(LENGTHS, MASSES, strict=True)):
        parent, start = (f"link {k - 1}", LENGTHS[k - 1]) if k else (None, 0.0)
        slender = mass * length**2 / 12.0 * np.diag([0.0, 1.0, 1.0])
        placement = np.eye(3), (start, 0.0, 0.0)
        bodies.append(Body(f"link {k}", parent, Joint("revolute"), placement, mass, (0.5 * length, 0.0, 0.0), slender))
    return Mechanism(bodies)


def _arms(link: int, distance: float) -> Floats:
    """Length (d,) [m] that each link contributes to the position of a point."""
    return np.array([*LENGTHS[:link], distance, *[0.0] * (LINKS - link - 1)])


def absolute_mass_matrix(r: Floats) -> Floats:
    """Return M'(r) of the absolute angles."""
    arms = np.array([_arms(k, 0.5 * length) for k, length in enumerate(LENGTHS)])
    return (arms.T * MASSES) @ arms * np.cos(r[:, None] - r[None, :]) + np.diag(MASSES * LENGTHS**2 / 12.0)


def absolute_row(r: Floats, contact: Contact) -> Floats:
    """Return n^T dx/dr (d,) of the contact's point."""
    return _arms(contact.link, contact.distance) * np.sin(r[contact.link] + contact.angle - r)  # n . (-sin, cos)


def joint_rows(mechanism: Mechanism, q: Floats, contacts: tuple[Contact, ...]) -> Floats:
    """Return n^T J (c, d) of the contacts in joint angles, computed by the engine."""
    (rotations, positions), rows = mechanism.placements(q), []
    for link, distance, angle in contacts:
        normal = rotations[link] @ np.array([np.cos(angle), np.sin(angle), 0.0])
        point = positions[link] + distance * rotations[link][:, 0]
        rows.append(normal @ mechanism.point_jacobian(q, link, point))
    return np.array(rows)


def hand_jacobian(mechanism: Mechanism, q: Floats) -> Floats:
    """Return d(hand)/dq (d, d): position (x, y) of the second link's end, and the sum of the angles."""
    rotations, positions = mechanism.placements(q)
    tip = positions[1] + LENGTHS[1] * rotations[1][:, 0]
    return np.vstack([mechanism.point_jacobian(q, 1, tip)[:2], np.ones(LINKS)])


def _cases(_: Study) -> Iterator[tuple[str, str, float]]:
    for case in product((ABSOLUTE, HAND), {**CONTACTS, **CLOSE}, ELBOWS):
        if case[::2] != (HAND, ELBOWS[-1]):
            yield case


def _row(study: Study, case: tuple[str, str, float]) -> Row:
    """The impact with the largest error / tolerance of some random poses, and the number of refused impacts."""
    coordinates, label, elbow = case
    rng, mechanism = np.random.default_rng([SEED, ELBOWS.index(elbow)]), arm()
    rows = []
    for k in range(POSES[study.depth]):
        q = np.array([rng.uniform(-np.pi, np.pi), elbow, rng.uniform(-1.5, 1.5)])
        v, e = rng.normal(size=LINKS), RESTITUTIONS[k % len(RESTITUTIONS)]
        rows.append(compare(mechanism, q, v, e, {**CONTACTS, **CLOSE}[label], coordinates))
    solved = [row for row in rows if row["error"] is not None]
    worst = max(solved or rows, key=lambda row: (row["error"] or 0.0) / row["tolerance"])
    return {"coordinates": coordinates, "contacts": label, "elbow [rad]": elbow, **worst,
            "refused": len(rows) - len(solved)}  # fmt: skip


def compare(
    mechanism: Mechanism, q: Floats, v: Floats, e: float, contacts: tuple[Contact, ...], coordinates: str
) -> dict[str, Any]:
    """Return condition numbers, error, bound and tolerance of one impact; the error of a refused impact is None."""
    mass, rows = mechanism.mass_matrix(q), joint_rows(mechanism, q, contacts)
    here = resolve_impact(mass, rows, v, e)
    new_mass, new_rows, change = _transformed(mechanism, q, contacts, coordinates)
    squared = float(np.linalg.cond(change)) ** 2
    sigma, kappa = _separation(mass, rows, here.rank), float(np.linalg.cond(mass))
    error: float | None
    try:
        there = resolve_impact(new_mass, new_rows, np.linalg.solve(change, v), e)
        difference = here.velocity - change @ there.velocity
        error = float(np.sqrt((difference @ mass @ difference) / (v @ mass @ v)))
    except IapbError:  # the mass matrix of these coordinates is not positive definite in doubles any more
        error = None
    bound = CONSTANT * LINKS * EPS * kappa * squared / sigma
    moderate = kappa <= MODERATE and squared <= MODERATE and sigma >= SEPARATED
    return {"κ(M)": kappa, "κ(∂f/∂r)²": squared, "σ_min": sigma, "error": error, "bound": bound,
            "tolerance": AGREEMENT if moderate else bound}  # fmt: skip


def _transformed(
    mechanism: Mechanism, q: Floats, contacts: tuple[Contact, ...], coordinates: str
) -> tuple[Floats, Floats, Floats]:
    """M', J' and T = df/dr in the other coordinates."""
    if coordinates == ABSOLUTE:
        r = np.cumsum(q)
        rows = np.array([absolute_row(r, contact) for contact in contacts])
        return absolute_mass_matrix(r), rows, np.eye(LINKS) - np.eye(LINKS, k=-1)  # q_i = r_i - r_(i-1)
    change = np.array(np.linalg.inv(hand_jacobian(mechanism, q)), np.float64)
    new_mass = change.T @ mechanism.mass_matrix(q) @ change
    return 0.5 * (new_mass + new_mass.T), joint_rows(mechanism, q, contacts) @ change, change


def _separation(mass: Floats, rows: Floats, rank: int) -> float:
    """Smallest singular value within the rank, of J L^-T with rows of unit length."""
    whitened = np.linalg.solve(np.linalg.cholesky(mass), rows.T)
    values = np.linalg.svd(whitened / np.linalg.norm(whitened, axis=0), compute_uv=False)
    return float(values[rank - 1])


def holds(row: Row) -> bool | None:
    """Judge a row: a tolerance of 1 or more gives no outcome; otherwise a refused impact is a failure."""
    return None if row["tolerance"] >= 1.0 else row["refused"] == 0 and row["error"] <= row["tolerance"]


COORDINATES = Check(
    key="coordinate invariance", question="An impact solved in other coordinates has the same outcome, up to rounding.",
    cases=_cases, row=_row, holds=holds, parts=("coordinates",), spans=("error",),
    note=f"See claim C06. The joint angles are q = f(r) of the other coordinates r; σ_min is the least nonzero "
    f"singular value of the unit rows in the kinetic metric. Bound: {CONSTANT:g} d ε κ(M) κ(∂f/∂r)² / σ_min. Tolerance "
    f"{AGREEMENT:g} if κ(M) and κ(∂f/∂r)² are at most {MODERATE:g} and σ_min is at least {SEPARATED:g}, otherwise "
    "the bound. Error, bound and tolerance are relative to |v⁻|; a tolerance of 1 or more tests nothing.",
)  # fmt: skip

"""A planar arm in three kinds of coordinates: joint angles (by the engine), absolute angles, and the hand's position.

The equations in absolute angles r_i, measured from the x axis, are independent of the engine: a point at distance s
along link k is at sum_(i<k) l_i u(r_i) + s u(r_k) with u = (cos, sin), so that M'_ij = mu_ij cos(r_i - r_j).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.mechanics.mechanism import Body, Joint, Mechanism

Floats = NDArray[np.float64]


class Contact(NamedTuple):
    """A contact on the arm: link, distance [m] from the link's joint along it, angle [rad] from link to normal."""

    link: int
    distance: float
    angle: float


class PlanarArm(NamedTuple):
    """Slender uniform rods in a chain: lengths [m] and masses [kg]."""

    lengths: tuple[float, ...]
    masses: tuple[float, ...]

    @property
    def links(self) -> int:
        """Number of links, equal to the number of coordinates."""
        return len(self.lengths)

    def mechanism(self) -> Mechanism:
        """Return the arm as a mechanism of the engine, with joints about z."""
        bodies = []
        for k, (length, mass) in enumerate(zip(self.lengths, self.masses, strict=True)):
            parent, start = (f"link {k - 1}", self.lengths[k - 1]) if k else (None, 0.0)
            slender = mass * length**2 / 12.0 * np.diag([0.0, 1.0, 1.0])
            joint, placement = Joint("revolute"), (np.eye(3), (start, 0.0, 0.0))
            bodies.append(
                Body(f"link {k}", parent, joint, placement, mass, (0.5 * length, 0.0, 0.0), slender)
            )
        return Mechanism(bodies)

    def absolute_mass_matrix(self, r: Floats) -> Floats:
        """M'(r) of the absolute angles."""
        arms = np.array([self._arms(k, 0.5 * self.lengths[k]) for k in range(self.links)])
        masses = np.array(self.masses)
        own = np.diag(masses * np.array(self.lengths) ** 2 / 12.0)
        return (arms.T * masses) @ arms * np.cos(r[:, None] - r[None, :]) + own

    def absolute_row(self, r: Floats, contact: Contact) -> Floats:
        """n^T dx/dr (d,) of the contact's point."""
        arms, normal = self._arms(contact.link, contact.distance), r[contact.link] + contact.angle
        return arms * np.sin(normal - r)  # n . (-sin r_i, cos r_i)

    def joint_rows(self, mechanism: Mechanism, q: Floats, contacts: tuple[Contact, ...]) -> Floats:
        """n^T J (c, d) of the contacts in joint angles, computed by the engine."""
        rotations, positions = mechanism.placements(q)
        rows = []
        for contact in contacts:
            axes, origin = rotations[contact.link], positions[contact.link]
            point = origin + contact.distance * axes[:, 0]
            normal = axes @ np.array([np.cos(contact.angle), np.sin(contact.angle), 0.0])
            rows.append(normal @ mechanism.point_jacobian(q, contact.link, point))
        return np.array(rows)

    def hand_jacobian(self, mechanism: Mechanism, q: Floats) -> Floats:
        """d(hand)/dq (d, d): position (x, y) of the second link's end and, for three links, the sum of the angles."""
        rotations, positions = mechanism.placements(q)
        last = 1  # two links determine the position; a third one only rotates
        tip = positions[last] + self.lengths[last] * rotations[last][:, 0]
        rows = mechanism.point_jacobian(q, last, tip)[:2]
        return np.vstack([rows, np.ones((self.links - 2, self.links))])

    def _arms(self, link: int, distance: float) -> Floats:
        """Length (d,) [m] that each link contributes to the position of the point."""
        return np.array([*self.lengths[:link], distance, *[0.0] * (self.links - link - 1)])

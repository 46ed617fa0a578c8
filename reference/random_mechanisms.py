"""Random trees of rigid bodies and random states from a seed, for comparisons and property
tests."""

from __future__ import annotations

import numpy as np

from iapb.mechanics.joints import KINDS
from iapb.mechanics.mechanism import Body, Joint, Mechanism
from reference import Floats

# Masses [kg] and radii of gyration [m] span these decades. A flat or rod-like body has a nearly
# singular inertia: its second moments of mass go down to this share.
MASS_DECADES = (-3.0, 2.0)
GYRATION_DECADES = (-2.0, 0.0)
THINNEST = 1e-9


def random_rotation(rng: np.random.Generator) -> Floats:
    """Return a rotation matrix (3, 3), uniform over SO(3)."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0.0 else -q


def random_inertia(rng: np.random.Generator, mass: float) -> Floats:
    """Return a physical inertia (3, 3) about the centre of mass, sometimes nearly singular.

    It is made from second moments of mass s >= 0, with principal moments s_y + s_z, s_z + s_x and
    s_x + s_y.
    """
    gyration = 10.0 ** rng.uniform(*GYRATION_DECADES)
    second = mass * gyration**2 * np.where(rng.random(3) < 0.3, THINNEST, rng.random(3))
    axes = random_rotation(rng)
    inertia = axes @ np.diag(second.sum() - second) @ axes.T
    return 0.5 * (inertia + inertia.T)


def random_mechanism(
    rng: np.random.Generator, joints: int, kinds: tuple[str, ...] = tuple(KINDS)
) -> Mechanism:
    """Return a tree of bodies, depth first, from a chain to a bushy tree, with `kinds` of
    joints."""
    bodies: list[Body] = []
    chain: list[str] = []  # from the root to the newest body
    bushy = rng.random()
    for i in range(joints):
        while len(chain) > 1 and rng.random() < 0.7 * bushy:
            chain.pop()
        name = f"body {i}"
        parent = chain[-1] if chain else None
        kind = str(rng.choice(kinds))
        mass = 10.0 ** rng.uniform(*MASS_DECADES)
        x, y, z = rng.normal(size=3).tolist()
        place = (random_rotation(rng), rng.normal(scale=0.5, size=3))
        center = rng.normal(scale=0.3, size=3)
        bodies.append(
            Body(
                name,
                parent,
                Joint(kind, (x, y, z)),
                place,
                mass,
                center,
                random_inertia(rng, mass),
            )
        )
        chain.append(name)
    return Mechanism(bodies)


def random_state(rng: np.random.Generator, mechanism: Mechanism) -> tuple[Floats, Floats]:
    """Return (q, v): a configuration far from neutral, and velocities of about 1 [m/s, rad/s]."""
    q = mechanism.integrate(mechanism.neutral(), rng.normal(scale=2.0, size=mechanism.nv))
    return q, rng.normal(size=mechanism.nv)

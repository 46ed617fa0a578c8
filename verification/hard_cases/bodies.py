"""Collisions with a known answer in closed form: cradle, break shot, rocking block, superball, stack, wedge, rod.

The coordinates of bodies in space are the position (x, y, z) of the centre of mass and ω, in world axes. The obstacle
stops the contact point in all three directions (rows along z, x, y).
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from verification.hard_cases.case import FrictionalCase, HardCase
from verification.impacts import cradle_rows


def touching_cradle_impact() -> HardCase:
    """Five equal balls that touch in a row; all four contacts are in one impact."""
    return HardCase(
        "Newton's cradle, all contacts at once", "textbook; paper (12) with assumption (i)",
        "three contacts do not approach; as equalities their relative velocities stay zero",
        "the first ball returns with 3/5, the other four leave together with 2/5",
        np.eye(5), cradle_rows(5), np.array([1.0, 0.0, 0.0, 0.0, 0.0]), 1.0,
    )  # fmt: skip


def break_shot() -> HardCase:
    """A ball strikes two touching balls along normals of the triangle 3-4-5; the two do not approach each other."""
    n, t = Fraction(4, 5), Fraction(3, 5)
    exact = np.array([[n, t, -n, -t, 0, 0], [n, -t, 0, 0, -n, t]], dtype=object)
    return HardCase(
        "Three-ball break shot",
        "billiards: Coriolis, Théorie mathématique des effets du jeu de billard (1835)",
        "two contacts share one ball; if they are resolved one after the other, the outcome depends on the order",
        "symmetric: the striker keeps 1 − 4 n² / (1 + 2 n²) of its speed, n the cosine of the normals",
        np.eye(6), exact.astype(float), np.array([-1.0, 0.0, 0.0, 0.0, 0.0, 0.0]), 1.0, exact_jacobian=exact,
    )  # fmt: skip


def rocking_block() -> HardCase:
    """A block of half sides 3 and 4 that rotates about one lower corner when the other corner strikes."""
    half, high = 3.0, 4.0
    inertia = (half**2 + high**2) / 3.0
    turning = np.array([-high, half, 1.0])  # rotation about the corner at (−half, −high) at 1 rad/s
    return HardCase(
        "Rocking block, one rock", "Housner, Bull. Seismological Society of America 53 (1963)",
        "the struck corner stops in both directions and the other corner lifts off; the geometry alone determines the "
        "energy loss",
        "angular momentum about the struck corner is conserved: ω⁺ = ω⁻ (1 − 3/2 sin² α), α the block's slenderness",
        np.diag([1.0, 1.0, inertia]), np.array([[0.0, 1.0, half], [1.0, 0.0, high]]), turning, 0.0,
    )  # fmt: skip


def superball() -> HardCase:
    """A ball of radius 1/8 whose contact point reverses its velocity along and across the wall."""
    radius = 0.125
    return HardCase(
        "Superball with grip", "Garwin, American J. of Physics 37 (1969)",
        "the tangential row is elastic as well: spin and sliding exchange energy without loss",
        "both velocity components of the contact point are reversed, energy is conserved",
        np.diag([1.0, 1.0, 0.4 * radius**2]), np.array([[0.0, 1.0, 0.0], [1.0, 0.0, radius]]),
        np.array([2.0, -1.0, 3.0]), 1.0,
    )  # fmt: skip


def stack_of_mass_ratio() -> HardCase:
    """A column of eight bodies, alternately heavy and a million times lighter, in a plastic impact."""
    masses = np.array([1.0, 1e-6] * 4)
    return HardCase(
        "Stack of eight bodies, mass ratio 1e6",
        "stacks are where penalties and iterative solvers fail first: Acary and Brogliato (2008), chapter 1",
        "light bodies transmit the impulse between heavy ones: W has entries of size 1 and 1e6",
        "all bodies move with the velocity that conserves momentum",
        np.diag(masses), cradle_rows(8), np.array([-1.0, 0.5, 0.0, 0.0, 0.25, 0.0, 0.0, 2.0]), 0.0,
    )  # fmt: skip


def wedge() -> HardCase:
    """A point that moves into a corner of two walls with an angle of 4e-6; their normals are exact fractions."""
    m = 10**6
    n, t = Fraction(m * m - 1, m * m + 1), Fraction(2 * m, m * m + 1)
    exact = np.array([[n, t], [-n, t]], dtype=object)
    return HardCase(
        "Wedging between walls 4e-6 apart in angle", "a wedge: friction cones and normals nearly opposite",
        "the rows are nearly opposite: the net impulse is a millionth of the contact impulses",
        "both approach speeds are reversed, to an error of ε divided by the angle",
        np.eye(2), exact.astype(float), np.array([0.5, -1.0]), 0.5, exact_jacobian=exact,
    )  # fmt: skip


def painleve_impact() -> FrictionalCase:
    """Painlevé's rod: its lower end strikes the floor while sliding, with μ = 2."""
    sine, cosine = 0.8, 0.6
    return FrictionalCase(
        "Painlevé's rod, its impact", "Painlevé (1895); Génot and Brogliato (1999)",
        "sliding friction presses the end into the floor more than it slows it: the slip stops during the impact",
        "restitution met, no energy gain: the tangential impulse is limited by sticking and by the energy lost in the "
        "impact",
        np.diag([1.0, 1.0, 1.0 / 12.0]), np.array([[0.0, 1.0, -0.5 * cosine]]), np.array([-1.0, -0.1, 0.0]), 0.0,
        methods=("factored", "Newton with Coulomb"), tangent=np.array([[1.0, 0.0, 0.5 * sine]]), friction=2.0,
    )  # fmt: skip


def _at_a_point(r: tuple[Fraction | int, ...]) -> np.ndarray:
    """Return the rows (3, 6), in fractions, of the velocity along z, x, y of a point at r from the centre of mass."""
    x, y, z = (Fraction(part) for part in r)
    return np.array([[0, 0, 1, y, -x, 0], [1, 0, 0, 0, z, -y], [0, 1, 0, -z, 0, x]], dtype=object)


def sleeping_top() -> HardCase:
    """An upright top that spins at 1,000 rad/s and lands on its tip at 1 cm/s."""
    exact = _at_a_point((0, 0, Fraction(-1, 2)))
    return HardCase(
        "Sleeping top set on its tip",
        "Klein and Sommerfeld, Über die Theorie des Kreisels (1897-1910); numbers ours",
        "nearly all of the energy (all but 1e-9) is spin, which no contact row changes",
        "the spin is unchanged; the tip stops in all three directions, and the axis starts to turn",
        np.diag([2.0, 2.0, 2.0, 0.75, 0.75, 0.5]), exact.astype(float),
        np.array([0.125, 0.0, -0.01, 0.0, 0.0, 1000.0]), 0.0, exact_jacobian=exact,
    )  # fmt: skip


def rolling_coin() -> HardCase:
    """A coin that leans by the angle of the triangle 3-4-5 and lands on its rim, spinning without rolling."""
    exact = _at_a_point((Fraction(3, 5), 0, Fraction(-4, 5)))
    mass = np.diag([100.0] * 6)
    mass[3:, 3:] = [[41.0, 0.0, 12.0], [0.0, 25.0, 0.0], [12.0, 0.0, 34.0]]  # 25 (1 + a aᵀ), a = (4/5, 0, 3/5)
    return HardCase(
        "Coin that starts to roll", "Appell, Traité de mécanique rationnelle (1900); numbers ours",
        "a full inertia matrix couples sliding, falling and spin: sticking changes the axis of the spin",
        "it rolls: the contact point of the rim is at rest, and angular momentum about that point is conserved",
        mass, exact.astype(float), np.array([0.0, 2.0, -1.0, -4.0, 0.0, -3.0]), 0.0, exact_jacobian=exact,
    )  # fmt: skip


def rattleback() -> HardCase:
    """A celt struck on its end; its axes of inertia are rotated by the angle of the triangle 3-4-5 from its shape."""
    exact = _at_a_point((Fraction(1, 2), 0, Fraction(-1, 4)))
    mass = np.diag([100.0, 100.0, 100.0, 52.0, 73.0, 120.0])
    mass[3, 4] = mass[4, 3] = -36.0  # 25 R diag(1, 4) Rᵀ
    return HardCase(
        "Rattleback tapped on its end",
        "Walker, Quarterly J. of Pure and Applied Mathematics 28 (1896); numbers ours",
        "a fall without spin creates spin through one product of inertia",
        "the sign of the product of inertia decides the sense of the spin; without it there is no spin",
        mass, exact.astype(float), np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0]), 0.0, exact_jacobian=exact,
    )  # fmt: skip

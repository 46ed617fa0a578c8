"""Hard cases of mechanics: light bodies, short lever arms, singular arms, grazing, tiny speeds, unequal restitution."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from verification.hard_cases.case import HardCase


def mass_ratio() -> HardCase:
    """A grain of 1e-12 kg between a body of 1 kg and the wall."""
    return HardCase(
        "Mass ratio 1e12",
        "a grain between a body and a wall; bad scaling: Higham, Accuracy and Stability (2002)",
        "κ(M) = 1e12; the light body's speed is a thousandfold the heavy one's error",
        "both bodies bounce exactly, no energy gain",
        np.diag([1.0, 1e-12]), np.array([[1.0, -1.0], [0.0, 1.0]]), np.array([-1.0, -1e3]), 1.0,
    )  # fmt: skip


def tiny_lever_arm() -> HardCase:
    """A face that strikes at two points 1e-9 m apart."""
    return HardCase(
        "Lever arms of 1e-9 m", "contact points that a detector reports at nearly the same place",
        "two rows whose difference is 1e-9: a real rotation constraint, close to noise",
        "rank 2: the rotation is stopped",
        np.diag([1.0, 1.0, 1.0]), np.array([[0.0, 1.0, 0.0], [0.0, 1.0, 1e-9]]), np.array([1.0, -1.0, 3.0]),
        0.0,
    )  # fmt: skip


def _arm(q1: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the mass matrix of the straight arm of Fig. 2 (slender rods) and the row of its tip along the arm."""
    mass = np.array([[8.0 / 3.0, 5.0 / 6.0], [5.0 / 6.0, 1.0 / 3.0]])
    tip, elbow = 2.0 * np.array([np.cos(q1), np.sin(q1)]), np.array([np.cos(q1), np.sin(q1)])
    along = np.array([np.cos(q1), np.sin(q1)])
    rows = [along @ [-lever[1], lever[0]] for lever in (tip, tip - elbow)]
    return mass, np.array([rows])


def straight_arm() -> HardCase:
    """The straight arm struck along its own direction; its row is set to exact zeros, as the contact set does."""
    mass, row = _arm(0.3)
    cleaned = np.where(np.abs(row) <= 1e-13 * np.array([[2.0, 1.0]]), 0.0, row)
    return HardCase(
        "Straight arm struck along itself", "a singular linkage: Nakamura and Hanafusa (1986)",
        "the exact row is zero, the computed one 1e-16: unit scaling would promote it to a contact",
        "nothing happens, since the contact set makes such a row exactly zero",
        mass, cleaned, np.array([1.0, -0.5]), 0.0,
        exact_jacobian=np.array([[Fraction(0), Fraction(0)]], dtype=object),
        methods=("factored", "gram_pinv", "damped", "svd"),
    )  # fmt: skip


def face_at_three_points() -> HardCase:
    """A box face on three points of a wall that is rotated by the angle of a 3-4-5 triangle; the exact rank is two."""
    n, t = (Fraction(-3, 5), Fraction(4, 5)), (Fraction(4, 5), Fraction(3, 5))
    rows = []
    for arm in (Fraction(-1, 2), Fraction(1, 7), Fraction(1, 2)):
        r = [Fraction(-3, 10) * n[k] + arm * t[k] for k in range(2)]
        rows.append([n[0], n[1], r[0] * n[1] - r[1] * n[0]])
    exact = np.array(rows, dtype=object)
    return HardCase(
        "Face struck at three points in a rotated frame",
        "hyperstatic contact of flat faces; the triangle 3-4-5 makes the rotation exact",
        "rank 2 in exact geometry, rank 3 in doubles: a row of rounding noise would brake the sliding",
        "the tangential speed is unchanged",
        np.diag([2.0, 2.0, 0.1]), exact.astype(float), np.array([2.4 + 0.6, 1.8 - 0.8, 0.0]), 0.5,
        exact_jacobian=exact, methods=("factored", "gram_pinv", "damped", "svd"),
    )  # fmt: skip


def grazing() -> HardCase:
    """An impact of fast sliding with a normal velocity of 1e-8 m/s."""
    return HardCase(
        "Grazing impact",
        "a fast tool brushing a wall; Nordmark, J. Sound and Vibration 145 (1991), on grazing",
        "the approach velocity is 1e-10 of the speed",
        "the sliding velocity keeps all its digits; the approach velocity is reversed with an error of ε times the "
        "speed",
        np.array([[2.0, 0.5, 0.0], [0.5, 1.0, 0.25], [0.0, 0.25, 3.0]]),
        np.array([[0.0, 1.0, 0.0], [0.0, 1.0, 0.5]]), np.array([100.0, -1e-8, 0.0]), 0.7,
    )  # fmt: skip


def subnormal_speeds() -> HardCase:
    """An impact at speeds near 1e-312 m/s."""
    return HardCase(
        "Subnormal speeds",
        "a body whose speed halves again and again; Demmel, Underflow and reliability (1984)",
        "squares underflow: energies of 1e-624 J",
        "solved as any other impact after scaling; the result is rounded to subnormal numbers",
        np.array([[2.0, 0.5], [0.5, 1.0]]), np.array([[1.0, 0.0]]), np.array([-3e-312, 1e-312]), 0.5,
    )  # fmt: skip


def light_direction() -> HardCase:
    """An elastic impact with v along M's lightest direction, κ(M) = 1e12 and random rows in the kinetic metric."""
    rng = np.random.default_rng(34)
    d = 6
    axes = np.linalg.qr(rng.normal(size=(d, d)))[0]
    mass = axes * np.logspace(0.0, -12.0, d) @ axes.T
    mass = 0.5 * (mass + mass.T)
    rows = rng.normal(size=(3, d)) @ np.linalg.cholesky(mass).T
    return HardCase(
        "Velocity along M's lightest direction, κ(M) = 1e12",
        "backward error of Cholesky's factor: Higham, Accuracy and Stability (2002), chapter 10",
        "Cholesky's backward error d ε κ(M) is as large as the energy's fifth digit",
        "no gain above 10 d ε √κ(M), thanks to the clamp",
        mass, rows, axes[:, -1], 1.0,
    )  # fmt: skip


def bar_with_unequal_restitution() -> HardCase:
    """The bar whose energy plain equalities raise from 0.5 J to 12.167 J."""
    mass, rows = np.diag([1.0, 1.0 / 12.0]), np.array([[1.0, 0.5], [1.0, 0.4]])
    return HardCase(
        "Bar struck at two points, e = (1, 0)",
        "docs/theory.md; the kind of gain of Kane and Levinson (1985)",
        "equalities with unequal e create energy: 0.5 J become 12.167 J",
        "Poisson's law by two LCPs is passive, contacts only push, and none approaches afterwards",
        mass, rows, np.array([-1.0, 0.0]), np.array([1.0, 0.0]), methods=("factored",),
    )  # fmt: skip


def wedged_peg() -> HardCase:
    """The six contacts of a peg that enters its hole askew; its sides have the slope 200 : 9999, with exact normals."""
    n, t = Fraction(200, 10001), Fraction(9999, 10001)
    half, reach = Fraction(1, 200), Fraction(21, 2000)
    points = [(x, -reach, Fraction(0), Fraction(1)) for x in (-half, half)]
    for y in (-reach, reach):
        points += [(-half, y, t, n), (half, y, -t, n)]
    exact = np.array([[nx, ny, x * ny - y * nx] for x, y, nx, ny in points], dtype=object)
    return HardCase(
        "A peg wedged in its hole",
        "paper section VII: at most six collisions at once, in a tight hole; numbers ours",
        "six rows of rank three; the normals of the sides are nearly perpendicular to the motion, and the sides pull",
        "stopped in all three coordinates at once",
        np.diag([2.0, 2.0, 0.005]), exact.astype(float), np.array([1e-4, -0.04, 1e-3]), 0.0,
        exact_jacobian=exact, methods=("factored", "gram_pinv", "damped", "svd"),
    )  # fmt: skip

"""Hard cases of linear algebra: dependent and nearly dependent rows, rank decisions,
conditioning."""

from __future__ import annotations

import numpy as np

from verification.hard_cases.case import Floats, HardCase


def thousand_copies() -> HardCase:
    """One contact reported a thousand times."""
    return HardCase(
        "1,000 copies of one contact",
        "collision detectors on flat faces",
        "the Delassus matrix has 1000 × 1000 entries and rank one; the impulses are not unique",
        "the outcome of a single contact, with every method that allows redundant rows",
        np.array([[2.0, 0.3, 0.1], [0.3, 1.0, 0.2], [0.1, 0.2, 0.5]]),
        np.tile([0.6, 0.8, -0.25], (1000, 1)),
        np.array([-1.0, -2.0, 0.5]),
        0.5,
        methods=("factored", "gram_pinv", "damped", "svd"),
    )


def contacts(count: int, name: str, why_hard: str, expected: str) -> HardCase:
    """Return an impact with integer rows of rank at most three; doubles represent them exactly."""
    rng = np.random.default_rng(10_000)
    rows = rng.integers(-2, 3, size=(count, 3)) @ np.array(
        [[1, 0, 2, -1], [0, 1, 1, 1], [1, 1, 0, 2]]
    )
    return HardCase(
        name,
        "meshes in contact, at the haptic rate",
        why_hard,
        expected,
        np.diag([1.0, 2.0, 3.0, 4.0]),
        rows.astype(float).reshape(count, 4),
        np.array([-1.0, -0.5, 0.25, 2.0]),
        0.5,
        methods=("factored", "gram_pinv", "gram_cholesky", "damped", "svd"),
    )


def printed_formula_gains() -> HardCase:
    """An elastic impact at rows that differ by 1e-4, with a mass matrix of condition number 1e6."""
    rng = np.random.default_rng(7)
    d = 6
    mass, _ = _mass(rng, d, 6.0)
    base = rng.normal(size=(2, d))
    rows = np.vstack(
        [base, base + 1e-4 * rng.normal(size=(2, d)), base + 1e-4 * rng.normal(size=(2, d))]
    )
    return HardCase(
        "Rows 1e-4 apart on κ(M) = 1e6, elastic",
        "number 6 of our errata of the paper (docs/theory.md); normal equations: Higham, Accuracy and Stability (2002)",
        "κ(W) is about 1e14 (1e8 from the rows, 1e6 from M), so its small singular values are noise",
        "no energy is gained. We expect the printed formula to fail, because it inverts noise",
        mass,
        rows,
        rng.normal(size=d),
        1.0,
    )


def _mass(rng: np.random.Generator, d: int, decades: float) -> tuple[Floats, Floats]:
    """Return M with eigenvalues over these decades, and its axes."""
    axes = np.linalg.qr(rng.normal(size=(d, d)))[0]
    mass = axes * np.logspace(0.0, -decades, d) @ axes.T
    return 0.5 * (mass + mass.T), axes


def hilbert_rows() -> HardCase:
    """An impact whose rows are those of the Hilbert matrix."""
    n = 8
    rows = 1.0 / (np.arange(n)[:, None] + np.arange(n) + 1.0)
    return HardCase(
        "Hilbert rows, n = 8",
        "Hilbert (1894); the classical rank decision",
        "the exact rank is 8, the condition number 1.5e10: singular values lie on both sides of any usual tolerance",
        "the restitution law holds and no energy is gained; the rank is not judged",
        np.eye(n),
        rows,
        np.array([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0]),
        0.5,
        well_posed=False,
    )


def kahan_rows() -> HardCase:
    """An impact with the rows of Kahan's matrix: pivots suggest rank n, but one singular value is
    far smaller."""
    n = 24
    c = 0.6
    s = np.sqrt(1.0 - c * c)
    rows = s ** np.arange(n)[:, None] * (np.eye(n) - c * np.triu(np.ones((n, n)), 1))
    return HardCase(
        "Kahan rows, n = 24",
        "Kahan, Numerical linear algebra (1966): rank revealed wrongly by pivoted factorizations",
        "the smallest singular value is far below every pivot",
        "the restitution law holds and no energy is gained",
        np.eye(n),
        rows,
        np.cos(np.arange(n)),
        0.8,
        well_posed=False,
    )


def light_direction() -> HardCase:
    """An elastic impact with v along M's lightest direction, κ(M) = 1e12 and random rows in the
    kinetic metric."""
    rng = np.random.default_rng(34)
    d = 6
    mass, axes = _mass(rng, d, 12.0)
    rows = rng.normal(size=(3, d)) @ np.linalg.cholesky(mass).T
    return HardCase(
        "Velocity along M's lightest direction, κ(M) = 1e12",
        "backward error of Cholesky's factor: Higham, Accuracy and Stability (2002), chapter 10",
        "the error of Cholesky's factor, up to d ε κ(M) = 1e-3, here changes the fifth digit of the energy",
        "no energy is gained with the clamp; other methods may gain up to 10 d ε √κ(M) of the energy",
        mass,
        rows,
        axes[:, -1],
        1.0,
    )

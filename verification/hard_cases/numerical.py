"""Hard cases of linear algebra: dependent and nearly dependent rows, rank decisions, conditioning."""

from __future__ import annotations

import numpy as np

from verification.hard_cases.case import HardCase


def thousand_copies() -> HardCase:
    """One contact reported a thousand times."""
    return HardCase(
        "1,000 copies of one contact", "collision detectors on flat faces",
        "the Delassus matrix is 1000 × 1000 of rank one; p is not unique",
        "the outcome of a single contact, with every method that allows redundant rows",
        np.array([[2.0, 0.3, 0.1], [0.3, 1.0, 0.2], [0.1, 0.2, 0.5]]), np.tile([0.6, 0.8, -0.25], (1000, 1)),
        np.array([-1.0, -2.0, 0.5]), 0.5, methods=("factored", "gram_pinv", "damped", "svd"),
    )  # fmt: skip


def no_contact() -> HardCase:
    """An impact without contacts, c = 0."""
    return _contacts(0, "No contact at all", "empty matrices, which libraries treat differently",
                     "nothing happens, and no error")  # fmt: skip


def one_contact() -> HardCase:
    """An impact at one contact, c = 1."""
    return _contacts(1, "One contact", "it is not: every method must solve this case", "(19) to rounding")


def hundred_contacts() -> HardCase:
    """An impact at 100 contacts of rank three."""
    return _contacts(100, "100 contacts of rank three", "97 redundant rows, each exact in doubles",
                     "exact rank, and the velocity that three contacts give")  # fmt: skip


def ten_thousand_contacts() -> HardCase:
    """An impact at 10,000 contacts of rank three."""
    return _contacts(10_000, "10,000 contacts of rank three", "time and memory: the Delassus matrix has 1e8 entries",
                     "linear time and exact rank; "
                     "methods that form the Delassus matrix exceed the limit on time")  # fmt: skip


def _contacts(count: int, name: str, why_hard: str, expected: str) -> HardCase:
    """Return an impact with integer rows of rank at most three; doubles represent them exactly."""
    rng = np.random.default_rng(10_000)
    rows = rng.integers(-2, 3, size=(count, 3)) @ np.array([[1, 0, 2, -1], [0, 1, 1, 1], [1, 1, 0, 2]])
    return HardCase(
        name,
        "meshes in contact, at the haptic rate",
        why_hard, expected, np.diag([1.0, 2.0, 3.0, 4.0]), rows.astype(float).reshape(count, 4),
        np.array([-1.0, -0.5, 0.25, 2.0]), 0.5,
        methods=("factored", "gram_pinv", "gram_cholesky", "damped", "svd"),
    )  # fmt: skip


def nearly_parallel_normals() -> HardCase:
    """An elastic impact at two normals that differ by 1e-6, on which the printed formula gains energy."""
    return HardCase(
        "Nearly parallel normals, 1e-6 apart",
        "a corner of two almost coplanar faces; normal equations: Higham (2002), chapter 20; erratum 6",
        "forming J M⁻¹ Jᵀ squares the condition number to 1e12",
        "rank 2, elastic, no gain",
        np.diag([1.0, 2.0, 3.0]), np.array([[1.0, 0.5, 0.25], [1.0, 0.5 + 1e-6, 0.25]]),
        np.array([-1.0, 2.0, 1.0]), 1.0,
    )  # fmt: skip


def printed_formula_gains() -> HardCase:
    """An elastic impact at rows that differ by 1e-4, with a mass matrix of condition number 1e6."""
    rng = np.random.default_rng(7)
    d = 6
    axes = np.linalg.qr(rng.normal(size=(d, d)))[0]
    mass = axes * np.logspace(0.0, -6.0, d) @ axes.T
    base = rng.normal(size=(2, d))
    rows = np.vstack([base, base + 1e-4 * rng.normal(size=(2, d)), base + 1e-4 * rng.normal(size=(2, d))])
    return HardCase(
        "Rows 1e-4 apart on κ(M) = 1e6, elastic",
        "erratum 6 of the paper; normal equations: Higham, Accuracy and Stability (2002)",
        "W has condition 1e8 from the rows and 1e6 from M: its small singular values are noise",
        "no gain; the printed formula inverts noise",
        0.5 * (mass + mass.T), rows, rng.normal(size=d), 1.0,
    )  # fmt: skip


def hilbert_rows() -> HardCase:
    """An impact whose rows are those of the Hilbert matrix."""
    n = 8
    rows = 1.0 / (np.arange(n)[:, None] + np.arange(n) + 1.0)
    return HardCase(
        "Hilbert rows, n = 8", "Hilbert (1894); the classical rank decision",
        "full rank exactly, condition 1.5e10: singular values on both sides of any tolerance",
        "restitution met and no energy gain; how many of the smallest directions count is a choice",
        np.eye(n), rows, np.array([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0]), 0.5, well_posed=False,
    )  # fmt: skip


def kahan_rows() -> HardCase:
    """An impact with the rows of Kahan's matrix: pivots suggest rank n, but one singular value is far smaller."""
    n, c = 24, 0.6
    s = np.sqrt(1.0 - c * c)
    rows = s ** np.arange(n)[:, None] * (np.eye(n) - c * np.triu(np.ones((n, n)), 1))
    return HardCase(
        "Kahan rows, n = 24",
        "Kahan, Numerical linear algebra (1966): rank revealed wrongly by pivoted factorizations",
        "smallest singular value far below every pivot",
        "restitution met and no energy gain",
        np.eye(n), rows, np.cos(np.arange(n)), 0.8, well_posed=False,
    )  # fmt: skip

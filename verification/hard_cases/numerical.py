"""Impacts that are hard for linear algebra: dependent and nearly dependent rows, rank decisions,
conditioning. Each function returns the numbers of a case of impacts.yaml."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from verification.impacts import Floats


class Numbers(NamedTuple):
    """The numbers of an impact."""

    M: Floats  # (d, d), or its diagonal (d,)
    J: Floats  # (c, d) normal rows
    v: Floats  # (d,) velocity before
    e: float


def copies(count: int) -> Numbers:
    """One contact reported many times."""
    return Numbers(
        M=np.array([[2.0, 0.3, 0.1], [0.3, 1.0, 0.2], [0.1, 0.2, 0.5]]),
        J=np.tile([0.6, 0.8, -0.25], (count, 1)),
        v=np.array([-1.0, -2.0, 0.5]),
        e=0.5,
    )


def integer_rows(count: int) -> Numbers:
    """Integer rows of rank at most three; doubles represent them exactly."""
    rng = np.random.default_rng(10_000)
    rows = rng.integers(-2, 3, size=(count, 3)) @ np.array(
        [[1, 0, 2, -1], [0, 1, 1, 1], [1, 1, 0, 2]]
    )
    return Numbers(
        M=np.array([1.0, 2.0, 3.0, 4.0]),
        J=rows.astype(float).reshape(count, 4),
        v=np.array([-1.0, -0.5, 0.25, 2.0]),
        e=0.5,
    )


def rows_apart() -> Numbers:
    """An elastic impact at rows that differ by 1e-4, with a mass matrix of condition number 1e6."""
    rng = np.random.default_rng(7)
    d = 6
    mass, _ = _mass(rng, d, 6.0)
    base = rng.normal(size=(2, d))
    rows = np.vstack(
        [base, base + 1e-4 * rng.normal(size=(2, d)), base + 1e-4 * rng.normal(size=(2, d))]
    )
    return Numbers(M=mass, J=rows, v=rng.normal(size=d), e=1.0)


def _mass(rng: np.random.Generator, d: int, decades: float) -> tuple[Floats, Floats]:
    """Return M with eigenvalues over these decades, and its axes."""
    axes = np.linalg.qr(rng.normal(size=(d, d)))[0]
    mass = axes * np.logspace(0.0, -decades, d) @ axes.T
    return 0.5 * (mass + mass.T), axes


def hilbert_rows(n: int) -> Numbers:
    """The rows of the Hilbert matrix."""
    rows = 1.0 / (np.arange(n)[:, None] + np.arange(n) + 1.0)
    return Numbers(M=np.ones(n), J=rows, v=(-1.0) ** np.arange(1, n + 1), e=0.5)


def kahan_rows(n: int) -> Numbers:
    """The rows of Kahan's matrix: pivots suggest rank n, but one singular value is far smaller."""
    c = 0.6
    s = np.sqrt(1.0 - c * c)
    rows = s ** np.arange(n)[:, None] * (np.eye(n) - c * np.triu(np.ones((n, n)), 1))
    return Numbers(M=np.ones(n), J=rows, v=np.cos(np.arange(n)), e=0.8)


def light_direction() -> Numbers:
    """An elastic impact with v along M's lightest direction, κ(M) = 1e12 and random rows in the
    kinetic metric."""
    rng = np.random.default_rng(34)
    d = 6
    mass, axes = _mass(rng, d, 12.0)
    rows = rng.normal(size=(3, d)) @ np.linalg.cholesky(mass).T
    return Numbers(M=mass, J=rows, v=axes[:, -1], e=1.0)

"""Random impacts for the algebraic claims (C01 to C09): mass matrices of given condition, rows of given rank.

Rows are small whole numbers, and redundant rows are whole-number combinations of independent ones: rank and
redundancy are then exact in doubles, and the same instance can be solved in rationals.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_WHOLE = 5  # entries of rows lie in -5..5


class Instance(NamedTuple):
    """One impact: M (d, d), J (c, d), v (d,); the first `rank` rows of J are independent, the rest depend on them."""

    mass_matrix: Floats
    contact_jacobian: Floats
    velocity: Floats
    rank: int


class Family(NamedTuple):
    """What the instances of a batch have in common."""

    coordinates: int
    contacts: int
    rank: int
    condition_number: float


def draw(family: Family, count: int, seed: int) -> Iterator[Instance]:
    """Yield `count` instances; the same seed gives the same ones."""
    rng = np.random.default_rng([seed, *(round(number) for number in family)])
    for _ in range(count):
        mass = random_mass_matrix(rng, family.coordinates, family.condition_number)
        velocity = rng.standard_normal(family.coordinates)
        yield Instance(mass, random_rows(rng, family), velocity, family.rank)


def approaching(instance: Instance) -> Instance:
    """The instance with its first row's sign chosen so that this contact approaches."""
    jacobian = instance.contact_jacobian.copy()
    if jacobian[0] @ instance.velocity > 0.0:
        jacobian[0] *= -1.0
    return instance._replace(contact_jacobian=jacobian)


def whole_numbers(family: Family, count: int, seed: int) -> Iterator[Instance]:
    """Yield instances in whole numbers (as doubles): M = B Bᵀ + 1, so that rationals stay short."""
    rng = np.random.default_rng([seed, *(round(number) for number in family), 1])
    d = family.coordinates
    for _ in range(count):
        factor = rng.integers(-3, 4, (d, d)).astype(np.float64)
        velocity = rng.integers(-9, 10, d).astype(np.float64)
        velocity[0] += not velocity.any()
        yield Instance(factor @ factor.T + np.eye(d), random_rows(rng, family), velocity, family.rank)


def random_mass_matrix(rng: np.random.Generator, size: int, condition_number: float) -> Floats:
    """Return a symmetric positive definite matrix with log-spread eigenvalues between 1/sqrt(κ) and sqrt(κ)."""
    axes, _ = np.linalg.qr(rng.standard_normal((size, size)))
    half = 0.5 * np.log10(condition_number)
    eigenvalues = 10.0 ** np.linspace(-half, half, size) if size > 1 else np.ones(1)
    mass = (axes * eigenvalues) @ axes.T
    return 0.5 * (mass + mass.T)


def random_rows(rng: np.random.Generator, family: Family) -> Floats:
    """Return (c, d) whole-number rows of exact rank `family.rank`, the first `rank` of them independent."""
    rank, spare = family.rank, family.contacts - family.rank
    while True:
        basis = rng.integers(-_WHOLE, _WHOLE + 1, (rank, family.coordinates)).astype(np.float64)
        if np.linalg.matrix_rank(basis) == rank:
            break
    mixing = rng.integers(-2, 3, (spare, rank)).astype(np.float64)
    return np.vstack([basis, mixing @ basis])

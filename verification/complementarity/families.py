"""Random impacts on which the laws are compared, in families of known geometry.

The rows of a case are the contacts that approach (gamma_minus < 0), as in the engine. Contacts that
touch without approaching are stored separately, to see whether they approach after the impact. The
geometry is set in the kinetic metric, because agreement depends on it there: with M = L Lᵀ, rows A
= J L⁻ᵀ and u = Lᵀv, the impulse at one of two contacts can pull only if the cosine of their rows is
positive.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from reference import Floats
from verification.impacts import ImpactCase

# (rng, redundancy) -> (M, J, v)
Draw = Callable[[np.random.Generator, int], tuple[Floats, Floats, Floats]]


def random_cases(
    count: int,
    restitutions: Sequence[float] = (0.0, 0.5, 1.0),
    families: Sequence[str] = (),
    seed: int = 4,
) -> Iterator[ImpactCase]:
    """Yield `count` impacts for each family, restitution and redundancy; the same seed gives the
    same impacts."""
    for name in families or FAMILIES:
        draw, redundancies = FAMILIES[name]
        for redundancy in redundancies:
            rng = np.random.default_rng([seed, list(FAMILIES).index(name), redundancy])
            drawn = [draw(rng, redundancy) for _ in range(count)]
            for e in restitutions:
                for mass, rows, velocity in drawn:
                    closing = rows @ velocity < 0.0
                    yield ImpactCase(
                        mass, rows[closing], velocity, e, name, touching=rows[~closing]
                    )


_COORDINATES = 4  # of the impacts at two contacts


def two_contacts(cosine: float, speed_ratio: float, rng: np.random.Generator) -> ImpactCase:
    """Return an impact at two contacts whose unit rows have this cosine in the kinetic metric.

    The contacts approach at speeds 1 and `speed_ratio`. The lengths of the rows, the mass matrix
    and the velocity components orthogonal to both rows are random.
    """
    gram = np.array([[1.0, cosine], [cosine, 1.0]])
    mass, rows, velocity = _of_gram(rng, _COORDINATES, gram, [1.0, speed_ratio])
    lengths = np.exp(rng.normal(size=(2, 1)))
    return ImpactCase(mass, lengths * rows, velocity, 0.0, "two contacts")


def _of_gram(
    rng: np.random.Generator, coordinates: int, gram: Floats, speeds: ArrayLike
) -> tuple[Floats, Floats, Floats]:
    """Return M, rows with these scalar products in the kinetic metric, and v at which they approach
    at these speeds; all else is random."""
    c = len(gram)
    frame = np.linalg.qr(rng.normal(size=(coordinates, coordinates)))[0]
    shape = np.linalg.cholesky(gram)
    along = np.linalg.solve(shape, -np.asarray(speeds))
    u = frame.T @ np.concatenate([along, rng.normal(size=coordinates - c)])
    lower = np.linalg.cholesky(random_mass_matrix(rng, coordinates))
    return lower @ lower.T, shape @ frame[:c] @ lower.T, np.linalg.solve(lower.T, u)


def random_mass_matrix(rng: np.random.Generator, coordinates: int) -> Floats:
    """Return a symmetric positive definite matrix (d, d) with eigenvalues between 0.1 and 10."""
    axes = np.linalg.qr(rng.normal(size=(coordinates, coordinates)))[0]
    return np.asarray((axes * 10.0 ** rng.uniform(-1.0, 1.0, coordinates)) @ axes.T, np.float64)


def _approaching(rows: Floats, velocity: Floats) -> Floats:
    """Return the rows with signs chosen so that every contact approaches."""
    return np.where(rows @ velocity > 0.0, -1.0, 1.0)[:, None] * rows


def _one_contact(rng: np.random.Generator, redundancy: int) -> tuple[Floats, Floats, Floats]:
    """A single contact, also given several times."""
    d = int(rng.integers(1, 13))
    velocity = rng.normal(size=d)
    row = rng.normal(size=(1, d))
    row = _approaching(row, velocity)
    sizes = (1.0, *rng.uniform(0.5, 2.0, redundancy))
    return random_mass_matrix(rng, d), np.vstack([row * size for size in sizes]), velocity


def _cradle(rng: np.random.Generator, redundancy: int) -> tuple[Floats, Floats, Floats]:
    """Balls in a row whose velocities decrease from left to right, so that all neighbours approach
    each other."""
    n = int(rng.integers(3, 9))
    rows = np.diff(np.eye(n), axis=0)
    return np.diag(np.exp(rng.normal(size=n))), rows, -np.cumsum(rng.uniform(0.1, 1.0, n))


def _obtuse(rng: np.random.Generator, redundancy: int) -> tuple[Floats, Floats, Floats]:
    """Rows with cosines <= 0 in the kinetic metric, so that none of IAPB's impulses pulls."""
    d = int(rng.integers(3, 9))
    c = int(rng.integers(2, 4))
    gram = np.eye(c) - rng.uniform(0.0, 0.9 / (c - 1), size=(c, c)) * (1.0 - np.eye(c))
    return _of_gram(rng, d, np.minimum(gram, gram.T), rng.uniform(0.05, 1.0, c))


def _face_on_floor(rng: np.random.Generator, redundancy: int) -> tuple[Floats, Floats, Floats]:
    """A planar box lands with some rotation on 2 + redundancy points of its lower face."""
    m = np.exp(rng.normal())
    half = rng.uniform(0.2, 2.0)
    inertia = m * (half**2 + rng.uniform(0.1, 1.0) ** 2) / 3.0
    points = np.sort(rng.uniform(-half, half, 2 + redundancy))
    rows = np.column_stack([np.zeros_like(points), np.ones_like(points), points])
    turn = rng.uniform(-0.95, 0.95) / np.abs(points).max()
    return np.diag([m, m, inertia]), rows, np.array([rng.normal(), -1.0, turn])


def _corner(rng: np.random.Generator, redundancy: int) -> tuple[Floats, Floats, Floats]:
    """A planar box strikes the floor at two points and a wall at 1 + redundancy points at once."""
    mass, floor, velocity = _face_on_floor(rng, 0)
    height = rng.uniform(-1.0, 1.0, 1 + redundancy) * np.abs(floor[:, 2]).max()
    wall = np.column_stack([-np.ones_like(height), np.zeros_like(height), height])
    velocity[0] = rng.uniform(0.1, 1.0) + np.abs(height * velocity[2]).max()
    return mass, np.vstack([floor, wall]), velocity


def _hole(rng: np.random.Generator, redundancy: int) -> tuple[Floats, Floats, Floats]:
    """A peg in a hole with a taper of 1:100: its end and both sides approach the hole at once."""
    length = rng.uniform(0.5, 3.0)
    width = 1.0
    slope = 0.01
    n = np.array([slope, 1.0]) / np.hypot(slope, 1.0)
    points = [((x, -length), (0.0, 1.0)) for x in (-width, width)]
    for y in np.linspace(-length, length, 1 + redundancy):
        points += [((-width, y), (n[1], n[0])), ((width, y), (-n[1], n[0]))]
    rows = np.array([[nx, ny, x * ny - y * nx] for (x, y), (nx, ny) in points])
    m = np.exp(rng.normal())
    spin = rng.uniform(-1.0, 1.0) * 0.9 * slope / np.abs(rows[:, 2]).max()
    return np.diag([m, m, m * (length**2 + width**2) / 3.0]), rows, np.array([0.0, -1.0, spin])


def _random_rows(rng: np.random.Generator, redundancy: int) -> tuple[Floats, Floats, Floats]:
    """Random rows and a random mass matrix; the redundant rows are sums of the others with positive
    weights."""
    d = int(rng.integers(3, 13))
    independent = rng.normal(size=(int(rng.integers(2, d)), d))
    velocity = rng.normal(size=d)
    independent = _approaching(independent, velocity)
    more = rng.uniform(0.0, 1.0, size=(redundancy, len(independent))) @ independent
    return random_mass_matrix(rng, d), np.vstack([independent, more]), velocity


def _rows_that_touch(rng: np.random.Generator, redundancy: int) -> tuple[Floats, Floats, Floats]:
    """Like `_random_rows`, with one more contact that touches and slowly separates."""
    mass, rows, velocity = _random_rows(rng, redundancy)
    row = rng.normal(size=len(velocity))
    row -= velocity * ((row @ velocity - rng.uniform(0.0, 0.1)) / (velocity @ velocity))
    return mass, np.vstack([rows, row]), velocity


# name -> the draw, and the possible numbers of redundant rows
FAMILIES: dict[str, tuple[Draw, tuple[int, ...]]] = {
    "one contact": (_one_contact, (0, 1, 4)),
    "cradle": (_cradle, (0,)),
    "obtuse normals": (_obtuse, (0,)),
    "face on floor": (_face_on_floor, (0, 1, 2, 6)),
    "corner": (_corner, (0, 1, 2, 6)),
    "tight hole": (_hole, (1, 3, 7)),
    "random rows": (_random_rows, (0, 1, 4)),
    "with a neighbour": (_rows_that_touch, (0, 4)),
}

"""One impact, the one type of it, and every generator of impacts: a generator and a seed always give the same ones."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]

# Singular values of the unit-scaled rows of A in this gap are neither clearly rounding nor clearly motion: a sound
# resolver may take them for either, so laws that compare velocities do not judge such impacts.
ROUNDING_BELOW, MOTION_ABOVE = 1e-13, 1e-5
RANK_CUT = 1e-9  # anywhere in the gap


@dataclass(frozen=True)
class ImpactCase:
    """M (d, d), J (c, d), v (d,) and scalar e; `translations` (k, d) are motions z with J z = 0 exactly.

    `unequal` (c,), each in [0, 1], takes the place of e where it is given.
    """

    mass_matrix: Floats
    contact_jacobian: Floats
    velocity: Floats
    restitution: float
    family: str = ""
    translations: Floats | None = field(default=None)
    unequal: Floats | None = field(default=None)

    @property
    def coordinates(self) -> int:
        """d."""
        return len(self.velocity)

    @property
    def contacts(self) -> int:
        """c."""
        return len(self.contact_jacobian)

    def given_restitution(self) -> Any:
        """What a resolver gets: the scalar e, or a copy of the unequal ones."""
        return self.restitution if self.unequal is None else self.unequal.copy()

    @cached_property
    def condition(self) -> float:
        """κ(M)."""
        values = np.linalg.eigvalsh(self.mass_matrix)
        return float(values[-1] / values[0]) if values[0] > 0.0 else np.inf

    @cached_property
    def lower(self) -> Floats:
        """L with M = L Lᵀ."""
        return np.linalg.cholesky(self.mass_matrix)

    @cached_property
    def rows(self) -> Floats:
        """A = J L⁻ᵀ (c, d)."""
        return np.linalg.solve(self.lower, self.contact_jacobian.T).T

    @cached_property
    def unit_rows(self) -> Floats:
        """Rows of A scaled to unit length; zero rows stay."""
        length = np.linalg.norm(self.rows, axis=1, keepdims=True)
        return np.divide(self.rows, length, out=np.zeros_like(self.rows), where=length > 0.0)

    @cached_property
    def _svd(self) -> tuple[Floats, Floats]:
        _, values, right = np.linalg.svd(self.unit_rows, full_matrices=False)
        return values, right

    @cached_property
    def is_separated(self) -> bool:
        """No singular value of the unit rows lies between rounding and motion: the rank is beyond doubt."""
        values = self._svd[0]
        return not np.any((values > ROUNDING_BELOW) & (values < MOTION_ABOVE))

    @cached_property
    def row_space(self) -> Floats:
        """Orthonormal basis (rank, d) of the row space of A."""
        values, right = self._svd
        return right[values > RANK_CUT]

    @cached_property
    def smallest_motion(self) -> float:
        """Smallest singular value of the unit rows that counts as motion; 1 without rows."""
        values = self._svd[0]
        return float(np.min(values[values > RANK_CUT], initial=1.0))

    @cached_property
    def largest_noise(self) -> float:
        """Largest singular value of the unit rows that counts as rounding; 0 where there is none."""
        values = self._svd[0]
        return float(np.max(values[values <= ROUNDING_BELOW], initial=0.0))

    @cached_property
    def speed(self) -> float:
        """|u| = √(vᵀMv)."""
        return float(np.linalg.norm(self.lower.T @ self.velocity))

    def distance(self, one: Floats, other: Floats) -> float:
        """Distance of two velocities in the kinetic metric, relative to |u|."""
        length = float(np.linalg.norm(self.lower.T @ (one - other)))
        return length / self.speed if self.speed > 0.0 else (0.0 if length == 0.0 else np.inf)

    @cached_property
    def _answers(self) -> dict[int, Any]:
        """What resolvers gave for this very case, by their identity; kept with them, so that it stays theirs."""
        return {}


MASS_KINDS = ("spectral", "graded", "arrow", "diagonal", "identity")
# Nearly dependent rows come three times: most bugs of rank and conditioning live there.
_NEAR = ("nearly dependent",) * 3
ROW_KINDS = ("generic", "kinetic", "dependent", "scaled", "copies", "zeros", "none", "cradle", *_NEAR)
VELOCITY_KINDS = ("normal", "kinetic normal", "light direction", "grazing", "unseen")
RESTITUTIONS = (-1.0, 0.0, 0.5, 1.0, 1.0)
# W = J M⁻¹ Jᵀ of rows this close has singular values down to closeness²: an inverse of W errs by ε / closeness², 1e-6
# to 1e-3, and numpy's cutoff of 1e-15 keeps them. Half of the errors are gains, whichever BLAS rounds.
ADVERSE, ADVERSE_CLOSENESS = 24, (5.0, 6.5)


def draw_case(rng: np.random.Generator, largest_condition: float = 1e8, largest_size: int = 10) -> ImpactCase:
    """Return one random impact with κ(M) up to `largest_condition`."""
    rows_kind = _one_of(rng, ROW_KINDS)
    d = int(rng.integers(1, largest_size + 1))
    condition = 10.0 ** rng.uniform(0.0, np.log10(largest_condition))
    mass_kind = "diagonal" if rows_kind == "cradle" else _one_of(rng, MASS_KINDS)
    mass = draw_mass_matrix(rng, mass_kind, d, condition)
    rows, closeness = draw_rows(rng, rows_kind, mass)
    velocity_kind = _one_of(rng, VELOCITY_KINDS)
    v = draw_velocity(rng, velocity_kind, mass, rows)
    e = float(rng.uniform(-1.0, 1.0)) if rng.random() < 0.4 else float(rng.choice(RESTITUTIONS))
    translations = np.ones((1, d)) if rows_kind == "cradle" else None
    name = f"{mass_kind} mass, {rows_kind} rows{closeness}, {velocity_kind} velocity"
    return ImpactCase(mass, rows, v, e, name, translations)


def adverse_cases(rng: np.random.Generator) -> Iterator[ImpactCase]:
    """Yield the elastic impacts that break a formula through the inverse of W under every BLAS.

    Nothing here passes through BLAS: a seed gives the same bits on every processor.
    """
    for k in range(ADVERSE):
        d = 2 + k % 3
        closeness = 10.0 ** -rng.uniform(*ADVERSE_CLOSENESS)
        rows = rng.normal(size=d) + closeness * rng.normal(size=(d, d))
        mass = np.diag(rng.uniform(0.1, 1.0, size=d))
        yield ImpactCase(mass, rows, rng.normal(size=d), 1.0, f"diagonal mass, {d} rows within {closeness:.0e}")


def _one_of(rng: np.random.Generator, kinds: tuple[str, ...]) -> str:
    """As `rng.choice`, which first makes an array of them."""
    return kinds[int(rng.integers(0, len(kinds)))]


def with_unequal_restitution(rng: np.random.Generator, case: ImpactCase) -> ImpactCase:
    """The case with a restitution in [0, 1] per row: 0 and 1 side by side, or anything."""
    extremes = rng.random() < 0.5
    e = rng.choice([0.0, 1.0], size=case.contacts) if extremes else rng.uniform(0.0, 1.0, size=case.contacts)
    return replace(case, family=case.family + ", unequal e", unequal=e)


def draw_mass_matrix(rng: np.random.Generator, kind: str, d: int, condition: float) -> Floats:
    """Return a symmetric positive definite M (d, d) whose κ is of the order of `condition`."""
    spectrum = condition ** -np.sort(rng.uniform(0.0, 1.0, size=d))
    spectrum[0], spectrum[-1] = 1.0, (1.0 / condition if d > 1 else 1.0)
    if kind == "identity":
        return np.eye(d)
    if kind == "diagonal":
        return np.diag(rng.permutation(spectrum))
    if kind == "graded":  # a well conditioned matrix in units that differ
        s = np.sqrt(rng.permutation(spectrum))
        inner = draw_mass_matrix(rng, "spectral", d, 10.0)
        return s[:, None] * inner * s
    if kind == "arrow":  # one body coupled to many
        mass = np.diag(spectrum)
        mass[0, 1:] = mass[1:, 0] = 0.9 * np.sqrt(spectrum[1:] / d) * rng.choice([-1.0, 1.0], size=d - 1)
        return mass
    basis = np.linalg.qr(rng.normal(size=(d, d)))[0]
    mass = basis * spectrum @ basis.T
    return 0.5 * (mass + mass.T)


def draw_rows(rng: np.random.Generator, kind: str, mass: Floats) -> tuple[Floats, str]:
    """Return J (c, d) of the kind, and a word on how close to dependent its rows are."""
    d = len(mass)
    c = int(rng.integers(1, 2 * d + 2))
    generic = rng.normal(size=(c, d))
    generic /= np.linalg.norm(generic, axis=1, keepdims=True)
    rank = int(rng.integers(1, min(c, d) + 1))
    if kind == "none":
        return np.zeros((0, d)), ""
    if kind == "kinetic":  # random in the kinetic metric, so that light and heavy directions mix
        return generic @ np.linalg.cholesky(mass).T, ""
    if kind == "dependent":
        return rng.integers(-2, 3, size=(c, rank)) @ generic[:rank], ""
    if kind == "nearly dependent":
        closeness = 10.0 ** -rng.uniform(*((3.0, 9.0) if rng.random() < 0.5 else (1.0, 16.0)))
        return generic[rng.integers(0, rank, size=c)] + closeness * generic, f" ({closeness:.0e})"
    if kind == "scaled":
        return 10.0 ** rng.uniform(-8.0, 8.0, size=(c, 1)) * generic, ""
    if kind == "copies":
        return np.tile(generic[:rank], (int(rng.integers(2, 6)), 1)), ""
    if kind == "zeros":
        return generic * (rng.random((c, 1)) < 0.5), ""
    if kind == "cradle":
        return cradle_rows(d), ""
    return generic, ""


def cradle_rows(d: int) -> Floats:
    """Bodies in a line, each against the next: rows with +1 and −1."""
    return np.eye(d)[: d - 1] - np.eye(d, k=1)[: d - 1]


def draw_velocity(rng: np.random.Generator, kind: str, mass: Floats, rows: Floats) -> Floats:
    """Return v (d,): normal, with Lᵀv normal, along M's lightest direction, barely seen or unseen by the rows."""
    d = len(mass)
    v = rng.normal(size=d)
    lower = np.linalg.cholesky(mass)
    if kind == "kinetic normal":
        return np.linalg.solve(lower.T, v)
    if kind == "light direction":
        return np.linalg.eigh(mass)[1][:, 0]
    if kind in ("grazing", "unseen") and len(rows):
        right = np.linalg.svd(rows)[2]
        unseen = right[min(len(rows), d - 1) :]
        along = unseen.T @ (unseen @ v)
        return along + (1e-9 * v if kind == "grazing" else 0.0)
    return v

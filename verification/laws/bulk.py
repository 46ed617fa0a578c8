"""Many random impacts of one method: relative energy gain compared with 10·d·ε·√κ(M), and the restitution residual.

The families are adverse: mass matrices of known spectrum with log-uniform κ, and rows that are random in the metric of
the coordinates or of the kinetic energy (the latter mix light and heavy motion, so Cholesky's error matters).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb import resolve_impact
from reference.exact import bulk_energy_gain
from reference.one_thread import one_thread
from verification.impacts import ImpactCase
from verification.laws.impact_laws import restitution_residual
from verification.methods import COMPARED

Floats = NDArray[Any]

VELOCITY_FAMILIES = ("v ~ N(0, I)", "Lᵀv ~ N(0, I)")
ROW_FAMILIES = ("J ~ N(0, I)", "J L⁻ᵀ ~ N(0, I)")
LARGEST_COORDINATES, LARGEST_CONTACTS = 30, 100
EPS = float(np.finfo(float).eps)
_BATCH = 200  # impacts of one d drawn together


@dataclass(frozen=True)
class BulkImpacts:
    """All impacts of a bulk study; all arrays have shape (n,).

    Attributes
    ----------
    method, clamp, seed, seconds : settings of the study, and the time inside the resolver [s].
    coordinates, contacts, rank : d, c, and the rank that the resolver used.
    condition : κ(M).  restitution : e.
    velocity_family, row_family : indices into VELOCITY_FAMILIES and ROW_FAMILIES.
    gain : (KE⁺ − KE⁻)/KE⁻ in double-double.  gain_error : error bound of `gain`.
    residual : max |Jᵢv⁺ + e Jᵢv⁻| / (‖Aᵢ‖ |u|).
    """

    method: str
    clamp: bool | None
    seed: int
    seconds: float
    coordinates: Floats
    contacts: Floats
    rank: Floats
    condition: Floats
    restitution: Floats
    velocity_family: Floats
    row_family: Floats
    gain: Floats
    gain_error: Floats
    residual: Floats

    @property
    def bound(self) -> Floats:
        """10·d·ε·√κ(M)."""
        return 10.0 * self.coordinates * EPS * np.sqrt(self.condition)

    @property
    def cholesky_bound(self) -> Floats:
        """d·ε·κ(M): bound of the gain from a Cholesky factor without the clamp."""
        return self.coordinates * EPS * self.condition

    @property
    def worst_ratio(self) -> float:
        """Largest gain / bound; the bound holds if this is at most 1."""
        return float(np.max(self.gain / self.bound))

    @property
    def above_bound(self) -> int:
        """Number of impacts whose gain exceeds the bound."""
        return int(np.sum(self.gain > self.bound))

    def by_condition(self) -> tuple[BulkRow, ...]:
        """One row per decade of κ(M)."""
        decade = np.floor(np.log10(self.condition) + 1e-9).astype(int)
        return tuple(self._row(int(k), decade == k) for k in np.unique(decade))

    def by_family(self) -> tuple[tuple[str, str, BulkRow], ...]:
        """One row per pair of velocity family and row family."""
        return tuple(
            (velocity, rows, self._row(-1, (self.velocity_family == i) & (self.row_family == j)))
            for i, velocity in enumerate(VELOCITY_FAMILIES)
            for j, rows in enumerate(ROW_FAMILIES)
        )

    def _row(self, decade: int, chosen: Floats) -> BulkRow:
        ratio = self.gain[chosen] / self.bound[chosen]
        return BulkRow(
            decade,
            int(np.sum(chosen)),
            float(np.max(self.gain[chosen], initial=-np.inf)),
            float(np.max(ratio, initial=-np.inf)),
            int(np.sum(ratio > 1.0)),
            float(np.max(self.gain[chosen] / self.cholesky_bound[chosen], initial=-np.inf)),
            float(np.median(self.residual[chosen])) if np.any(chosen) else np.nan,
            float(np.max(self.residual[chosen], initial=0.0)),
        )


@dataclass(frozen=True)
class BulkRow:
    """Summary of the impacts with κ(M) in [10^decade, 10^(decade + 1)); decade −1 stands for any κ(M)."""

    decade: int
    impacts: int
    worst_gain: float
    worst_gain_over_bound: float
    above_bound: int
    worst_gain_over_cholesky_bound: float
    median_residual: float
    worst_residual: float


class _Batch(NamedTuple):
    """Impacts of one d, and the family indices of each impact."""

    cases: list[ImpactCase]
    velocity_family: Floats
    row_family: Floats


def bulk_impacts(
    impacts: int = 2000,
    seed: int = 0,
    method: str = "factored",
    clamp: bool | None = None,
    largest_condition: float = 1e12,
    progress: Callable[[int, int], None] | None = None,
) -> BulkImpacts:
    """Resolve `impacts` random impacts (d 1…30, c 0…100, rank deficient, e in [−1, 1]) and measure each.

    Parameters
    ----------
    impacts, seed : number of impacts, and seed of the random numbers.
    method, clamp : "factored", with or without the clamp of `iapb.resolve_impact`, or a name of `COMPARED`.
    largest_condition : κ(M) is log-uniform up to it.
    progress : called with (done, impacts) after each batch.

    Returns
    -------
    BulkImpacts
        one value per impact: sizes, κ(M), relative energy gain, its bound, and more.
    """
    columns: dict[str, list[Floats]] = {}
    seconds, done = 0.0, 0
    with one_thread():
        for batch in _batches(np.random.default_rng(seed), impacts, largest_condition):
            started = time.perf_counter()
            v_plus, rank = _resolve(batch, method, clamp)
            seconds += time.perf_counter() - started
            for name, values in _measure(batch, v_plus, rank).items():
                columns.setdefault(name, []).append(values)
            done += len(rank)
            if progress is not None:
                progress(done, impacts)
    return BulkImpacts(method, clamp, seed, seconds, **{name: np.concatenate(x) for name, x in columns.items()})


def _resolve(batch: _Batch, method: str, clamp: bool | None) -> tuple[Floats, Floats]:
    """v⁺ (n, d) and rank (n,), NaN if the method does not say."""
    if method != "factored":
        velocities = [COMPARED[method](*case.arrays, case.restitution) for case in batch.cases]
        return np.array(velocities), np.full(len(velocities), np.nan)
    found = [resolve_impact(*case.arrays, case.restitution, clamp=clamp) for case in batch.cases]
    return np.array([impact.velocity for impact in found]), np.array([float(impact.rank) for impact in found])


def _measure(batch: _Batch, v_plus: Floats, rank: Floats) -> dict[str, Floats]:
    masses = np.array([case.mass_matrix for case in batch.cases])
    gain, error = bulk_energy_gain(masses, np.array([case.velocity for case in batch.cases]), v_plus)
    eigenvalues = np.linalg.eigvalsh(masses)
    return {
        "coordinates": np.full(len(masses), masses.shape[1]),
        "contacts": np.array([case.contacts for case in batch.cases]),
        "rank": rank,
        "condition": eigenvalues[:, -1] / eigenvalues[:, 0],
        "restitution": np.array([case.restitution for case in batch.cases]),
        "velocity_family": batch.velocity_family,
        "row_family": batch.row_family,
        "gain": gain,
        "gain_error": error,
        "residual": np.array([restitution_residual(*pair) for pair in zip(batch.cases, v_plus, strict=True)]),
    }


def _batches(rng: np.random.Generator, impacts: int, largest_condition: float) -> Iterator[_Batch]:
    left = impacts
    while left > 0:
        n = min(left, _BATCH)
        yield _draw(rng, n, int(rng.integers(1, LARGEST_COORDINATES + 1)), largest_condition)
        left -= n


def _draw(rng: np.random.Generator, n: int, d: int, largest_condition: float) -> _Batch:
    masses = _masses(rng, n, d, largest_condition)
    lower = np.linalg.cholesky(masses)
    velocity_family = rng.integers(0, len(VELOCITY_FAMILIES), size=n)
    row_family = rng.integers(0, len(ROW_FAMILIES), size=n)
    v = rng.normal(size=(n, d))
    whitened = np.linalg.solve(np.swapaxes(lower, 1, 2), v[:, :, None])[:, :, 0]
    jacobians = [_rows(rng, d) @ (lower[k].T if row_family[k] else np.eye(d)) for k in range(n)]
    e = np.where(rng.random(n) < 0.3, rng.choice([-1.0, 0.0, 1.0], size=n), rng.uniform(-1.0, 1.0, size=n))
    velocities = np.where(velocity_family[:, None] == 1, whitened, v)
    cases = [ImpactCase(*impact) for impact in zip(masses, jacobians, velocities, e.tolist(), strict=True)]
    return _Batch(cases, velocity_family, row_family)


def _masses(rng: np.random.Generator, n: int, d: int, largest_condition: float) -> Floats:
    """Draw M with random orthogonal axes, a log-uniform spectrum between 1 and 1/κ, log-uniform κ and a random unit."""
    axes = np.linalg.qr(rng.normal(size=(n, d, d)))[0]
    exponent = rng.uniform(0.0, np.log10(largest_condition), size=(n, 1))
    share = rng.uniform(0.0, 1.0, size=(n, d))
    share[:, 0], share[:, -1] = 0.0, 1.0
    masses = (axes * (10.0 ** -(exponent * share))[:, None, :]) @ np.swapaxes(axes, 1, 2)
    return 0.5 * (masses + np.swapaxes(masses, 1, 2)) * 10.0 ** rng.uniform(-3.0, 3.0, size=(n, 1, 1))


def _rows(rng: np.random.Generator, d: int) -> Floats:
    """Draw c rows of random rank: generic, dependent, copies, or dependent up to a distance of 1e-1 … 1e-16."""
    c = int(rng.integers(0, LARGEST_CONTACTS + 1))
    kind = rng.integers(0, 4)
    rank = int(rng.integers(1, min(max(c, 1), d) + 1))
    if kind == 0:
        return rng.normal(size=(c, d))
    basis = rng.normal(size=(rank, d))
    if kind == 1:
        return rng.normal(size=(c, rank)) @ basis
    copies = basis[rng.integers(0, rank, size=c)]
    return copies if kind == 2 else copies + 10.0 ** -rng.uniform(1.0, 16.0) * rng.normal(size=(c, d))

"""Attacks on the floating-point bound: tests of `bounds.gain_bound` with many adversarial impacts.

    >>> from verification.proofs.attack import attack, factored_in_bulk
    >>> attack(factored_in_bulk, count=1_000_000).worst_ratio  # at most 1, or the proof (or the resolver) is wrong

Any resolver can be attacked: `one_by_one` turns a function (M, J, v, e) -> v⁺ into a bulk resolver.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.contact.impact import resolve_impact
from iapb.errors import ArgumentError
from reference.exact import bulk_energy_gain
from verification.proofs.attack_kernel import resolve_batch
from verification.proofs.bounds import gain_bound

Floats = NDArray[np.float64]
BulkResolver = Callable[[Floats, Floats, Floats, Floats], Floats]

# v and the rows of J as combinations of M's eigenvectors, for which the energy or the rounding error is largest
FAMILIES = (
    "random",
    "v in the lightest direction",
    "v in the heaviest direction",
    "kinetic metric",
    "nearly dependent",
)
LARGEST_COORDINATES, LARGEST_CONTACTS, BATCH = 12, 16, 500
KAPPA_RANGE = (0.0, 12.0)  # exponents of ten
DEPENDENCE_RANGE = (-12.0, -2.0)  # exponents of ten of the difference between neighbouring rows


class Impacts(NamedTuple):
    """A batch of n impacts with c rows on d coordinates."""

    family: str
    mass_matrix: Floats  # (n, d, d)
    contact_jacobian: Floats  # (n, c, d)
    velocity: Floats  # (n, d)
    restitution: Floats  # (n,)


@dataclass(frozen=True)
class Attack:
    """Result of an attack: the largest gain / bound per family and per decade of κ(M), and the impact with the largest.
    """

    count: int
    seconds: float
    worst_ratio: float
    worst_by_family: dict[str, float]
    worst_by_decade: dict[int, float]
    worst_case: tuple[Floats, Floats, Floats, float]
    worst_gain: float
    worst_bound: float

    @property
    def holds(self) -> bool:
        """Whether no impact gained more than the bound allows."""
        return self.worst_ratio <= 1.0


def attack(
    resolve: BulkResolver, count: int = 10_000, seed: int = 1, bound: Callable[[int, float], float] = gain_bound
) -> Attack:
    """Resolve `count` adversarial impacts and compare their energy gains, in double-double, with a bound.

    Parameters
    ----------
    resolve : bulk resolver, (M (n,d,d), J (n,c,d), v (n,d), e (n,)) -> v⁺ (n,d).
    count : number of impacts.
    seed : seed of the generator; the same seed gives the same impacts.
    bound : (d, κ(M)) -> largest relative gain allowed.

    Raises
    ------
    ArgumentError
        If count < 1.
    """
    if count < 1:
        raise ArgumentError("count", count, "at least one impact")
    started, done, worst = time.perf_counter(), 0, -np.inf
    by_family, by_decade = dict.fromkeys(FAMILIES, -np.inf), dict[int, float]()
    for batch in _batches(count, seed):
        gains, kappas = _judge(batch, resolve(*batch[1:]))
        limits = np.array([bound(batch.velocity.shape[1], kappa) for kappa in kappas])
        ratios = gains / limits
        by_family[batch.family] = max(by_family[batch.family], float(np.max(ratios)))
        for decade in np.unique(np.log10(kappas).astype(int)):
            worst_here = float(np.max(ratios[np.log10(kappas).astype(int) == decade]))
            by_decade[int(decade)] = max(by_decade.get(int(decade), -np.inf), worst_here)
        done += len(ratios)
        k = int(np.argmax(ratios))
        if ratios[k] > worst:
            worst, gain, limit = float(ratios[k]), float(gains[k]), float(limits[k])
            case = (batch[1][k], batch[2][k], batch[3][k], float(batch[4][k]))
    return Attack(done, time.perf_counter() - started, worst, by_family, by_decade, case, gain, limit)


def _judge(batch: Impacts, v_plus: Floats) -> tuple[Floats, Floats]:
    """Return the relative gains minus their own error bounds, and κ(M) of each rounded mass matrix."""
    gains, error = bulk_energy_gain(batch.mass_matrix, batch.velocity, v_plus)
    spectra = np.linalg.eigvalsh(batch.mass_matrix)
    return gains - error, np.maximum(1.0, spectra[:, -1] / spectra[:, 0])


def _batches(count: int, seed: int) -> Iterator[Impacts]:
    """Yield batches small enough that each family gets several sizes d, even if count is small."""
    rng, size = np.random.default_rng(seed), min(BATCH, max(1, count // (5 * len(FAMILIES))))
    for number, start in enumerate(range(0, count, size)):
        yield draw(rng, FAMILIES[number % len(FAMILIES)], min(size, count - start))


def draw(rng: np.random.Generator, family: str, n: int) -> Impacts:
    """Draw n impacts of one family: M with known spectrum in a random frame, rows and velocities in that frame."""
    d, c = int(rng.integers(1, LARGEST_COORDINATES + 1)), int(rng.integers(1, LARGEST_CONTACTS + 1))
    frame = np.linalg.qr(rng.standard_normal((n, d, d)))[0]
    spectrum = 10.0 ** -np.sort(rng.uniform(0.0, 1.0, (n, d)) * rng.uniform(*KAPPA_RANGE, (n, 1)), axis=1)
    mass = np.einsum("nik,nk,njk->nij", frame, spectrum, frame)
    rows, v = rng.standard_normal((n, c, d)), rng.standard_normal((n, d))
    if family == "v in the lightest direction":
        v = frame[:, :, -1] + v * 10.0 ** rng.uniform(-16.0, 0.0, (n, 1))
    elif family == "v in the heaviest direction":
        v = frame[:, :, 0] + v * 10.0 ** rng.uniform(-16.0, 0.0, (n, 1))
    elif family == "kinetic metric":
        rows = np.einsum("nck,nk,njk->ncj", rows, np.sqrt(spectrum), frame)
        v = np.einsum("nk,nk,njk->nj", v, 1.0 / np.sqrt(spectrum), frame)
    elif family == "nearly dependent" and c > 1:
        apart = 10.0 ** rng.uniform(*DEPENDENCE_RANGE, (n, 1))
        rows[:, -1] = rows[:, 0] + apart * rows[:, -1]
    # Elastic impacts conserve the energy exactly, so every gain is rounding. A few others cover the range of e.
    restitution = np.where(rng.uniform(size=n) < 0.8, 1.0, rng.uniform(-1.0, 1.0, n))
    return Impacts(family, 0.5 * (mass + np.swapaxes(mass, 1, 2)), rows, v, restitution)


def one_by_one(resolve: Callable[[Floats, Floats, Floats, float], Floats]) -> BulkResolver:
    """Return a bulk resolver from a resolver for one impact."""

    def in_bulk(mass_matrix: Floats, contact_jacobian: Floats, velocity: Floats, restitution: Floats) -> Floats:
        cases = zip(mass_matrix, contact_jacobian, velocity, restitution, strict=True)
        return np.array([resolve(m, j, v, float(e)) for m, j, v, e in cases])

    return in_bulk


def engine_resolver(clamp: bool | None = None) -> BulkResolver:
    """Return the engine's public `resolve_impact` as a bulk resolver: one call per impact (about 10⁴ per second)."""
    return one_by_one(lambda m, j, v, e: resolve_impact(m, j, v, e, clamp=clamp).velocity)


def factored_in_bulk(mass_matrix: Floats, contact_jacobian: Floats, velocity: Floats, restitution: Floats) -> Floats:
    """Resolve n impacts by the engine's compiled kernel, as the simulation step calls it."""
    columns = np.ascontiguousarray(np.swapaxes(contact_jacobian, 1, 2))
    return resolve_batch(mass_matrix, columns, velocity, restitution)[0]

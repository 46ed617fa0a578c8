"""Exact check that no adverse impact gains energy in the compiled resolver, and the energy that this guarantee costs.

The families are those in which rounding gains most: light directions of M, nearly dependent rows, M asymmetric in the
last bit, subnormal velocities, and magnitudes over 600 decades; one family is ordinary. Three quarters of the impacts
are elastic.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb import resolve_impacts
from iapb.advice.certificate import judge_gains
from iapb.compiled import kernel
from iapb.contact.kernels.passive import gain
from iapb.double_double import kinetic_energies
from verification.proofs.attack_kernel import resolve_batch

Floats = NDArray[np.float64]
EPS = float(np.finfo(float).eps)
LARGEST_COORDINATES, LARGEST_CONTACTS = 8, 8
LEAST_MOVED = 0.9  # share of a family's impacts that must change v; otherwise "none gains" is no evidence
SCALED = ("600 decades",)  # scaled as in `resolve_impact`; the other families stay in their units, as in compiled steps
_BATCH = 5000


class Impacts(NamedTuple):
    """n impacts of one size."""

    mass: Floats  # (n, d, d)
    rows: Floats  # (n, d, c) J, one contact per column
    v: Floats  # (n, d)
    restitution: Floats  # (n,)
    condition: Floats  # (n,) κ(M) as drawn


@dataclass(frozen=True)
class ExactEnergy:
    """Result for the impacts of one family.

    Attributes
    ----------
    family : name of the family.
    impacts, gains : number of impacts, and number of those that gained energy in exact arithmetic.
    by_integers, checked : number of impacts that floating-point bounds left undecided, so that integers decided them,
        and number of bounds that integers confirmed.
    moved : share of the impacts with v⁺ ≠ v⁻.
    cancelled : number of impacts without any passive step, for which v⁺ = v⁻.
    price : 0.5, 0.99 and 1-quantiles, over the impacts with e = 1, of the relative energy that passivity costs. The
        cost is the loss beyond that of the same impact without clamp and last step, in units of 10 d ε √κ(M).
    """

    family: str
    impacts: int
    gains: int
    by_integers: int
    checked: int
    moved: float
    cancelled: int
    price: tuple[float, float, float]

    @property
    def holds(self) -> bool | None:
        """Whether no impact gained energy; None if too few impacts changed v for a conclusion."""
        return False if self.gains else True if self.moved >= LEAST_MOVED else None


def resolved(impacts: Impacts, clamped: bool = True, *, scale: bool = False) -> tuple[Floats, Floats]:
    """Return v⁺ (n, d) and the clamps (n,). `scale` applies powers of two before and after, like `resolve_impact`."""
    if not scale:
        return resolve_batch(impacts.mass, impacts.rows, impacts.v, impacts.restitution, clamped)
    found = resolve_impacts(impacts.mass, impacts.rows.transpose(0, 2, 1), impacts.v, impacts.restitution,
                            clamp=clamped)
    return found.velocity, found.clamp


def ordinary(rng: np.random.Generator, n: int, d: int, c: int, decades: float = 3.0) -> Impacts:
    """Draw M with κ up to 10^decades, and normally distributed rows and velocities."""
    basis = np.linalg.qr(rng.normal(size=(n, d, d)))[0]
    power = rng.uniform(0.0, decades, n)
    spectrum = 10.0 ** (-power[:, None] * np.linspace(0.0, 1.0, d))
    mass = (basis * spectrum[:, None, :]) @ basis.transpose(0, 2, 1)
    mass = 0.5 * (mass + mass.transpose(0, 2, 1))
    e = np.where(rng.random(n) < 0.75, 1.0, rng.uniform(-1.0, 1.0, n))
    condition = 10.0 ** (power if d > 1 else 0.0 * power)
    return Impacts(mass, rng.normal(size=(n, d, c)), rng.normal(size=(n, d)), e, condition)


def light(rng: np.random.Generator, n: int, d: int, c: int) -> Impacts:
    """Draw M with κ up to 1e12, v along the lightest direction, and rows that are random in the kinetic metric."""
    given = ordinary(rng, n, d, c, 12.0)
    values, vectors = np.linalg.eigh(given.mass)
    rows = (vectors * np.sqrt(np.abs(values))[:, None, :]) @ given.rows
    return given._replace(v=np.ascontiguousarray(vectors[:, :, 0]), rows=rows)


def dependent(rng: np.random.Generator, n: int, d: int, c: int) -> Impacts:
    """Draw rows with relative differences between 1e-3 and 1e-14."""
    given = ordinary(rng, n, d, c, 6.0)
    noise = 10.0 ** -rng.uniform(3.0, 14.0, (n, 1, 1))
    return given._replace(rows=given.rows[:, :, :1] + noise * given.rows)


def asymmetric(rng: np.random.Generator, n: int, d: int, c: int) -> Impacts:
    """Draw the family `light`, with M changed by one unit in the last place above the diagonal."""
    given = light(rng, n, d, c)
    upper = np.triu(np.ones((d, d), bool), 1)
    moved = np.nextafter(given.mass, np.where(rng.random((n, d, d)) < 0.5, np.inf, -np.inf))
    return given._replace(mass=np.where(upper, moved, given.mass))


def subnormal(rng: np.random.Generator, n: int, d: int, c: int) -> Impacts:
    """Draw velocities of small integers times a power of two between 2⁻¹⁰⁷⁴ and 2⁻¹⁰⁵¹."""
    given = ordinary(rng, n, d, c)
    units = np.ldexp(1.0, rng.integers(-1074, -1050, n).astype(np.int32))[:, None]
    return given._replace(v=np.rint(4.0 * given.v) * units)


def far_apart(rng: np.random.Generator, n: int, d: int, c: int) -> Impacts:
    """Draw units of the coordinates, of M and of v over 600 decades: the energy fits a double, some products do not."""
    given = ordinary(rng, n, d, c)
    unit = 10.0 ** rng.uniform(-75.0, 75.0, (n, d))
    whole, speed = 10.0 ** rng.uniform(-120.0, 120.0, (n, 1)), 10.0 ** rng.uniform(-75.0, 75.0, (n, 1))
    mass = given.mass * unit[:, :, None] * unit[:, None, :] * whole[:, :, None]
    return given._replace(mass=mass, v=given.v / unit * speed, rows=given.rows * unit[:, :, None])


FAMILIES: dict[str, Callable[[np.random.Generator, int, int, int], Impacts]] = {
    "ordinary": ordinary, "light directions": light, "nearly dependent rows": dependent,
    "M asymmetric in the last bit": asymmetric, "subnormal velocities": subnormal, "600 decades": far_apart,
}


def exact_energy(family: str, impacts: int, seed: int = 0) -> ExactEnergy:
    """Draw and resolve the impacts of one family, and check each for an energy gain."""
    rng, gains, integers = np.random.default_rng([seed, *family.encode()]), 0, 0
    checked, moved, cancelled = 0, 0, 0
    prices: list[Any] = []
    for given in _batches(family, impacts, rng):
        v_plus, clamps = resolved(given, scale=family in SCALED)
        judged = judge_gains(given.mass, given.v, v_plus)
        gains += int(judged.gained.sum())
        integers, checked = integers + judged.by_integers, checked + judged.checked
        moved += int((v_plus != given.v).any(axis=1).sum())
        cancelled += int((clamps <= 0.0).sum())
        if family not in ("subnormal velocities", "600 decades"):
            prices.append(_losses(given, v_plus) - np.maximum(_losses(given, resolved(given, False)[0]), 0.0))
    median, most, largest = np.quantile(np.concatenate(prices), (0.5, 0.99, 1.0)) if prices else np.full(3, np.nan)
    price = float(median), float(most), float(largest)
    return ExactEnergy(family, impacts, gains, integers, checked, moved / impacts, cancelled, price)


def _batches(family: str, impacts: int, rng: np.random.Generator) -> Iterator[Impacts]:
    for start in range(0, impacts, _BATCH):
        size = int(rng.integers(1, LARGEST_COORDINATES + 1)), int(rng.integers(1, LARGEST_CONTACTS + 1))
        with np.errstate(over="ignore", under="ignore"):
            drawn = FAMILIES[family](rng, min(_BATCH, impacts - start), *size)
        yield Impacts(*(np.ascontiguousarray(x) for x in drawn))


@kernel
def _relative_losses(masses, v, v_plus, lost):  # type: ignore[no-untyped-def]
    """Write (KE⁻ − KE⁺)/KE⁻, computed in double-double and rounded once, into `lost`."""
    for k in range(v.shape[0]):
        high, low, _, _ = gain(masses[k], v[k], v_plus[k])
        lost[k] = -0.25 * (high + low) / kinetic_energies(masses[k], v[k], v_plus[k])[0]


def _losses(given: Impacts, v_plus: Floats) -> Floats:
    """Return the relative losses of the elastic impacts, divided by 10 d ε √κ."""
    lost, elastic = np.empty(len(v_plus)), given.restitution == 1.0
    _relative_losses(given.mass, given.v, v_plus, lost)
    bound = 10.0 * v_plus.shape[1] * EPS * np.sqrt(given.condition)
    return np.asarray((lost / bound)[elastic], np.float64)

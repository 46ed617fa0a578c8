"""Very many random impacts: their energy gain against 10·d·ε·√κ(M), and gains judged exactly.

`bulk_impacts` measures one method on impacts of any rank. `exact_energy` checks that no adverse
impact gains energy in the compiled resolver, and what this guarantee costs.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from iapb import resolve_impacts
from iapb.contact.kernels.impact import ImpactWork, factored_impacts
from iapb.numerics.compiled import block
from iapb.numerics.schema import zeros_of
from reference.exact import bulk_energy_gain
from reference.one_thread import one_thread
from verification.certificate import judge_gains
from verification.impacts import ANY_RANK, EPS, Floats, Impacts, draw_impacts, over
from verification.methods import COMPARED
from verification.table import HOLDS, Row

GAIN, SHARE, ABOVE = "largest relative energy gain", "gain / (10 d ε √κ)", "above 10 d ε √κ"
LARGEST_COORDINATES, LARGEST_CONTACTS, _SIZED = (
    30,
    100,
    50,
)  # _SIZED impacts share d, c and the kind of rows


@dataclass(frozen=True)
class BulkImpacts:
    """All impacts of a bulk study; all arrays have shape (n,).

    Attributes
    ----------
    coordinates, contacts, rank : d, c, and the rank that the resolver used (NaN if it does not
        say).
    condition : κ(M) as drawn.
    gain : (KE⁺ − KE⁻)/KE⁻ in double-double.
    residual : max |Jᵢv⁺ + e Jᵢv⁻| / (‖Aᵢ‖ |u|).
    """

    coordinates: Floats
    contacts: Floats
    rank: Floats
    condition: Floats
    gain: Floats
    residual: Floats

    @property
    def bound(self) -> Floats:
        """10·d·ε·√κ(M)."""
        return 10.0 * self.coordinates * EPS * np.sqrt(self.condition)

    def by_condition(self) -> Iterator[Row]:
        """Yield the row of each decade of κ(M), and that of all impacts."""
        decade = np.floor(np.log10(self.condition) + 1e-9).astype(int)
        by_cholesky = self.gain / (
            self.coordinates * EPS * self.condition
        )  # the bound without the clamp
        groups = [(f"1e{k}", decade == k) for k in np.unique(decade)]
        for name, chosen in [*groups, ("all", np.ones(len(decade), bool))]:
            ratio, gains = (self.gain / self.bound)[chosen], self.gain[chosen]
            yield {
                "condition of M from": name,
                "impacts": int(np.sum(chosen)),
                GAIN: float(np.max(gains)),
                SHARE: float(np.max(ratio)),
                "gain / (d ε κ)": float(np.max(by_cholesky[chosen])),
                ABOVE: int(np.sum(ratio > 1.0)),
                "largest restitution residual": float(np.max(self.residual[chosen])),
            }


def bulk_impacts(
    impacts: int = 2000, seed: int = 0, method: str = "factored", clamp: bool | None = None
) -> BulkImpacts:
    """Resolve `impacts` random impacts (d 1…30, c 0…100, any rank, κ(M) up to 1e12, e in [−1, 1])
    and measure each.

    Parameters
    ----------
    impacts, seed : number of impacts, and seed of the random numbers.
    method, clamp : "factored", with or without the clamp of `iapb.resolve_impact`, or a name of
        `COMPARED`.

    Returns
    -------
    BulkImpacts
        Energy gain, restitution error and size of every impact.
    """
    rng, batches = np.random.default_rng(seed), list[dict[str, Floats]]()
    with one_thread():
        for start in range(0, impacts, _SIZED):
            n, d = min(_SIZED, impacts - start), int(rng.integers(1, LARGEST_COORDINATES + 1))
            given = draw_impacts(rng, ANY_RANK, n, d, int(rng.integers(0, LARGEST_CONTACTS + 1)))
            rows = given.columns.transpose(0, 2, 1)
            if method == "factored":
                found = resolve_impacts(given.mass, rows, given.v, given.restitution, clamp=clamp)
                v_plus, rank = found.velocity, found.rank
            else:
                each = zip(given.mass, rows, given.v, given.restitution, strict=True)
                v_plus, rank = (
                    np.array([COMPARED[method](*impact) for impact in each]),
                    np.full(n, np.nan),
                )
            batches.append(_measure(given, v_plus) | {"rank": rank})
    columns = {name: np.concatenate([batch[name] for batch in batches]) for name in batches[0]}
    return BulkImpacts(**columns)


def _measure(given: Impacts, v_plus: Floats) -> dict[str, Floats]:
    (n, d, c), lower = given.columns.shape, np.linalg.cholesky(given.mass)
    target = v_plus + given.restitution[:, None] * given.v
    length = np.linalg.norm(np.linalg.solve(lower, given.columns), axis=1)
    speed = np.linalg.norm(np.einsum("nij,ni->nj", lower, given.v), axis=1)
    unmet = over(np.abs(np.einsum("nic,ni->nc", given.columns, target)), length * speed[:, None])
    return {
        "coordinates": np.full(n, d),
        "contacts": np.full(n, c),
        "condition": given.condition,
        "gain": bulk_energy_gain(given.mass, given.v, v_plus)[0],
        "residual": np.max(unmet, axis=1, initial=0.0),
    }


LARGEST = 8  # coordinates, and contacts, of the impacts judged exactly
LEAST_MOVED = (
    0.9  # share of a family's impacts that must change v; otherwise "none gains" is no evidence
)
SCALED = (
    "600 decades",
)  # scaled as in `resolve_impact`; the other families stay in their units, as in compiled steps
_BATCH = 5000


def exact_energy(family: str, impacts: int, seed: int = 0) -> Row:
    """Draw and resolve the impacts of one of `impacts.ADVERSE_FAMILIES`, and check each for an
    energy gain.

    The row has the number of impacts and of gains in exact arithmetic, the share that moved (v⁺ ≠
    v⁻), the number that was cancelled (no passive step, so v⁺ = v⁻), and the median and largest
    relative energy that passivity costs at e = 1: the loss beyond that of the same impact without
    clamp and last step, in units of 10 d ε √κ(M).
    """
    rng, gains, moved, cancelled = np.random.default_rng([seed, *family.encode()]), 0, 0, 0
    prices: list[Any] = []
    for start in range(0, impacts, _BATCH):
        d, c = (int(rng.integers(1, LARGEST + 1)) for _ in range(2))
        with np.errstate(over="ignore", under="ignore"):
            given = draw_impacts(rng, family, min(_BATCH, impacts - start), d, c)
        v_plus, clamps = resolved(given, scale=family in SCALED)
        gains += int(judge_gains(given.mass, given.v, v_plus).gained.sum())
        moved += int((v_plus != given.v).any(axis=1).sum())
        cancelled += int((clamps <= 0.0).sum())
        if family not in ("subnormal velocities", "600 decades"):
            prices.append(
                _losses(given, v_plus) - np.maximum(_losses(given, resolved(given, False)[0]), 0.0)
            )
    median, largest = (
        np.quantile(np.concatenate(prices), (0.5, 1.0)).tolist() if prices else (None, None)
    )
    holds = False if gains else True if moved / impacts >= LEAST_MOVED else None
    return {
        "family": family,
        "impacts": impacts,
        "gains": gains,
        "moved": moved / impacts,
        "cancelled": cancelled,
        "median energy cost": median,
        "largest energy cost": largest,
        HOLDS: holds,
    }


def resolved(given: Impacts, clamped: bool = True, *, scale: bool = False) -> tuple[Floats, Floats]:
    """Return v⁺ (n, d) and the clamps (n,), by the engine's impact kernel as the simulation step
    calls it.

    If M is not positive definite to rounding, v⁺ = v and the clamp is −1. `scale` applies powers of
    two before and after, like `resolve_impact`.
    """
    if scale:
        found = resolve_impacts(
            given.mass, given.columns.transpose(0, 2, 1), given.v, given.restitution, clamp=clamped
        )
        return found.velocity, found.clamp
    n, d, c = given.columns.shape
    v_plus, clamps = np.empty((n, d)), np.empty(n)
    work = block(zeros_of(ImpactWork, velocity=d, row=c))
    factored_impacts(*given[:4], d, clamped, 1, work, v_plus, clamps)
    return v_plus, clamps


def _losses(given: Impacts, v_plus: Floats) -> Floats:
    """Return the relative losses of the elastic impacts, divided by 10 d ε √κ."""
    lost, elastic = -bulk_energy_gain(given.mass, given.v, v_plus)[0], given.restitution == 1.0
    bound = 10.0 * v_plus.shape[1] * EPS * np.sqrt(given.condition)
    return np.asarray((lost / bound)[elastic], np.float64)

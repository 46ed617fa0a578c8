"""The table of impacts: many random ones, drawn once, each judged for a gain in exact arithmetic.

Other families provoke gains more than random impacts do. Two other methods are judged beside the
engine's, to show that the judge sees gains.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from iapb import resolve_impacts
from iapb.contact.kernels.impact import ImpactWork, factored_impacts
from iapb.numerics.compiled import block
from iapb.numerics.schema import zeros_of
from reference.exact import relative_energy_gain
from reference.one_thread import one_thread
from verification.certificate import judge_gains
from verification.check import SEED, Check, Study
from verification.finding import Part
from verification.impacts import ADVERSE_FAMILIES, ANY_RANK, EPS, Floats, Impacts, draw_impacts
from verification.methods import gram_pinv
from verification.table import HOLDS, Row, Table

OURS = "IAPB"
NO_CLAMP = "IAPB, no clamp"
PRINTED = "printed formula"
GAIN = "largest relative gain"
MEDIAN = "median relative gain of those that gain"
SHARE = "gain / (10 d ε √κ)"
SLOW = "subnormal velocities"  # takes 2 ms an impact, the others some µs: a quarter of the impacts
# scaled as in `resolve_impact`; the other families stay in their units, as in compiled steps
SCALED = "600 decades"
IMPACTS = {"quick": 20_000, "full": 1_000_000}  # of each adverse family
OF_ANY_RANK = {"quick": 100_000, "full": 1_000_000}
OF_OTHERS = {"quick": 10_000, "full": 100_000}
LEAST_MOVED = 0.9  # share of the impacts that must change v; otherwise "none gains" is no evidence
# family -> largest numbers of coordinates and contacts, and impacts that share them
LARGEST = dict.fromkeys(ADVERSE_FAMILIES, (8, 8, 5000)) | {ANY_RANK: (30, 100, 50)}

Method = Callable[[Impacts, bool], tuple[Floats, Floats]]


def by_engine(given: Impacts, scale: bool, clamped: bool = True) -> tuple[Floats, Floats]:
    """Return v⁺ (n, d) and the clamps (n,), by the engine's impact kernel as the simulation step
    calls it.

    If M is not positive definite to rounding, v⁺ = v and the clamp is −1. `scale` applies powers of
    two before and after, like `resolve_impact`.
    """
    n, d, c = given.columns.shape
    if scale:
        rows = given.columns.transpose(0, 2, 1)
        found = resolve_impacts(given.mass, rows, given.v, given.restitution, clamp=clamped)
        return found.velocity, found.clamp
    v_plus = np.empty((n, d))
    clamps = np.empty(n)
    work = block(zeros_of(ImpactWork, velocity=d, row=c))
    factored_impacts(*given[:4], d, clamped, 1, work, v_plus, clamps)
    return v_plus, clamps


def without_clamp(given: Impacts, scale: bool) -> tuple[Floats, Floats]:
    """Return v⁺ of the engine without the clamp and the refinement before it."""
    return by_engine(given, scale, clamped=False)


def as_printed(given: Impacts, scale: bool) -> tuple[Floats, Floats]:
    """Return v⁺ by the printed formula, with numpy's pseudo-inverse."""
    rows = given.columns.transpose(0, 2, 1)
    each = zip(given.mass, rows, given.v, given.restitution, strict=True)
    return np.array([gram_pinv(*impact) for impact in each]), np.ones(len(given.v))


METHODS: dict[str, Method] = {OURS: by_engine, NO_CLAMP: without_clamp, PRINTED: as_printed}


@one_thread()
def judged_impacts(family: str, impacts: int, method: str = OURS, seed: int = SEED) -> Row:
    """Draw and resolve the impacts of a family, and judge each for an energy gain.

    The row has the number of impacts and of gains in exact arithmetic, the largest gain relative to
    the energy before, also divided by 10 d ε √κ(M), what rounding v⁺ to doubles can add. It has the
    share that moved (v⁺ ≠ v⁻), and the number that was cancelled (no passive step, so v⁺ = v⁻).
    """
    rng = np.random.default_rng([seed, *family.encode()])
    coordinates, contacts, batch = LARGEST[family]
    least = 0 if family == ANY_RANK else 1
    moved = 0
    cancelled = 0
    gains: list[float] = []
    shares: list[float] = []
    for start in range(0, impacts, batch):
        d = int(rng.integers(1, coordinates + 1))
        c = int(rng.integers(least, contacts + 1))
        with np.errstate(over="ignore", under="ignore"):
            given = draw_impacts(rng, family, min(batch, impacts - start), d, c)
        v_plus, clamps = METHODS[method](given, family == SCALED)
        moved += int((v_plus != given.v).any(axis=1).sum())
        cancelled += int((clamps <= 0.0).sum())
        for k in np.flatnonzero(judge_gains(given.mass, given.v, v_plus).gained):
            gain = relative_energy_gain(given.mass[k], given.v[k], v_plus[k])
            gains.append(gain)
            shares.append(gain / (10.0 * d * EPS * float(np.sqrt(given.condition[k]))))
    return {
        "method": method,
        "family": family,
        "impacts": impacts,
        "gains": len(gains),
        GAIN: max(gains, default=0.0),
        MEDIAN: float(np.median(gains)) if gains else 0.0,
        SHARE: max(shares, default=0.0),
        "moved": moved / impacts,
        "cancelled": cancelled,
        HOLDS: _never_gains(method, len(gains), moved / impacts),
    }


def _never_gains(method: str, gains: int, moved: float) -> bool | None:
    """Whether the engine gains nothing; None if too few impacts moved, and for other methods."""
    if method != OURS:
        return None
    if gains:
        return False
    return True if moved >= LEAST_MOVED else None


def _cases(study: Study) -> Iterator[tuple[str, int, str]]:
    """Yield family, number of impacts and method."""
    yield ANY_RANK, OF_ANY_RANK[study.depth], OURS
    for family in ADVERSE_FAMILIES:
        yield family, IMPACTS[study.depth] // (4 if family == SLOW else 1), OURS
    yield ANY_RANK, OF_OTHERS[study.depth], NO_CLAMP
    yield ANY_RANK, OF_OTHERS[study.depth], PRINTED


def ours(table: Table) -> Table:
    """Return the engine's rows."""
    return table.where(method=OURS)


def _targets(table: Table) -> Iterator[Part]:
    told = ours(table)
    gains = None if None in told.holds and False not in told.holds else sum(told["gains"])
    yield Part.on("random impacts of the engine that gain energy", gains, 0)


TABLE = Check(
    key="impacts",
    question="Does an impact gain energy, in exact arithmetic?",
    cases=_cases,
    row=lambda study, case: judged_impacts(*case),
    targets=_targets,
)

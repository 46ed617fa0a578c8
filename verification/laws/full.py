"""The laws on many cases, in batches: impacts by the kit, each batch with a seed of its own; scenes,
and the laws of the engine, each case with a seed of its own, which draws it again.

`plan` returns the batches of cases, and `judge_batch` judges one batch.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from iapb import resolve_impact
from iapb.errors import IapbError
from iapb.run import Run
from reference.one_thread import one_thread
from verification.laws.bounds import FACTORED, LawCount, LawResidual
from verification.laws.engine import ENGINE_LAWS
from verification.laws.kit import check_passivity
from verification.laws.resolver import Resolver
from verification.laws.scenes import draw_scene, draw_spatial_scene
from verification.laws.trajectories import judge_run

IMPACTS = "impacts"
TRAJECTORIES = "trajectories"
IN_SPACE = "trajectories in space"
# the seeds depend on the order: add at the end
PARTS = (IMPACTS, TRAJECTORIES, *ENGINE_LAWS, IN_SPACE)
SCENES = {TRAJECTORIES: draw_scene, IN_SPACE: draw_spatial_scene}
# Cases of a part per requested impact or trajectory, and cases per batch (a few seconds of work).
_SHARE = {"truncation": 0.5}
_PER_TRAJECTORY = {IN_SPACE: 0.4, "group_splitting": 0.2}
BATCH = {IMPACTS: 250, TRAJECTORIES: 50, IN_SPACE: 50, "group_splitting": 20}
_BATCH = 2000
_SEEDS = 10**9  # seeds of the kit from one seed of all draws to the next
ENGINE_CONDITION = 1e10  # largest κ(M) in tests of the engine


@dataclass(frozen=True)
class Batch:
    """A batch of the cases first … first + count − 1 of a part."""

    part: str
    first: int
    count: int


@dataclass(frozen=True)
class Found:
    """What breaks a law: the law, the part and index of the case (of impacts: the first of the
    batch), source code of a test, and the run if it is a scene."""

    law: str
    part: str
    index: int
    test: str
    run: Run | None = None


@dataclass(frozen=True)
class Outcome:
    """Result of one batch of a part: the count of each law, and the first case that breaks it."""

    part: str
    counts: tuple[LawCount, ...]
    found: tuple[Found, ...]


def plan(impacts: int, trajectories: int, parts: tuple[str, ...] = PARTS) -> tuple[Batch, ...]:
    """Return the batches for these numbers of impacts and trajectories; the other parts get numbers
    in proportion."""
    totals = {IMPACTS: impacts, TRAJECTORIES: trajectories}
    totals |= {part: round(share * impacts) for part, share in _SHARE.items()}
    totals |= {part: round(share * trajectories) for part, share in _PER_TRAJECTORY.items()}
    batches = list[Batch]()
    for part in parts:
        size = BATCH.get(part, _BATCH)
        for first in range(0, totals[part], size):
            batches.append(Batch(part, first, min(size, totals[part] - first)))
    return tuple(batches)


def drawn(part: str, index: int, seed: int) -> Any:
    """Return case `index` of a part other than the impacts; it is the same in every call."""
    rng = np.random.default_rng([seed, 1 + PARTS.index(part), index])
    return SCENES[part](rng) if part in SCENES else ENGINE_LAWS[part].draw(rng)


def residuals(part: str, case: Any) -> tuple[dict[str, LawResidual], Run | None]:
    """Return the residual of each law that judges a case, and its run if it is a scene."""
    if part in ENGINE_LAWS:
        return {part: ENGINE_LAWS[part].check(case, ENGINE_LAWS[part].ours)}, None
    try:
        run = case.simulate()
    except IapbError:  # refused with a named error before the first step: nothing to judge
        return {}, None
    return dict(judge_run(run)), run


def judge_batch(batch: Batch, resolver: Resolver, seed: int) -> Outcome:
    """Judge every case of a batch by the laws of its part."""
    if batch.part == IMPACTS:
        return _judge_impacts(batch, resolver, seed)
    counts: dict[str, LawCount] = {}
    found: dict[str, Found] = {}
    with one_thread():
        for index in range(batch.first, batch.first + batch.count):
            judged, run = residuals(batch.part, drawn(batch.part, index, seed))
            for law, residual in judged.items():
                passed = counts.setdefault(law, LawCount(law)).add(residual)
                if not passed and law not in found:
                    test = drawn_again(law, batch.part, index, seed)
                    found[law] = Found(law, batch.part, index, test, run)
    return Outcome(batch.part, tuple(counts.values()), tuple(found.values()))


def _judge_impacts(batch: Batch, resolver: Resolver, seed: int) -> Outcome:
    """Let the kit judge a batch; the engine's own resolver has tighter tolerances, worse mass
    matrices, and unequal restitution."""
    ours = resolver is resolve_impact
    report = check_passivity(
        resolver,
        impacts=batch.count,
        seed=seed * _SEEDS + batch.first,
        bounds=FACTORED if ours else None,
        largest_condition=ENGINE_CONDITION if ours else None,
        unequal_restitution=ours,
        patience=np.inf,
        search=0,
    )
    for one in report.verdicts:
        if one.error is not None:  # of the law itself, which judged nothing since
            raise one.error
    counts = tuple(LawCount(one.law) + one for one in report.verdicts)
    found = (Found(one.law, IMPACTS, batch.first, report.test_of(one)) for one in report.found)
    return Outcome(IMPACTS, counts, tuple(found))


def summed(outcomes: Iterable[Outcome]) -> tuple[dict[str, dict[str, LawCount]], list[Found]]:
    """Return the counts of all batches, by part and law, and of each part and law the first case
    that breaks it."""
    counts: dict[str, dict[str, LawCount]] = {}
    found: dict[tuple[str, str], Found] = {}
    for outcome in outcomes:
        sums = counts.setdefault(outcome.part, {})
        for count in outcome.counts:
            sums[count.law] = sums.get(count.law, LawCount(count.law)) + count
        for one in outcome.found:
            found.setdefault((one.part, one.law), one)
    return counts, list(found.values())


_DRAWN_AGAIN = """\
from verification.laws.full import drawn, residuals


def test_{law}():
    case = drawn({part!r}, {index}, seed={seed})
    residual = residuals({part!r}, case)[0][{law!r}]
    assert residual.passed, residual"""


def drawn_again(law: str, part: str, index: int, seed: int) -> str:
    """Return source code of a test that draws a case again and judges it."""
    return _DRAWN_AGAIN.format(law=law, part=part, index=index, seed=seed)

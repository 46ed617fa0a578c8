"""The laws at length: parts of many cases in batches, each case from a seed of its own, so that any can be redrawn.

`plan` says which batches there are, `do_batch` does one and returns plain records; who stores them is not known here.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from iapb.errors import IapbError
from iapb.run import Run
from verification.properties.bounds import Bounds
from verification.properties.case import LawResidual, Resolver
from verification.properties.engine_laws import ENGINE_LAWS
from verification.properties.families import draw_case, with_unequal_restitution
from verification.properties.laws import LAWS, UNEQUAL_LAWS
from verification.properties.scenes import draw_scene
from verification.properties.tally import LawCount, added, one_count, residual_of
from verification.properties.trajectory_laws import judge_run
from verification.threads import one_thread

IMPACTS, UNEQUAL, TRAJECTORIES = "impacts", "unequal restitution", "trajectories"
PARTS = (IMPACTS, UNEQUAL, TRAJECTORIES, *ENGINE_LAWS)  # the order enters the seeds: add at the end
# Cases of a part for each impact or trajectory asked for, and cases per batch (some ten seconds of work).
_SHARE = {UNEQUAL: 0.1, "truncation": 0.1, "device_limits": 0.1, "extremes": 0.2, "hand_port": 0.02}
_GROUPS_PER_TRAJECTORY = 0.2
BATCH = {IMPACTS: 1000, UNEQUAL: 2000, TRAJECTORIES: 50, "group_splitting": 20}
_BATCH = 2000
STORED_PER_LAW = 3  # counterexamples kept of each law and batch; all are counted


@dataclass(frozen=True)
class Subject:
    """What is put to the laws: a resolver, its tolerances, the largest κ(M) of its impacts, the seed of all draws."""

    resolver: Resolver
    bounds: Bounds
    largest_condition: float
    seed: int = 0


@dataclass(frozen=True)
class Batch:
    """Cases first … first + count − 1 of a part."""

    part: str
    first: int
    count: int


@dataclass(frozen=True)
class Found:
    """A counterexample: the law it breaks, where it was drawn, the case, and the run of a scene."""

    law: str
    part: str
    index: int
    residual: LawResidual
    case: Any
    run: Run | None = None


@dataclass(frozen=True)
class BatchOutcome:
    """What came of one batch."""

    counts: tuple[LawCount, ...]
    found: tuple[Found, ...]
    seconds: float


def plan(impacts: int, trajectories: int, parts: tuple[str, ...] = PARTS) -> tuple[Batch, ...]:
    """Return the batches of so many impacts and trajectories, with their share of the other parts."""
    totals = {IMPACTS: impacts, TRAJECTORIES: trajectories}
    totals |= {part: round(share * impacts) for part, share in _SHARE.items()}
    totals["group_splitting"] = round(_GROUPS_PER_TRAJECTORY * trajectories)
    return tuple(batch for part in parts for batch in _batches(part, totals[part]))


def _batches(part: str, total: int) -> Iterator[Batch]:
    size = BATCH.get(part, _BATCH)
    for first in range(0, total, size):
        yield Batch(part, first, min(size, total - first))


def drawn(part: str, index: int, subject: Subject) -> Any:
    """Return case `index` of a part: always the same one."""
    rng = np.random.default_rng([subject.seed, PARTS.index(part), index])
    if part == TRAJECTORIES:
        return draw_scene(rng)
    if part in ENGINE_LAWS:
        return ENGINE_LAWS[part].draw(rng)
    case = draw_case(rng, subject.largest_condition)
    return with_unequal_restitution(rng, case) if part == UNEQUAL else case


def residuals(part: str, case: Any, subject: Subject) -> tuple[dict[str, LawResidual], Run | None]:
    """Return the residuals of all laws of the part that apply, and the run if there is one."""
    if part == TRAJECTORIES:
        try:
            run = case.simulate()
        except IapbError:  # refused by name before the first step: nothing to judge
            return {}, None
        return dict(judge_run(run)), run
    if part in ENGINE_LAWS:
        return {part: ENGINE_LAWS[part].check(case, ENGINE_LAWS[part].ours)}, None
    laws = UNEQUAL_LAWS if part == UNEQUAL else LAWS
    tried = {name: residual_of(law, case, subject.resolver, subject.bounds)[0] for name, law in laws.items()}
    return {name: residual for name, residual in tried.items() if residual is not None}, None


def do_batch(batch: Batch, subject: Subject, progress: Callable[[int], None] | None = None) -> BatchOutcome:
    """Put every case of a batch to the laws of its part."""
    started, counts, found = time.perf_counter(), dict[str, LawCount](), list[Found]()
    with one_thread():
        for index in range(batch.first, batch.first + batch.count):
            case = drawn(batch.part, index, subject)
            results, run = residuals(batch.part, case, subject)
            for law, residual in results.items():
                one = one_count(law, residual)
                counts[law] = added(counts[law], one) if law in counts else one
                if not residual.passed and sum(one.law == law for one in found) < STORED_PER_LAW:
                    found.append(Found(law, batch.part, index, residual, case, run))
            if progress is not None:
                progress(index + 1 - batch.first)
    return BatchOutcome(tuple(counts.values()), tuple(found), time.perf_counter() - started)

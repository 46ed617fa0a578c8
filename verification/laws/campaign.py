"""The laws at length: parts of many cases in batches, each case from a seed of its own, so that any can be redrawn.

`plan` says which batches there are, `do_batch` does one and returns plain records; who stores them is not known here.
"""

from __future__ import annotations

import time
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from iapb.errors import IapbError
from iapb.run import Run
from reference.one_thread import one_thread
from verification.impacts import draw_case, with_unequal_restitution
from verification.laws.bounds import Bounds, LawResidual
from verification.laws.counterexample import Struck, strike
from verification.laws.engine_laws import ENGINE_LAWS
from verification.laws.impact_laws import LAWS, OF_ONE_CALL, UNEQUAL_LAWS
from verification.laws.kit import LawCount, RunningCount, residual_of
from verification.laws.resolver import Resolver
from verification.laws.scenes import draw_scene, draw_spatial_scene
from verification.laws.trajectory_laws import judge_run

IMPACTS, UNEQUAL, TRAJECTORIES, IN_SPACE = "impacts", "unequal restitution", "trajectories", "trajectories in space"
PARTS = (IMPACTS, UNEQUAL, TRAJECTORIES, *ENGINE_LAWS, IN_SPACE)  # the order enters the seeds: add at the end
SCENES = {TRAJECTORIES: draw_scene, IN_SPACE: draw_spatial_scene}
# Laws of one call are put to every impact. The others compare it with calls on variants of it, up to three and an SVD
# each; they are put to one impact in ONE_IN, each law to its own choice of them.
ONE_IN = 10
# Cases of a part for each impact or trajectory asked for, and cases per batch (a few seconds of work).
_SHARE = {UNEQUAL: 0.1, "truncation": 0.05, "device_limits": 0.05, "extremes": 0.1, "hand_port": 0.02}
_PER_TRAJECTORY = {IN_SPACE: 0.4, "group_splitting": 0.2, "device_port": 0.1}
BATCH = {IMPACTS: 4000, UNEQUAL: 4000, TRAJECTORIES: 50, IN_SPACE: 50, "group_splitting": 20, "device_port": 20}
_BATCH = 2000
# Counterexamples kept of each law and batch. All are counted, and all are kept unless a resolver breaks the law in more
# than one case in forty: then the first say what is wrong with it, and a million files would say no more.
STORED_PER_LAW = 100


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
    """A counterexample: the law it breaks, where it was drawn, the case, and the run of a scene or what was struck."""

    law: str
    part: str
    index: int
    residual: LawResidual
    case: Any
    run: Run | None = None
    struck: Struck | None = None


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
    totals |= {part: round(share * trajectories) for part, share in _PER_TRAJECTORY.items()}
    return tuple(batch for part in parts for batch in _batches(part, totals[part]))


def _batches(part: str, total: int) -> Iterator[Batch]:
    size = BATCH.get(part, _BATCH)
    for first in range(0, total, size):
        yield Batch(part, first, min(size, total - first))


def drawn(part: str, index: int, subject: Subject) -> Any:
    """Return case `index` of a part: always the same one."""
    rng = np.random.default_rng([subject.seed, PARTS.index(part), index])
    if part in SCENES:
        return SCENES[part](rng)
    if part in ENGINE_LAWS:
        return ENGINE_LAWS[part].draw(rng)
    case = draw_case(rng, subject.largest_condition)
    return with_unequal_restitution(rng, case) if part == UNEQUAL else case


def tried_laws(part: str, index: int) -> Iterator[str]:
    """Yield the impact laws that case `index` of a part is put to, the rarer ones by a hash of law and number."""
    for name in UNEQUAL_LAWS if part == UNEQUAL else LAWS:
        every = name.removeprefix("unequal_") in OF_ONE_CALL
        if every or zlib.crc32(f"{name} {index}".encode()) % ONE_IN == 0:
            yield name


def residuals(
    part: str, case: Any, subject: Subject, index: int | None = None
) -> tuple[dict[str, LawResidual], Run | None]:
    """Return the residuals of the laws of the part that apply, and the run if there is one.

    With the case's `index` an impact is put to the laws that it has been chosen for, without it to all.
    """
    if part in SCENES:
        try:
            run = case.simulate()
        except IapbError:  # refused by name before the first step: nothing to judge
            return {}, None
        return dict(judge_run(run)), run
    if part in ENGINE_LAWS:
        return {part: ENGINE_LAWS[part].check(case, ENGINE_LAWS[part].ours)}, None
    laws = UNEQUAL_LAWS if part == UNEQUAL else LAWS
    chosen = laws if index is None else tried_laws(part, index)
    tried = {name: residual_of(laws[name], case, subject.resolver, subject.bounds)[0] for name in chosen}
    return {name: residual for name, residual in tried.items() if residual is not None}, None


def do_batch(batch: Batch, subject: Subject, progress: Callable[[int], None] | None = None) -> BatchOutcome:
    """Put every case of a batch to the laws of its part."""
    started, counts, found = time.perf_counter(), dict[str, RunningCount](), list[Found]()
    with one_thread():
        for index in range(batch.first, batch.first + batch.count):
            case = drawn(batch.part, index, subject)
            results, run = residuals(batch.part, case, subject, index)
            for law, residual in results.items():
                kept = counts.setdefault(law, RunningCount()).add(residual)
                if not kept and sum(one.law == law for one in found) < STORED_PER_LAW:
                    struck = strike(batch.part, case, subject.resolver)
                    # replaced by itself: a copy without what its laws have worked out
                    found.append(Found(law, batch.part, index, residual, replace(case), run, struck))
            if progress is not None:
                progress(index + 1 - batch.first)
    counted = tuple(running.count(law) for law, running in counts.items())
    return BatchOutcome(counted, tuple(found), time.perf_counter() - started)

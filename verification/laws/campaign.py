"""Long campaigns of law checks: each part has many cases in batches, and each case has its own seed to redraw it.

`plan` returns the batches; `do_batch` computes one batch and returns plain records. This module stores nothing.
"""

from __future__ import annotations

import time
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from iapb.errors import IapbError
from iapb.run import Run
from reference.one_thread import one_thread
from verification.impacts import draw_case, with_unequal_restitution
from verification.laws.bounds import Bounds, LawCount, LawResidual
from verification.laws.counterexample import strike
from verification.laws.engine import ENGINE_LAWS
from verification.laws.equality import LAWS, OF_ONE_CALL, UNEQUAL_LAWS
from verification.laws.kit import residual_of
from verification.laws.resolver import Resolver
from verification.laws.scenes import draw_scene, draw_spatial_scene
from verification.laws.trajectories import judge_run

IMPACTS, UNEQUAL, TRAJECTORIES, IN_SPACE = "impacts", "unequal restitution", "trajectories", "trajectories in space"
PARTS = (IMPACTS, UNEQUAL, TRAJECTORIES, *ENGINE_LAWS, IN_SPACE)  # the seeds depend on the order: add at the end
SCENES = {TRAJECTORIES: draw_scene, IN_SPACE: draw_spatial_scene}
# Laws that need one call check every impact. The other laws also call the resolver on up to three variants of the
# impact, with an SVD each; each of them checks its own sample of one impact in ONE_IN.
ONE_IN = 10
# Cases of a part per requested impact or trajectory, and cases per batch (a few seconds of work).
_SHARE = {UNEQUAL: 0.1, "truncation": 0.05, "device_limits": 0.05, "extremes": 0.1, "hand_port": 0.02}
_PER_TRAJECTORY = {IN_SPACE: 0.4, "group_splitting": 0.2, "device_port": 0.1}
BATCH = {IMPACTS: 4000, UNEQUAL: 4000, TRAJECTORIES: 50, IN_SPACE: 50, "group_splitting": 20, "device_port": 20}
_BATCH = 2000
# Largest number of counterexamples stored per law and batch. All are counted. The limit matters only if a resolver
# breaks the law in more than one case in forty; then the first ones show the fault.
STORED_PER_LAW = 100


@dataclass(frozen=True)
class Subject:
    """The subject of a campaign: a resolver, its tolerances, the largest κ(M) of its impacts, the seed of all draws."""

    resolver: Resolver
    bounds: Bounds
    largest_condition: float
    seed: int = 0


@dataclass(frozen=True)
class Batch:
    """A batch of the cases first … first + count − 1 of a part."""

    part: str
    first: int
    count: int


@dataclass(frozen=True)
class Found:
    """A counterexample: the law, the part and index, the case, and the run of a scene or what `strike` returns."""

    law: str
    part: str
    index: int
    residual: LawResidual
    case: Any
    run: Run | None = None
    struck: dict[str, Any] | None = None


@dataclass(frozen=True)
class BatchOutcome:
    """Result of one batch."""

    counts: tuple[LawCount, ...]
    found: tuple[Found, ...]
    seconds: float


def plan(impacts: int, trajectories: int, parts: tuple[str, ...] = PARTS) -> tuple[Batch, ...]:
    """Return the batches for these numbers of impacts and trajectories; the other parts get numbers in proportion."""
    totals = {IMPACTS: impacts, TRAJECTORIES: trajectories}
    totals |= {part: round(share * impacts) for part, share in _SHARE.items()}
    totals |= {part: round(share * trajectories) for part, share in _PER_TRAJECTORY.items()}
    return tuple(Batch(part, first, min(size, totals[part] - first))
                 for part in parts for size in (BATCH.get(part, _BATCH),) for first in range(0, totals[part], size))


def drawn(part: str, index: int, subject: Subject) -> Any:
    """Return case `index` of a part; it is the same in every call."""
    rng = np.random.default_rng([subject.seed, PARTS.index(part), index])
    if part in SCENES:
        return SCENES[part](rng)
    if part in ENGINE_LAWS:
        return ENGINE_LAWS[part].draw(rng)
    case = draw_case(rng, subject.largest_condition)
    return with_unequal_restitution(rng, case) if part == UNEQUAL else case


def tried_laws(part: str, index: int) -> Iterator[str]:
    """Yield the impact laws that check case `index` of a part; a hash of law and index selects the sampled ones."""
    for name in UNEQUAL_LAWS if part == UNEQUAL else LAWS:
        if name.removeprefix("unequal_") in OF_ONE_CALL or zlib.crc32(f"{name} {index}".encode()) % ONE_IN == 0:
            yield name


def residuals(
    part: str, case: Any, subject: Subject, index: int | None = None
) -> tuple[dict[str, LawResidual], Run | None]:
    """Return the residuals of the applicable laws of the part, and the run if there is one.

    If `index` is given, only the laws that sample this impact check it; otherwise all laws do.
    """
    if part in SCENES:
        try:
            run = case.simulate()
        except IapbError:  # refused with a named error before the first step: nothing to judge
            return {}, None
        return dict(judge_run(run)), run
    if part in ENGINE_LAWS:
        return {part: ENGINE_LAWS[part].check(case, ENGINE_LAWS[part].ours)}, None
    laws = UNEQUAL_LAWS if part == UNEQUAL else LAWS
    chosen = laws if index is None else tried_laws(part, index)
    tried = {name: residual_of(laws[name], case, subject.resolver, subject.bounds)[0] for name in chosen}
    return {name: residual for name, residual in tried.items() if residual is not None}, None


def do_batch(batch: Batch, subject: Subject) -> BatchOutcome:
    """Check every case of a batch against the laws of its part."""
    started, counts, found = time.perf_counter(), dict[str, LawCount](), list[Found]()
    with one_thread():
        for index in range(batch.first, batch.first + batch.count):
            case = drawn(batch.part, index, subject)
            results, run = residuals(batch.part, case, subject, index)
            for law, residual in results.items():
                kept = counts.setdefault(law, LawCount(law)).add(residual)
                if not kept and sum(one.law == law for one in found) < STORED_PER_LAW:
                    struck = strike(batch.part, case, subject.resolver)
                    # replace() makes a copy without the cached answers of the laws
                    found.append(Found(law, batch.part, index, residual, replace(case), run, struck))
    return BatchOutcome(tuple(counts.values()), tuple(found), time.perf_counter() - started)

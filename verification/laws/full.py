"""The laws on many cases: each part has its own kind of case, and each case has its own seed, which
draws it again.

`plan` returns the batches of cases, and `judge_batch` judges one batch.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from iapb import resolve_impact
from iapb.errors import IapbError
from iapb.run import Run
from reference.one_thread import one_thread
from verification.impacts import ImpactCase, draw_case, with_unequal_restitution
from verification.laws.bounds import FACTORED, KIT, Bounds, LawCount, LawResidual
from verification.laws.counterexample import as_test, residual_of, shrink
from verification.laws.engine import ENGINE_LAWS
from verification.laws.equality import LAWS, OF_ONE_CALL, UNEQUAL_LAWS
from verification.laws.resolver import Resolver
from verification.laws.scenes import draw_scene, draw_spatial_scene
from verification.laws.trajectories import judge_run

IMPACTS = "impacts"
UNEQUAL = "unequal restitution"
TRAJECTORIES = "trajectories"
IN_SPACE = "trajectories in space"
PARTS = (
    IMPACTS,
    UNEQUAL,
    TRAJECTORIES,
    *ENGINE_LAWS,
    IN_SPACE,
)  # the seeds depend on the order: add at the end
SCENES = {TRAJECTORIES: draw_scene, IN_SPACE: draw_spatial_scene}
# Laws that need one call check every impact. The other laws also call the resolver on up to three
# variants of the impact, with an SVD each; each of them checks its own sample of one impact in
# ONE_IN.
ONE_IN = 10
# Cases of a part per requested impact or trajectory, and cases per batch (a few seconds of work).
_SHARE = {
    UNEQUAL: 0.1,
    "truncation": 0.05,
    "device_limits": 0.05,
    "extremes": 0.1,
}
_PER_TRAJECTORY = {IN_SPACE: 0.4, "group_splitting": 0.2}
BATCH = {
    IMPACTS: 4000,
    UNEQUAL: 4000,
    TRAJECTORIES: 50,
    IN_SPACE: 50,
    "group_splitting": 20,
}
_BATCH = 2000
ENGINE_CONDITION = 1e10  # largest κ(M) in tests of the engine
ANY_CONDITION = 1e8  # largest κ(M) in tests of any other resolver


@dataclass(frozen=True)
class Subject:
    """What is tested: a resolver, its tolerances, the largest κ(M) of its impacts, the seed of all
    draws."""

    resolver: Resolver
    bounds: Bounds
    largest_condition: float
    seed: int


def subject_of(resolver: Resolver, seed: int = 0) -> Subject:
    """Return the subject of a resolver; the engine's own has tighter tolerances and worse mass
    matrices."""
    if resolver is resolve_impact:
        return Subject(resolver, FACTORED, ENGINE_CONDITION, seed)
    return Subject(resolver, KIT, ANY_CONDITION, seed)


@dataclass(frozen=True)
class Batch:
    """A batch of the cases first … first + count − 1 of a part."""

    part: str
    first: int
    count: int


@dataclass(frozen=True)
class Found:
    """A case that breaks a law: the law, the part and index of the case, the case, and its run if
    it is a scene."""

    law: str
    part: str
    index: int
    case: Any
    run: Run | None


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
    return tuple(
        Batch(part, first, min(size, totals[part] - first))
        for part in parts
        for size in (BATCH.get(part, _BATCH),)
        for first in range(0, totals[part], size)
    )


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
    """Yield the impact laws that check case `index` of a part; a hash of law and index selects the
    sampled ones."""
    for name in UNEQUAL_LAWS if part == UNEQUAL else LAWS:
        if (
            name.removeprefix("unequal_") in OF_ONE_CALL
            or zlib.crc32(f"{name} {index}".encode()) % ONE_IN == 0
        ):
            yield name


def residuals(
    part: str, index: int, case: Any, subject: Subject
) -> tuple[dict[str, LawResidual], Run | None]:
    """Return the residual of each law that judges case `index` of a part, and its run if it is a
    scene."""
    if part in SCENES:
        try:
            run = case.simulate()
        except IapbError:  # refused with a named error before the first step: nothing to judge
            return {}, None
        return dict(judge_run(run)), run
    if part in ENGINE_LAWS:
        return {part: ENGINE_LAWS[part].check(case, ENGINE_LAWS[part].ours)}, None
    found: dict[str, LawResidual] = {}
    for law in tried_laws(part, index):
        residual = _residual(law, case, subject)
        if residual is not None:
            found[law] = residual
    return found, None


def _residual(law: str, case: ImpactCase, subject: Subject) -> LawResidual | None:
    return residual_of((LAWS | UNEQUAL_LAWS)[law], case, subject.resolver, subject.bounds)[0]


@one_thread()
def judge_batch(batch: Batch, subject: Subject) -> Outcome:
    """Judge every case of a batch by the laws of its part."""
    counts: dict[str, LawCount] = {}
    found: dict[str, Found] = {}
    for index in range(batch.first, batch.first + batch.count):
        case = drawn(batch.part, index, subject)
        judged, run = residuals(batch.part, index, case, subject)
        for law, residual in judged.items():
            passed = counts.setdefault(law, LawCount(law)).add(residual)
            if not passed and law not in found:
                without_answers = replace(case)  # a copy without the cached answers of the laws
                found[law] = Found(law, batch.part, index, without_answers, run)
    return Outcome(batch.part, tuple(counts.values()), tuple(found.values()))


def summed(outcomes: Iterable[Outcome]) -> tuple[dict[str, dict[str, LawCount]], list[Found]]:
    """Return the counts of all batches, by part and law, and of each part and law the first case
    that breaks it."""
    counts: dict[str, dict[str, LawCount]] = {}
    found: dict[tuple[str, str], Found] = {}
    for outcome in outcomes:
        sums = counts.setdefault(outcome.part, {})
        for count in outcome.counts:
            sums[count.law] = sums[count.law] + count if count.law in sums else count
        for one in outcome.found:
            found.setdefault((one.part, one.law), one)
    return counts, list(found.values())


_DRAWN_AGAIN = """\
from iapb import resolve_impact
from verification.laws.full import drawn, residuals, subject_of


def test_{law}():
    subject = subject_of(resolve_impact, seed={seed})
    case = drawn({part!r}, {index}, subject)
    residual = residuals({part!r}, {index}, case, subject)[0][{law!r}]
    assert residual.passed, residual"""


@one_thread()
def as_pytest(found: Found, subject: Subject) -> str:
    """Return a counterexample as source code of a test: an impact shrunk, in numbers; another case
    drawn again."""
    if found.part not in (IMPACTS, UNEQUAL):
        return _DRAWN_AGAIN.format(
            law=found.law, part=found.part, index=found.index, seed=subject.seed
        )

    def breaks(case: ImpactCase) -> bool:
        residual = _residual(found.law, case, subject)
        return residual is not None and not residual.passed

    return as_test(shrink(found.case, breaks), found.law, subject.bounds, subject.resolver)

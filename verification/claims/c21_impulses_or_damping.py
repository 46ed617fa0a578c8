"""C21: impulse forces make contact more stable than raising the damping does (section VII)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from verification.claims.claim import Claim
from verification.finding import Column, Region, Row, Table
from verification.stability.maps import PAPER_DAMPING, StabilityMap, grid, loops, stability_maps, walls
from verification.stability.sampled_wall import LAWS, PENALTY, touch_walls

if TYPE_CHECKING:
    from verification.claims.study import Study
    from verification.stability.maps import StabilityMap

SAME, EQUAL_GAIN, BEST = (
    "penalties, same damping", "penalties, damping with the impulse's force", "penalties, best larger damping"
)  # fmt: skip

FRESH = 5  # number of walls per loop drawn to confirm a region

COLUMNS = (
    Column("against", part=True),
    Column("rate", "Hz", condition=True),
    Column("delay", "samples", condition=True),
    Column("device damping", "N s/m", condition=True),
    Column("stiffness", "N/m", condition=True),
    Column("impulses settle after", "s"),
    Column("penalty settles after", "s"),
    Column("at a damping of", "N s/m"),
)


def cases(study: Study) -> list[tuple[StabilityMap, StabilityMap]]:
    """One pair of stability maps per loop: with penalties, and with impulses."""
    maps = stability_maps(study.depth)
    return list(zip(maps[::2], maps[1::2], strict=True))  # the maps of the two laws of a loop follow each other


def draw(study: Study, region: Region) -> list[tuple[StabilityMap, StabilityMap]]:
    """Draw fresh walls inside a region for every loop, uniformly in the logarithm of the stiffness."""
    stiffness, damping = grid(study.depth)
    low, high = region.ends("stiffness", stiffness.tolist())
    rng, found = np.random.default_rng(study.seed), []
    for loop in loops():
        fresh = np.array([float(f"{low * (high / low) ** share:.4g}") for share in rng.random(FRESH)])
        K, B = walls(fresh, damping)
        penalty, impulses = (StabilityMap(loop, law, fresh, damping, touch_walls(loop, K, B, law)) for law in LAWS)
        found.append((penalty, impulses))
    return found


def trials(study: Study, case: tuple[StabilityMap, StabilityMap]) -> Iterator[dict[str, Any]]:
    """Yield the trials of the walls of one loop: impulses at the paper's damping against three penalties."""
    penalty, impulses = case
    loop, raised = penalty.loop, penalty.damping[penalty.damping >= PAPER_DAMPING]
    times = np.array([penalty.settling(damping) for damping in raised])
    best, ours = times.argmin(axis=0), impulses.settling(PAPER_DAMPING)
    gain, sustained = _equal_gain(penalty)
    for i, K in enumerate(penalty.stiffness):
        rivals = {SAME: (times[0, i], PAPER_DAMPING), EQUAL_GAIN: (sustained[i], gain),
                  BEST: (times[best[i], i], raised[best[i]])}  # fmt: skip
        for against, (theirs, damping) in rivals.items():
            yield {
                "against": against, "rate": loop.rate, "delay": loop.delay, "device damping": loop.device_damping,
                "stiffness": float(K), "impulses settle after": float(ours[i]), "penalty settles after": float(theirs),
                "at a damping of": float(damping),
            }  # fmt: skip


def _equal_gain(penalty: StabilityMap) -> tuple[float, np.ndarray]:
    """Return the damping whose force at first contact equals the impulse's, (1 + e) m/T, and the settling times [s]."""
    loop = penalty.loop
    gain = (1.0 + loop.restitution) * loop.mass / loop.step
    contact = touch_walls(loop, penalty.stiffness, np.full_like(penalty.stiffness, gain), PENALTY)
    return gain, np.where(contact.settled, contact.settling_time, np.inf)


def holds(row: Row) -> bool | None:
    """Return whether impulses settle no later than the rival penalty; None if neither settles."""
    ours, theirs = row["impulses settle after"], row["penalty settles after"]
    return None if np.isinf(ours) and np.isinf(theirs) else bool(ours <= theirs)


def finding(table: Table) -> str:
    """Return the result in words, with numbers."""
    texts = []
    for rival in (SAME, EQUAL_GAIN, BEST):
        decided = [row for row in table.where(against=rival).records() if holds(row) is not None]
        count = sum(np.isinf(row["penalty settles after"]) for row in decided)
        texts.append(f"{count} of {len(decided)} with {rival}")
    return ("Walls at which the mass settles with impulses at the paper's damping of 50 N s/m but never with the "
            f"rival, of those at which it settles at all: {'; '.join(texts)}.")  # fmt: skip


CLAIM = Claim(
    id="C21",
    statement="Impulse forces make contact more stable than raising the damping does.",
    place="Section VII",
    quantity="Settling time of a mass of 2 kg that the hand pushes against a sampled wall; its motion between samples "
    "is exact. Impulses at the paper's damping are compared with penalties at the same damping, at the damping (1 + e) "
    "m/T whose force at first contact equals the impulse's, and at the best of all larger dampings, chosen afterwards "
    "for each wall.",
    tolerance="None: the law with the smaller time wins. A wall cannot tell if the mass settles with neither.",
    columns=COLUMNS,
    cases=cases,
    trials=trials,
    holds=holds,
    finding=finding,
    draw=draw,
    axes=("stiffness", "rate", "against"),
)

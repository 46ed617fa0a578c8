"""Region: the bounds on one or two conditions inside which a claim holds; how it is found and
confirmed.

A region is found on one half of the trials. It is confirmed if the claim holds in all trials of the
other half that lie inside it and in all fresh trials drawn inside it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from verification.table import Column, Row, Table

# Least number of trials that confirm a region. If the claim were wrong in a quarter of the region,
# ten trials in a row would hold with probability 0.05 (0.74¹⁰); if it were wrong in half, with
# probability 1/1024. A single failure counts.
LEAST_CONFIRMING = 10
SPLIT_SEED = 20050601  # decides which half of the trials is searched; the month the paper appeared
_MOST_ENDS = 8  # above the number of ends of two intervals
_DECADES = 1e3  # a condition with a larger ratio of its ends is measured in decades


@dataclass(frozen=True)
class Region:
    """Region in which a part holds: bounds on one or two conditions. The claim holds in every trial
    inside.

    bounds : condition, its unit, lowest and highest value, which may be equal; None if the region
        extends to the end of the tested range
    searched : number of trials inside, from the half in which the region was found; others : from
        the other half
    fresh : number of trials drawn for the confirmation
    share : share of the tested range that the region covers, by length or by decades; 0 for a
        single value
    """

    bounds: tuple[tuple[str, str, float | None, float | None], ...]
    searched: int = 0
    others: int = 0
    fresh: int = 0
    share: float = 0.0

    def contains(self, row: Row) -> bool:
        """Whether a trial lies inside the region or on its bounds."""
        return all(
            (low is None or row[key] >= low) and (high is None or row[key] <= high)
            for key, _, low, high in self.bounds
        )

    def ends(self, key: str, tested: Sequence[float]) -> tuple[float, float]:
        """Return the bounds of a condition; the end of the tested range replaces a missing
        bound."""
        low, high = next(
            ((low, high) for name, _, low, high in self.bounds if name == key), (None, None)
        )
        return min(tested) if low is None else low, max(tested) if high is None else high

    def __str__(self) -> str:
        """The bounds, such as "tilt ≤ 0.859°"; angles are in degrees."""
        return " and ".join(_bound(*bound) for bound in self.bounds)


def _bound(key: str, unit: str, low: float | None, high: float | None) -> str:
    key = key.replace("_", " ")
    angle = unit == "rad"
    scale = math.degrees(1.0) if angle else 1.0
    least = "" if low is None else _inward(low * scale, math.ceil)
    most = "" if high is None else _inward(high * scale, math.floor)
    if low == high:
        said = f"{key} = {least}"
    elif not most:
        said = f"{key} ≥ {least}"
    else:
        said = f"{least} ≤ {key} ≤ {most}" if least else f"{key} ≤ {most}"
    return f"{said}°" if angle else f"{said} {unit}".rstrip()


def _inward(end: float, rounded: Callable[[float], int]) -> str:
    """Return a bound with at most three digits; one that has more is rounded into the region."""
    digits = 2 - math.floor(math.log10(abs(end))) if end else 0
    return (
        f"{end:g}" if len(f"{end:g}") <= 5 else f"{rounded(end * 10.0**digits) / 10.0**digits:.3g}"
    )


def confirmed(trials: Table, fresh: Callable[[Region], Table] | None) -> Region | None:
    """Return the region that the other half and fresh trials confirm; None if there is none.

    If the other half contradicts the region, both halves are searched; then only fresh trials can
    confirm a region.
    """
    searched = np.zeros(len(trials.rows), np.bool_)
    searched[np.random.default_rng(SPLIT_SEED).permutation(len(trials.rows))[::2]] = True
    region = search_region(trials.only(searched))
    if region is None and fresh is None:  # all of this half may hold: search the other
        searched = ~searched
        region = search_region(trials.only(searched))
    others = None if region is None else _held_inside(region, trials.only(~searched))
    if fresh is None:
        if region is None or others is None or others < LEAST_CONFIRMING:
            return None
        return replace(region, others=others)
    if others is None:
        region = search_region(trials)
    if region is None:
        return None
    drawn = fresh(region).holds
    if False in drawn or drawn.count(True) < LEAST_CONFIRMING:
        return None
    return replace(region, others=others or 0, fresh=drawn.count(True))


def _held_inside(region: Region, trials: Table) -> int | None:
    """Return in how many trials inside the region the claim holds; None if it fails in one."""
    inside = trials.only(region.contains(row) for row in trials.records()).holds
    return None if False in inside else inside.count(True)


def search_region(trials: Table) -> Region | None:
    """Return the region, bounded in one or two conditions, with most trials and no failure; None if
    there is none.

    The search tries every value and every interval between values of a condition, alone and with
    those of every other condition. Among regions with equally many trials it takes the one with the
    fewest bounds, then the first in the order of the columns. It adds a second condition only if
    the region then keeps at least 1.5 times as many trials, because the simpler region generalizes
    better.
    """
    scales = [
        scale
        for column in trials.of_kind(trials.kinds.conditions)
        if (scale := _intervals(column, trials))
    ]
    everything = [_Interval("", "", None, None, 1.0, np.ones(len(trials.rows), np.bool_))]
    alone, together = (
        max(
            (_best(trials, *pair) for pair in pairs),
            default=(0, 0, ()),
            key=lambda found: found[:2],
        )
        for pairs in (((scale, everything) for scale in scales), combinations(scales, 2))
    )
    kept, _, chosen = together if 2 * together[0] >= 3 * alone[0] else alone
    if not kept or not chosen:
        return None
    share = math.prod(interval.share for interval in chosen)
    return Region(tuple((x.key, x.unit, x.low, x.high) for x in chosen), kept, share=share)


class _Interval(NamedTuple):
    """Values of one condition between `low` and `high`; None means no bound on that side."""

    key: str
    unit: str
    low: float | None
    high: float | None
    share: float
    inside: np.ndarray  # whether each trial lies in it

    @property
    def ends(self) -> int:
        return len({self.low, self.high} - {None})


def _best(
    trials: Table, first: list[_Interval], second: list[_Interval]
) -> tuple[int, int, tuple[_Interval, ...]]:
    """Number of trials that the best pair of intervals keeps without a failure, minus the number of
    its bounds, and those of the two with a bound."""
    held = [outcome is True for outcome in trials.holds]
    failed = [outcome is False for outcome in trials.holds]
    inside = np.array([one.inside for one in first], np.int64)
    other = np.array([one.inside for one in second], np.int64).T
    kept = (inside * held) @ other
    wrong = (inside * failed) @ other
    ends = np.add.outer(
        [interval.ends for interval in first], [interval.ends for interval in second]
    )
    score = np.where(wrong == 0, _MOST_ENDS * kept - ends, -_MOST_ENDS)
    i, j = np.unravel_index(int(score.argmax()), score.shape)
    found = int(kept[i, j]) if wrong[i, j] == 0 else 0
    return (
        found,
        -int(ends[i, j]),
        tuple(interval for interval in (first[i], second[j]) if interval.ends),
    )


def _intervals(column: Column, trials: Table) -> list[_Interval]:
    """All values of a condition and all intervals between two of them, including the unbounded one;
    empty if a value is no number, or if there is only one value."""
    values = trials[column.key]
    if not all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        return []
    seen = sorted(set(values))
    places = np.array(values, float)
    if len(seen) < 2:
        return []
    scale = math.log10 if seen[0] > 0 and seen[-1] / seen[0] >= _DECADES else float
    length = scale(seen[-1]) - scale(seen[0])
    return [
        _Interval(
            column.key,
            column.unit,
            low if i or i == j else None,
            high if j < len(seen) - 1 or i == j else None,
            (scale(high) - scale(low)) / length,
            (places >= low) & (places <= high),
        )
        for i, low in enumerate(seen)
        for j, high in enumerate(seen)
        if i <= j
    ]

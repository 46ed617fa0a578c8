"""Timing for all studies: a warm-up call before each sample, contestants in random order, CPU time
of this thread.

The CPU time of a thread excludes other processes. However, other processes and the previous
contestant replace the contents of the caches. Every round therefore calls all contestants in a new
random order, and linear algebra runs on one thread. Ratios compare samples of the same run.
Compiled code is timed within compiled code: if a call has a method `repeated(times)`, that method
runs the loop, so the overhead of calls from Python is excluded.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from reference.one_thread import one_thread

Key = TypeVar("Key")
Result = TypeVar("Result")
Call = Callable[[], object]

LEAST_ROUNDS = 3  # for slow contestants, too
_SHORTEST_SAMPLE = (
    1e-3  # seconds: faster calls are repeated within a sample, the clock resolves 1e-7
)
_WARMED = 2e-2  # seconds: cold caches hardly affect longer samples, so those get no warm-up call


@dataclass(frozen=True)
class Times:
    """Seconds per call of one contestant, one sample per round. Without samples every statistic is
    NaN."""

    samples: tuple[float, ...] = ()

    @property
    def lower(self) -> float:
        """Lower quartile."""
        return self.quantile(0.25)

    @property
    def median(self) -> float:
        """Median."""
        return self.quantile(0.5)

    @property
    def upper(self) -> float:
        """Upper quartile."""
        return self.quantile(0.75)

    def quantile(self, share: float) -> float:
        """Return the quantile of the samples at `share` in [0, 1], interpolated."""
        return float(np.quantile(self.samples, share)) if self.samples else np.nan

    def over(self, other: Times) -> Times:
        """Return the ratio of these samples to those of another contestant, round by round."""
        return Times(
            tuple(ours / theirs for ours, theirs in zip(self.samples, other.samples, strict=True))
        )


def timed(work: Callable[[], Result]) -> tuple[Result, float]:
    """Return the result of `work` and the CPU time of this thread that it took [s]."""
    started = time.thread_time()
    result = work()
    return result, time.thread_time() - started


def seconds(call: Call, times: int = 1) -> float:
    """Return the mean CPU time per call [s] over `times` calls."""
    repeated = getattr(call, "repeated", None)
    started = time.thread_time()
    if repeated is not None:
        repeated(times)
    else:
        for _ in range(times):
            call()
    return (time.thread_time() - started) / times


def sampler(call: Call) -> Callable[[], float]:
    """Return a contestant for `take_turns`. One sample repeats `call` until the clock resolves it.

    The same number of warm-up calls precedes each sample of less than 0.02 s: after another
    contestant has run, the caches need many calls to fill. The first call of all does not count
    when the number of calls is chosen, because it loads machine code.
    """
    call()
    times = 1
    while (spent := seconds(call, times) * times) < _SHORTEST_SAMPLE:
        times *= 4

    def sample() -> float:
        if spent < _WARMED:
            seconds(call, times)
        return seconds(call, times)

    return sample


def take_turns(
    contestants: Mapping[Key, Callable[[], float]],
    rounds: int,
    *,
    warm: bool = True,
    enough: float = np.inf,
) -> dict[Key, Times]:
    """Sample every contestant once per round, in a new random order each round.

    Parameters
    ----------
    contestants : functions that return the seconds of one sample, such as `sampler(call)` or a
        function that does its setup before it starts the clock
    warm : whether one uncounted round goes first; False if all contestants have just run
    enough : a contestant stops after LEAST_ROUNDS rounds once its samples add up to more than this
        [s]
    """
    found: dict[Key, list[float]] = {key: [] for key in contestants}
    order = np.random.default_rng(0)
    with one_thread():
        for turn in range(rounds + warm):
            keys = list(found)
            for key in (keys[k] for k in order.permutation(len(keys))):
                taken = found[key]
                if len(taken) >= LEAST_ROUNDS and sum(taken) > enough:
                    continue
                spent = contestants[key]()
                if turn >= warm:
                    taken.append(spent)
    return {key: Times(tuple(samples)) for key, samples in found.items()}

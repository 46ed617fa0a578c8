"""The one way to time: a warm sample first, contestants in random order, the processor time of this thread.

Other processes are not in a thread's time. They do empty caches, and so does the contestant that ran before: so every
round calls all contestants in a new random order, and linear algebra runs on one thread. Ratios are made within one
run. Compiled code is timed within compiled code: a call that has a method `repeated(times)` repeats itself there, and
no call from Python is counted.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from reference.one_thread import one_thread
from verification.finding import Column, Failure, attempt

Key = TypeVar("Key")
Result = TypeVar("Result")
Call = Callable[[], object]

LEAST_ROUNDS = 3  # even of what takes long
_SHORTEST_SAMPLE = 1e-3  # seconds: faster calls are repeated within a sample, the clock resolves 1e-7
_WARMED = 2e-2  # seconds: what takes longer feels cold caches too little for a call more


@dataclass(frozen=True)
class Times:
    """Seconds per call of one contestant, a sample per round; statistics of no samples are NaN."""

    samples: tuple[float, ...] = ()

    @property
    def rounds(self) -> int:
        """Number of samples."""
        return len(self.samples)

    @property
    def least(self) -> float:
        """Smallest sample."""
        return self.quantile(0.0)

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

    @property
    def largest(self) -> float:
        """Largest sample."""
        return self.quantile(1.0)

    def quantile(self, share: float) -> float:
        """Return the sample below which this share of the samples lies, interpolated."""
        return float(np.quantile(self.samples, share)) if self.samples else np.nan

    def over(self, other: Times) -> Times:
        """Return the ratio to another contestant, round by round."""
        return Times(tuple(ours / theirs for ours, theirs in zip(self.samples, other.samples, strict=True)))


TIME_COLUMNS = (
    Column("time", "µs", timed=True),
    Column("lower quartile", "µs", timed=True),
    Column("upper quartile", "µs", timed=True),
)


def time_cells(times: Times) -> dict[str, float]:
    """Return the cells of TIME_COLUMNS."""
    return {"time": 1e6 * times.median, "lower quartile": 1e6 * times.lower, "upper quartile": 1e6 * times.upper}


def timed(work: Callable[[], Result]) -> tuple[Result, float]:
    """Return what `work` returns, and the processor time of this thread that it took [s]."""
    started = time.thread_time()
    result = work()
    return result, time.thread_time() - started


def seconds(call: Call, times: int = 1) -> float:
    """Return the seconds per call, over `times` calls."""
    repeated = getattr(call, "repeated", None)
    started = time.thread_time()
    if repeated is not None:
        repeated(times)
    else:
        for _ in range(times):
            call()
    return (time.thread_time() - started) / times


def sampler(call: Call) -> Callable[[], float]:
    """Return a contestant for `take_turns`: `call`, as often in one sample as the clock needs, and before it as often.

    One warm call is not enough: after another contestant has run, the caches fill over many. Nor does the very first
    call say how many a sample needs: it loads machine code.
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
    contestants: Mapping[Key, Callable[[], float]], rounds: int, *, warm: bool = True, enough: float = np.inf,
    failures: list[Failure] | None = None, name: Callable[[Key], str] = str,
    progress: Callable[[int, int], None] | None = None,
) -> dict[Key, Times]:
    """Sample every contestant once per round, in a new random order each round.

    Parameters
    ----------
    contestants : functions that return the seconds of one sample, such as `sampler(call)` or one that sets up
        something before it starts the clock
    warm : whether a round that does not count goes first; False where all have just run
    enough : a contestant that has run so many seconds and LEAST_ROUNDS rounds takes no further turns
    failures : receives the contestants that raise, as `attempt` does; they are left out of what is returned
    name : of a contestant in a failure
    progress : called with (rounds done, rounds)
    """
    found: dict[Key, list[float]] = {key: [] for key in contestants}
    order = np.random.default_rng(0)
    with one_thread():
        for turn in range(rounds + warm):
            going = list(found)
            for key in (going[k] for k in order.permutation(len(going))):
                taken = found[key]
                if len(taken) >= LEAST_ROUNDS and sum(taken) > enough:
                    continue
                spent = attempt(name(key), contestants[key], failures)
                if spent is None:
                    del found[key]
                elif turn >= warm:
                    taken.append(spent)
            if progress is not None:
                progress(turn + (not warm), rounds)
    return {key: Times(tuple(samples)) for key, samples in found.items()}

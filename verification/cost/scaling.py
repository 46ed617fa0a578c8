"""Scaling laws: time of the impact against contacts and coordinates, with fitted exponents; by the thread's clock."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from reference.one_thread import one_thread
from verification.cost.kernels import factored_loop, printed_impact, quartiles, random_impact
from verification.cost.measure import Quartiles
from verification.finding import Failure, attempt

CONTACTS = (50, 100, 200, 500, 1000, 2000, 5000)  # at d = 12
COORDINATES = (3, 6, 12, 24, 48, 96)  # with 60 contacts
PRINTED_UP_TO = 500  # contacts: beyond, one pseudo-inverse takes seconds
_ROUNDS = 15


@dataclass(frozen=True)
class Timing:
    """One method at one size: d coordinates, c contacts."""

    method: str
    coordinates: int
    contacts: int
    seconds: Quartiles


def scaling(
    rounds: int = _ROUNDS, progress: Callable[[int, int], None] | None = None, failures: list[Failure] | None = None
) -> tuple[Timing, ...]:
    """Time the factored impact, and the printed formula where that ends, over contacts and over coordinates.

    All sizes take their turns in every round, so that a slow minute of the machine bends no curve.
    """
    sizes = [(12, c) for c in CONTACTS] + [(d, 60) for d in COORDINATES if d != 12]
    with one_thread():
        calls = {(method, d, c): call for d, c in sizes for method, call in _calls(d, c).items()}
        times: dict[tuple[str, int, int], list[float]] = {size: [] for size in calls}
        for done in range(rounds + 1):
            for size in tuple(times):
                name = "{}, d = {}, c = {}".format(*size)
                seconds = attempt(name, partial(_seconds, calls[size]), failures)
                if seconds is None:
                    del times[size]
                elif done:  # the first round warms up
                    times[size].append(seconds)
            if progress is not None:
                progress(done, rounds)
    return tuple(Timing(*size, quartiles(found)) for size, found in times.items())


def _seconds(call: Callable[[], object]) -> float:
    started = time.thread_time()
    call()
    return time.thread_time() - started


def _calls(d: int, c: int) -> dict[str, Callable[[], object]]:
    mass, rows, v = random_impact(d, c, np.random.default_rng([d, c]))
    found: dict[str, Callable[[], object]] = {"factored": factored_loop(mass, rows, v, 1)}
    if c <= PRINTED_UP_TO:
        found["gram_pinv"] = lambda: printed_impact(mass, rows, v)
    return found


def exponent(timings: Sequence[Timing], method: str, axis: str) -> float:
    """Slope of log(time) over log(axis), axis "contacts" at d = 12 or "coordinates" with 60 contacts."""
    fixed, value = ("coordinates", 12) if axis == "contacts" else ("contacts", 60)
    chosen = [timing for timing in timings if timing.method == method and getattr(timing, fixed) == value]
    sizes = [getattr(timing, axis) for timing in chosen]
    return float(np.polyfit(np.log(sizes), np.log([timing.seconds.median for timing in chosen]), 1)[0])

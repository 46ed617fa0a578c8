"""Growth of one impact's time with contacts and coordinates; largest number of contacts within 1 ms (claim C19)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from reference.one_thread import one_thread
from verification.clock import TIME_COLUMNS, sampler, seconds, take_turns, time_cells
from verification.cost.calls import PRINTED, Call, KernelCall, printed_call, random_impact
from verification.finding import Column, Failure, Table, attempt, table_of

FACTORED = "factored"  # the compiled kernel
SIZES = (
    *((12, c) for c in (50, 60, 100, 200, 300, 500, 1000, 2000, 5000)),
    *((d, 60) for d in (3, 6, 24, 48, 96)),
)  # (d, c)
PRINTED_UP_TO = 500  # largest number of contacts for the printed formula: with more, one pseudo-inverse takes seconds
_ROUNDS = 15

SIZE_COLUMNS = (Column("coordinates", condition=True), Column("contacts", condition=True))
_NOTE = ("Random impacts with rows of rank two thirds of d. The nine hard impacts of a size (Accuracy against time) "
         "have other ranks, and other times.")
SCALING_COLUMNS = (Column("method", condition=True), *SIZE_COLUMNS, *TIME_COLUMNS)


def scaling(
    rounds: int = _ROUNDS, progress: Callable[[int, int], None] | None = None, failures: list[Failure] | None = None,
    sizes: tuple[tuple[int, int], ...] = SIZES,
) -> Table:
    """Time the factored impact and the printed formula, over contacts and over coordinates.

    The printed formula is timed up to PRINTED_UP_TO contacts. Every round times all sizes, so that a temporary slowdown
    of the machine affects all sizes alike.
    """
    wanted = [(method, d, c) for d, c in sizes for method in (FACTORED, PRINTED)
              if method == FACTORED or c <= PRINTED_UP_TO]  # fmt: skip
    with one_thread():
        made = {size: attempt(_name(size), partial(_sampler, *size), failures) for size in wanted}
        calls = {size: call for size, call in made.items() if call is not None}
        times = take_turns(calls, rounds, failures=failures, name=_name, progress=progress)
    return table_of(
        SCALING_COLUMNS,
        ({"method": method, "coordinates": d, "contacts": c, **time_cells(taken)}
         for (method, d, c), taken in times.items()), digits=3, note=_NOTE,
    )  # fmt: skip


def _name(size: tuple[str, int, int]) -> str:
    return "{}, d = {}, c = {}".format(*size)


def _sampler(method: str, d: int, c: int) -> Callable[[], float]:
    return sampler(_call(method, d, c))


def _call(method: str, d: int, c: int) -> Call:
    case = random_impact(d, c, np.random.default_rng([d, c]))
    call = KernelCall(case) if method == FACTORED else printed_call(case)
    call()  # compiles the kernel and touches its arrays
    return call


def exponent(table: Table, method: str, axis: str) -> float:
    """Return the slope of log(time) over log(axis); axis is "contacts" at d = 12, or "coordinates" at 60 contacts."""
    return power_law(*_along(table, method, axis))


def _along(table: Table, method: str, axis: str) -> tuple[list[float], list[float]]:
    held = {"coordinates": 12} if axis == "contacts" else {"contacts": 60}
    chosen = table.where(method=method, **held)
    return chosen.column(axis), chosen.column("time")


def power_law(sizes: Sequence[float], values: Sequence[float]) -> float:
    """Return the slope of log(value) over log(size)."""
    return float(np.polyfit(np.log(sizes), np.log(values), 1)[0])


def steepest(sizes: Sequence[float], values: Sequence[float]) -> tuple[float, float, float]:
    """Return the two neighbouring sizes between which log(value) over log(size) is steepest, and the slope there."""
    pairs = sorted(zip(sizes, values, strict=True))
    slopes = [(power_law([low[0], high[0]], [low[1], high[1]]), low[0], high[0])
              for low, high in pairwise(pairs)]  # fmt: skip
    slope, low, high = max(slopes)
    return low, high, slope


def fitted(table: Table) -> Table:
    """Return the fitted exponents, one row per method and axis."""
    columns = (Column("method", condition=True), Column("axis", condition=True), Column("exponent", timed=True),
               Column("steepest from", timed=True), Column("to", timed=True), Column("there", timed=True))
    rows = tuple((method, axis, exponent(table, method, axis), *steepest(*_along(table, method, axis)))
                 for method in (FACTORED, PRINTED) for axis in ("contacts", "coordinates"))  # fmt: skip
    return Table(columns, rows, digits=3, note="Least squares of log time over log size; there: the exponent between "
                                               "the two neighbouring sizes where it is largest.")


DEADLINE = 1e-3  # [s] one step at the haptic rate of 1 kHz
CALLS, ALLOWED = 1000, 1  # calls of one trial, and the number of late calls allowed: 99.9 % are in time
_ATTEMPTS = 3  # largest number of attempts of a trial, because other processes can only make calls slower
COORDINATES = (3, 6, 12, 30)
CONTACTS = (6, 12, 30, 60, 120, 300, 600, 1200, 3000, 6000, 12000, 30000)
TITLES = {FACTORED: "factored", PRINTED: "the printed formula"}
RATE_COLUMNS = (
    Column("method", condition=True, part=True),
    *SIZE_COLUMNS,
    Column("late calls", "of 1000", timed=True),
    Column("time", "µs", timed=True),
)


def haptic_rate(
    coordinates: tuple[int, ...] = COORDINATES, contacts: tuple[int, ...] = CONTACTS, calls: int = CALLS,
    progress: Callable[[int, int], None] | None = None, failures: list[Failure] | None = None,
) -> Table:
    """Test both methods at each number of coordinates and increase the contacts until more than ALLOWED calls are late.

    The table has one row per trial: the number of calls beyond the deadline and the median time of a call, in the first
    attempt in time or else in the last attempt. An attempt ends when more than ALLOWED calls are late.

    Parameters
    ----------
    coordinates, contacts : sizes d and c; the rank of the rows is two thirds of d
    calls : number of calls in each attempt
    """
    records: list[dict[str, Any]] = []
    with one_thread():
        for done, d in enumerate(coordinates, start=1):
            for method, title in TITLES.items():
                for c in contacts:
                    found = attempt(f"{c} contacts in {d} coordinates by {title}",
                                    partial(_trial, method, d, c, calls), failures)  # fmt: skip
                    if found is None:
                        continue
                    late, time = found
                    records.append({"method": title, "coordinates": d, "contacts": c, "late calls": late,
                                    "time": 1e6 * time})  # fmt: skip
                    if late > ALLOWED:
                        break
            if progress is not None:
                progress(done, len(coordinates))
    return table_of(RATE_COLUMNS, records)


def most_contacts(trials: Table) -> dict[str, dict[int, int]]:
    """Return the largest number of contacts in time, by method and coordinates; 0 if no size is in time."""
    most: dict[str, dict[int, int]] = {}
    for row in trials.records():
        best = most.setdefault(row["method"], {})
        in_time = row["contacts"] if row["late calls"] <= ALLOWED else 0
        best[row["coordinates"]] = max(best.get(row["coordinates"], 0), in_time)
    return most


def _trial(method: str, d: int, c: int, calls: int) -> tuple[int, float]:
    call = _call(method, d, c)
    for _ in range(_ATTEMPTS):
        late, median = _late_calls(call, calls)
        if late <= ALLOWED:
            break
    return late, median


def _late_calls(call: Call, calls: int) -> tuple[int, float]:
    """Return the number of late calls and the median time [s]; stop when more than ALLOWED calls are late."""
    late, times = 0, []
    for _ in range(calls):
        times.append(seconds(call))
        late += times[-1] > DEADLINE
        if late > ALLOWED:
            break
    return late, float(np.median(times))

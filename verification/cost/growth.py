"""Growth of one impact's time with contacts and coordinates; largest number of contacts within a
step (claim C19)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import pairwise

import numpy as np

from reference.one_thread import one_thread
from verification.check import Check, Study
from verification.clock import TIMES, limited, sampler, seconds, take_turns, time_cells
from verification.cost.calls import PRINTED, Call, kernel_call, printed_call
from verification.cost.problems import random_impact
from verification.finding import Failure, Part, attempt
from verification.table import Row, Table

FACTORED = "factored"  # the compiled kernel
SIZES = (
    *((12, c) for c in (50, 60, 100, 200, 300, 500, 1000, 2000, 5000)),
    *((d, 60) for d in (3, 6, 24, 48, 96)),
)  # (d, c)
# largest number of contacts for the printed formula: with more, one pseudo-inverse takes seconds
PRINTED_UP_TO = 500
FACTORS = {
    60: 10.0,
    300: 100.0,
}  # contacts at 12 coordinates -> target factor by which the printed formula is slower
LARGEST_EXPONENT = 1.1  # target, over contacts


def scaling(study: Study, sizes: Sequence[tuple[int, int]]) -> list[Row]:
    """Time the factored impact and the printed formula, over contacts and over coordinates.

    The printed formula is timed up to PRINTED_UP_TO contacts. Every round times all sizes, so that
    a temporary slowdown of the machine affects all sizes alike.
    """
    wanted = [
        (method, d, c)
        for d, c in sizes
        for method in (FACTORED, PRINTED)
        if method == FACTORED or c <= PRINTED_UP_TO
    ]
    name = "{0[0]}, d = {0[1]}, c = {0[2]}".format
    with one_thread():
        made = {
            size: attempt(name(size), lambda size=size: sampler(_call(*size)), study.failures)  # type: ignore[misc]
            for size in wanted
        }
        times = take_turns(
            {size: call for size, call in made.items() if call is not None},
            15 if study.depth == "full" else 7,
            failures=study.failures,
            name=name,
        )
    return [
        {"method": method, "coordinates": d, "contacts": c, **time_cells(taken)}
        for (method, d, c), taken in times.items()
    ]


def _call(method: str, d: int, c: int) -> Call:
    case = random_impact(d, c, np.random.default_rng([d, c]))
    call = kernel_call(case) if method == FACTORED else printed_call(case)
    call()  # compiles the kernel and touches its arrays
    return call


def printed_over_factored(table: Table) -> Iterator[tuple[int, float, float, float]]:
    """Yield (contacts, factored time [µs], printed time [µs], ratio) at d = 12, for the contacts of
    FACTORS."""
    for contacts in FACTORS:
        here = table.where(coordinates=12, contacts=contacts)
        times = dict(zip(here.column("method"), here.column("time"), strict=True))
        if {FACTORED, PRINTED} <= set(times):
            yield contacts, times[FACTORED], times[PRINTED], times[PRINTED] / times[FACTORED]


def _scaling_says(table: Table) -> Iterator[Part]:
    for contacts, ours, _, ratio in printed_over_factored(table):
        yield limited(
            f"with 12 coordinates and {contacts} contacts of rank 8 the printed formula takes",
            ratio,
            FACTORS[contacts],
            " times as long as the engine's factored impact",
            f" ({ours:.3g} µs)",
            least=True,
        )


def power_law(sizes: Sequence[float], values: Sequence[float]) -> float:
    """Return the slope of log(value) over log(size)."""
    return float(np.polyfit(np.log(sizes), np.log(values), 1)[0])


def steepest(sizes: Sequence[float], values: Sequence[float]) -> tuple[float, float, float]:
    """Return the two neighbouring sizes between which log(value) over log(size) is steepest, and
    the slope there."""
    pairs = sorted(zip(sizes, values, strict=True))
    slope, low, high = max(
        (power_law([low[0], high[0]], [low[1], high[1]]), low[0], high[0])
        for low, high in pairwise(pairs)
    )
    return low, high, slope


def fitted(table: Table, method: str, axis: str) -> Row:
    """Return the exponent of a method, and where it is steepest, over the contacts at d = 12 or the
    coordinates at 60 contacts."""
    chosen = table.where(
        method=method, **({"coordinates": 12} if axis == "contacts" else {"contacts": 60})
    )
    sizes, times = chosen.column(axis), chosen.column("time")
    low, high, there = steepest(sizes, times)
    return {
        "method": method,
        "axis": axis,
        "exponent": power_law(sizes, times),
        "steepest from": low,
        "to": high,
        "there": there,
    }


def _growth_says(table: Table) -> Part:
    [ours] = table.where(method=FACTORED, axis="contacts").records()
    return limited(
        "the time of the factored impact grows as the number of contacts to the power",
        ours["exponent"],
        LARGEST_EXPONENT,
        " over all sizes",
        " (steepest from {steepest from:g} to {to:g} contacts: {there:.2f})".format_map(ours),
    )


SCALING = Check(
    key="scaling",
    question="How does the time of an impact grow with its size?",
    cases=lambda _: (SIZES,),
    row=scaling,
    says=_scaling_says,
    timed=TIMES,
    digits=3,
    note="Random impacts; the rank of the rows is two thirds of the number d of coordinates.",
)
FITTED = Check(
    key="fitted",
    question="With which power does it grow?",
    says=_growth_says,
    digits=3,
    cases=lambda _: [
        (method, axis) for method in (FACTORED, PRINTED) for axis in ("contacts", "coordinates")
    ],
    row=lambda study, case: fitted(study.table(SCALING), *case),
    timed=("exponent", "steepest from", "to", "there"),
    note="The exponent is a least-squares fit of log time over log size. Steepest: the two neighbouring sizes between "
    "which the exponent is largest; “there” is this exponent.",
)


PAPER_STEP, MILLISECOND = "1/512 s, the paper's step", "1 ms"
DEADLINES = {
    PAPER_STEP: 1.0 / 512.0,
    MILLISECOND: 1e-3,
}  # [s] one step at the paper's haptic rate and at 1 kHz
CALLS, ALLOWED = (
    1000,
    1,
)  # calls of one trial, and the number of late calls allowed: 99.9 % are in time
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
    a deadline and the median time of a call. The rank of the rows is two thirds of d.
    """
    going = list(DEADLINES) if method == PRINTED else [MILLISECOND]
    for c in contacts:
        with one_thread():
            times = (
                attempt(
                    f"{c} contacts in {d} coordinates by {TITLES[method]}",
                    partial(
                        call_times, method, d, c, calls, max(map(DEADLINES.__getitem__, going))
                    ),
                    failures,
                )
                or []
            )
        late = {name: sum(time > DEADLINES[name] for time in times) for name in going if times}
        yield from (
            {
                "method": TITLES[method],
                "deadline": name,
                "coordinates": d,
                "contacts": c,
                "late calls [of 1000]": late[name],
                "time [µs]": 1e6 * float(np.median(times)),
            }
            for name in late
        )
        going = [name for name in going if late.get(name, 0) <= ALLOWED]
        if not going:
            return


def call_times(method: str, d: int, c: int, calls: int, deadline: float) -> list[float]:
    """Return the times of an attempt [s], which stops at more than ALLOWED late calls; it is the
    first one in time, or the first whose median call is late, or the last."""
    call = _call(method, d, c)
    for _ in range(_ATTEMPTS):
        late, times = 0, list[float]()
        while len(times) < calls and late <= ALLOWED:
            times.append(seconds(call))
            late += times[-1] > deadline
        if late <= ALLOWED or np.median(times) > deadline:
            break
    return times


def most_contacts(trials: Table, deadline: str = MILLISECOND) -> dict[str, dict[int, int]]:
    """Return the largest number of contacts in time, by method and coordinates; 0 if no size is in
    time."""
    most: dict[str, dict[int, int]] = {}
    for row in trials.where(deadline=deadline).records():
        best = most.setdefault(row["method"], {})
        in_time = row["contacts"] if row["late calls"] <= ALLOWED else 0
        best[row["coordinates"]] = max(best.get(row["coordinates"], 0), in_time)
    return most

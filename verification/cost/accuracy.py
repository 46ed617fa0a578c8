"""Error and energy gain of one impact against computing time, and the best method for a budget.

Every method resolves the same nine impacts of a size (`verification.impacts.timed_problem`),
compiled or from Python. Methods that can be stopped early run with several amounts of work.
`choose` finds the method for a budget of time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from numbers import Real
from typing import Any, NamedTuple

import numpy as np

from iapb.errors import ArgumentError, IapbError
from reference.exact import relative_energy_gain
from reference.one_thread import one_thread
from verification.check import Check, Study
from verification.clock import sampler, take_turns, timed
from verification.cost import calls
from verification.cost.calls import PRINTED, Call
from verification.data import data_of
from verification.finding import Failure, attempt, counted
from verification.impacts import TIMED_HARDNESS, ImpactCase, timed_problem
from verification.numbers import Values, quoted
from verification.table import Columns, Row, Table, table_from

COMPILED = "compiled"
PYTHON = "from Python"
IAPB = "IAPB"
SWEEPS = "Gauss-Seidel"
LEMKE = "Lemke"
CALLED = "IAPB from Python"
QP = "DAQP from Python"


@dataclass(frozen=True)
class Way:
    """A method with an amount of work; `make` returns the timed call; `rows` is a row budget, 0 for
    none."""

    method: str
    work: str
    called: str
    make: Callable[[ImpactCase], Call]
    rows: int = 0


ROWS = (1, 2, 4, 8, 16)
REPEATED = (1, 4, 16, 64, 256, 1024)
# To add a method, add a line here.
WAYS: tuple[Way, ...] = (
    *(
        Way(
            IAPB,
            f"{rows} row{'s' * (rows > 1)}",
            COMPILED,
            partial(calls.kernel_call, budget=rows),
            rows,
        )
        for rows in ROWS
    ),
    Way(IAPB, "all rows", COMPILED, calls.kernel_call),
    *(
        Way(
            SWEEPS,
            f"{sweeps} sweep{'s' * (sweeps > 1)}",
            COMPILED,
            partial(calls.sweeps_call, sweeps=sweeps),
        )
        for sweeps in REPEATED
    ),
    Way(LEMKE, "all pivots", COMPILED, calls.lemke_call),
    Way(CALLED, "all rows", PYTHON, calls.engine_call),
    Way(PRINTED, "as printed", PYTHON, calls.printed_call),
    Way(QP, "active set", PYTHON, calls.daqp_call),
)
SIZES = ((1, 3), (4, 3), (20, 6), (60, 12), (300, 30), (1000, 30))  # (contacts, coordinates)
ROUNDS = 5  # in random order, each method after a warm-up call
LONGEST = (
    1e-2  # [s] largest time of a call: a slower method is timed once and skips all further impacts
)
_ENOUGH = 0.02  # [s] spent on one method of one impact; slow methods get fewer rounds
LARGEST = 10_000  # contacts or coordinates of one impact: more would take hours or the whole memory
NO_GAIN = 1e-12  # a relative gain of energy below this is rounding
TOO_SLOW = "too slow"


class Hard(NamedTuple):
    """One of the nine hard impacts of a size."""

    contacts: int
    coordinates: int
    number: int


def _hard(sizes: Iterable[tuple[int, int]]) -> list[Hard]:
    return [Hard(*size, k) for size in sizes for k in range(len(TIMED_HARDNESS))]


def work_precision(
    sizes: Iterable[tuple[int, int]] = SIZES,
    progress: Callable[[int, int], None] | None = None,
    failures: list[Failure] | None = None,
) -> Table:
    """Measure error, energy gain and time of every method on nine impacts of each size.

    Parameters
    ----------
    sizes : (contacts, coordinates) of each size
    progress : called as progress(impacts done, number of impacts)
    failures : receives exceptions other than `IapbError`, which gives a row; if it is None, they
        propagate

    Returns
    -------
    Table
        One row per impact and way: the median time; |v⁺ − exact v⁺| / |v⁻| in the kinetic metric;
        the exact (KE⁺ − KE⁻)/KE⁻, or 0 for a loss. The outcome is "ok", "too slow" (more than
        LONGEST), or "failed" with its reason.
    """
    cases = _hard(sizes)
    each = counted(cases, progress) if progress else cases
    return ACCURACY.table(Study(failures=failures), each)


def _measured(study: Study, case: Hard) -> Iterator[Row]:
    """Yield the rows of one impact; a way that was too slow on an earlier impact is not tried
    again."""
    problem = timed_problem(*case)
    slow: set[Way] = study.once("slow", set)
    tried: dict[Way, Tried] = {}
    with one_thread():
        for way in WAYS:
            if way.rows >= case.coordinates:
                continue
            name = f"{problem.family}, {way.method}, {way.work}"
            trying = partial(_try, way, problem)
            one = Tried(LONGEST) if way in slow else attempt(name, trying, study.failures)
            if one is not None:
                tried[way] = one
        samplers = {
            way: sampler(one.call)
            for way, one in tried.items()
            if one.call is not None and not one.fault and one.seconds < LONGEST
        }
        times = take_turns(samplers, ROUNDS, warm=False, enough=_ENOUGH)
    for way, one in tried.items():
        row: dict[str, Any] = {
            "contacts": problem.contacts,
            "coordinates": problem.coordinates,
            "problem": problem.family,
            "method": way.method,
            "work": way.work,
            "called": way.called,
            **dict.fromkeys(MEASURED),
        }
        if way in times:
            row["time [µs]"] = 1e6 * times[way].median
            row["outcome"] = "ok"
            row |= _quality(problem, one.v_plus)
        elif one.seconds >= LONGEST:
            slow.add(way)
            row["outcome"] = TOO_SLOW
        else:
            row["outcome"] = f"failed: {one.fault}"
        yield row


class Tried(NamedTuple):
    """One call of a way: its time [s], v⁺ (d,), and why there is none."""

    seconds: float
    call: Call | None = None
    v_plus: Any = None
    fault: str = ""


def _try(way: Way, problem: ImpactCase) -> Tried:
    try:
        call = way.make(problem)
        call()  # a method compiles at its first call
        v_plus, spent = timed(call)
    except IapbError as error:
        return Tried(0.0, fault=str(error))
    fault = "" if np.all(np.isfinite(v_plus)) else "the velocity is not finite"
    return Tried(spent, call, v_plus.copy(), fault)


def _quality(problem: ImpactCase, v_plus: Any) -> Row:
    error = np.array(
        [float(Fraction(x) - t) for x, t in zip(v_plus.tolist(), problem.truth, strict=True)]
    )
    gain = relative_energy_gain(problem.mass_matrix, problem.velocity, v_plus)
    return {
        "relative error": float(np.linalg.norm(problem.lower.T @ error)) / problem.speed,
        # a loss with e < 1 is correct, so it is no error
        "relative energy gain": max(gain, 0.0),
    }


MEASURED = ("time [µs]", "relative error", "relative energy gain", "outcome")
ACCURACY = Check(
    key="accuracy",
    question="How exact is an impact in the time that it takes?",
    cases=lambda _: _hard(SIZES),
    row=_measured,
    columns=Columns(timed=MEASURED, timed_rows=True),
)


@dataclass(frozen=True)
class Choice:
    """The best method for a budget of time at one size of impact, and its results at that size.

    Attributes
    ----------
    budget : time for one impact [s].  contacts, coordinates : the size.  method, work, called : the
        way to choose.
    time : its median time [s].
    error, largest : median and largest error of v⁺ over the impacts that end in time without a gain
        of energy.
    share : share of these impacts.  solved : share of the impacts that also have an error of at
        most SOLVED.
    """

    budget: float
    contacts: int
    coordinates: int
    method: str
    work: str
    called: str
    time: float
    error: float
    largest: float
    share: float
    solved: float

    @property
    def enough(self) -> bool:
        """Whether the method solves at least half of the impacts."""
        return self.solved >= 0.5

    @property
    def how(self) -> str:
        """The method in words, with the amount of work after which it stops."""
        return (
            f"{self.method}, stopped after {self.work}"
            if self.work.split()[0].isdigit()
            else self.method
        )

    def __str__(self) -> str:
        called = " (compiled)" if self.called == COMPILED else ""
        use = (
            "use"
            if self.enough
            else f"no method solves half of the hard cases to {SOLVED:g}; the nearest is"
        )
        return (
            f"With {short_time(self.budget)} for {self.contacts} contacts on {self.coordinates} "
            f"coordinates, {use} "
            f"{self.how}{called}: {short_time(self.time)} an impact, relative error of the "
            f"velocity {self.error:.0e} (largest {self.largest:.0e}); {100 * self.share:.0f} % of "
            f"the hard cases "
            "end in time without a gain of energy."
        )


_EQUAL = 1e-9  # errors below this count as equal: the faster method is taken
_MOST = 0.99  # a larger share of solved impacts than this counts as no better
SOLVED = 1e-3  # relative error below which an impact counts as solved


def choose(
    measured: Table, budget: float, contacts: int, coordinates: int, called: str = COMPILED
) -> Choice | None:
    """Return the best way for a budget [s] at a measured size; None if no way answers in time
    without an energy gain.

    The best way solves the most of the nine impacts in time. Among equals it answers the most
    impacts in time; then it has the least largest error, where errors below 1e-9 count as equal;
    then it is the fastest. Ways that solve less than half of the impacts count as equal in the
    first criterion, and their `enough` is False.
    """
    found: list[Choice] = []
    for rows in by_way(
        measured.where(contacts=contacts, coordinates=coordinates, called=called)
    ).values():
        good = [
            row
            for row in rows
            if row["outcome"] == "ok"
            and row["time"] <= 1e6 * budget
            and row["relative energy gain"] <= NO_GAIN
        ]
        if good:
            errors = [row["relative error"] for row in good]
            found.append(
                Choice(
                    budget,
                    contacts,
                    coordinates,
                    good[0]["method"],
                    good[0]["work"],
                    called,
                    1e-6 * float(np.median([row["time"] for row in good])),
                    float(np.median(errors)),
                    max(errors),
                    len(good) / len(rows),
                    sum(error <= SOLVED for error in errors) / len(rows),
                )
            )
    return min(
        found,
        key=lambda one: (
            -min(one.solved, _MOST) * one.enough,
            -min(one.share, _MOST),
            max(one.largest, _EQUAL),
            one.time,
        ),
        default=None,
    )


def by_way(measured: Table) -> dict[tuple[str, str], list[dict[str, Any]]]:
    """Return the rows of each method and amount of work."""
    ways: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for row in measured.records():
        ways.setdefault((row["method"], row["work"]), []).append(row)
    return ways


def which_method(budget: float, contacts: int, coordinates: int) -> tuple[Choice, ...]:
    """Measure one size of impact on this machine and return the best method, compiled and from
    Python.

    Parameters
    ----------
    budget : time for one impact [s].
    contacts, coordinates : the size of the impact.

    Returns
    -------
    tuple of Choice
        The best compiled method and the best method called from Python; without those that have no
        way in time.

    Raises
    ------
    ArgumentError
        A budget or size that is not positive, or a size above LARGEST.
    """
    if isinstance(budget, bool) or not isinstance(budget, Real) or not 0.0 < budget < math.inf:
        raise ArgumentError("budget", budget, "a finite number of seconds above 0")
    for name, value in (("contacts", contacts), ("coordinates", coordinates)):
        if (
            isinstance(value, bool)
            or not isinstance(value, int | np.integer)
            or not 1 <= value <= LARGEST
        ):
            raise ArgumentError(name, value, f"a whole number from 1 to {LARGEST:,}")
    measured = work_precision([(contacts, coordinates)])
    found = (
        choose(measured, budget, contacts, coordinates, called) for called in (COMPILED, PYTHON)
    )
    return tuple(choice for choice in found if choice is not None)


def short_time(seconds_: float) -> str:
    """Return a time as text, for example 0.5 µs, 50 µs or 5 ms."""
    return f"{1e3 * seconds_:.2g} ms" if seconds_ >= 1e-3 else f"{1e6 * seconds_:.3g} µs"


def recommended(measured: Table) -> Table:
    """Return for each measured size the fastest method with the most solved impacts, compiled and
    from Python."""
    rows = []
    for contacts, coordinates in dict.fromkeys(measured.select(("contacts", "coordinates")).rows):
        row: dict[str, Any] = {"contacts": contacts, "coordinates": coordinates}
        for called in (COMPILED, PYTHON):
            best = choose(measured, math.inf, contacts, coordinates, called)
            row |= {
                f"method, {called}": best and best.method,
                f"work, {called}": best and best.work,
                f"time, {called} [µs]": best and 1e6 * best.time,
                f"largest error, {called}": best and best.largest,
            }
        rows.append(row)
    timed = tuple(key for key in rows[0] if called_in(key)) if rows else ()
    return table_from(rows, digits=2, kinds=Columns(timed=timed))


def called_in(key: str) -> bool:
    """Return whether a column of `recommended` depends on times."""
    return COMPILED in key or PYTHON in key


def numbers_of(best: Table) -> Values:
    """Return what the page quotes of `recommended`: IAPB's share, its times, and its errors."""
    key = "recommended"
    return quoted({key: data_of(__file__, "numbers.yaml")[key]}, {key: best})

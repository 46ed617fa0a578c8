"""Topic "haptic-rate": times of steps and impacts compared with other engines and solvers, and
their growth with size.

`iapb bench` measures everything one after another. A report takes the tables of QUOTED from other
findings, so that nothing is measured twice (`quoting`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

from reference.worlds import run_world
from verification.check import Check, Topic
from verification.claims.speed import C19, C22
from verification.cost.accuracy import BUDGET_ROWS
from verification.cost.growth import FITTED, SCALING, TITLES, most_contacts, printed_over_factored
from verification.cost.robots import ROBOTS
from verification.cost.solvers import IMPACT_TIMES, faster, printed_faster, solvers_say
from verification.cost.steps import BODIES, RACES
from verification.cost.trajectories import MOTIONS, WORTH
from verification.finding import NOT_COMPUTED, REPRODUCED, Finding, Part
from verification.table import Row, Table


def _rates(trials: Table) -> Iterator[Row]:
    """Yield the largest number of contacts at 1 kHz (claim C19), one row per number of
    coordinates."""
    most = most_contacts(trials)
    for d in dict.fromkeys(trials.column("coordinates")):
        yield {"coordinates": d} | {
            name: most.get(title, {}).get(d, 0) for title, name in _MOST.items()
        }


def _kernels_say(table: Table) -> Part:
    """Say where Lemke's method is faster than IAPB by the times of claim C22, which the figure of
    them shows."""
    slower = table.that(False)
    sizes = {
        name: slower.where(problem=name)["contacts"] for name in dict.fromkeys(slower["problem"])
    }
    tried = {name: len(table.where(problem=name).rows) for name in sizes}
    where = " and ".join(
        f"at {len(found)} of {tried[name]} sizes of a {name.split()[-1]} ("
        f"contacts: {', '.join(map(str, found))})"
        for name, found in sizes.items()
    )
    return faster("both methods compiled", "Lemke's method", "sizes of impact", table.holds, where)


def _answer(tables: Mapping[str, Table], parts: Sequence[Part]) -> str:
    met = f"{sum(part.verdict == REPRODUCED for part in parts)} of {len(parts)}"
    answer = f"We meet {met} of our own targets for speed and accuracy."
    for contacts, _, _, ratio in list(printed_over_factored(tables[SCALING.key]))[-1:]:
        answer += (
            f" With 12 coordinates and {contacts} contacts of rank 8 the engine resolves an "
            f"impact {ratio:.0f} "
            "times as fast as the paper's formula (21) in numpy."
        )
    if SOLVERS.key in tables and (said := printed_faster(tables[SOLVERS.key])):
        answer += f" {said}."
    return answer


_MOST = {title: f"most contacts, {title.removeprefix('the ')}" for title in TITLES.values()}
RATE = Check(
    key="contacts at 1 kHz",
    question="How many contacts does a millisecond allow?",
    row=lambda _, row: row,
    digits=6,
    cases=lambda study: list(_rates(study.table(C19))),
    timed=tuple(_MOST.values()),
    note="The largest tried number of contacts with which 999 of 1000 impacts end within 1 ms, on this machine.",
)
KERNELS = replace(C22, key="compiled, IAPB and Lemke", says=_kernels_say)
SOLVERS = replace(IMPACT_TIMES, key="solvers", says=solvers_say)
# key of a check -> finding and table from which a report takes its rows
QUOTED = {
    RATE.key: ("C19", "C19"),
    KERNELS.key: ("C22", "C22"),
    SOLVERS.key: ("complementarity", IMPACT_TIMES.key),
}

BENCH = Topic(
    key="haptic-rate",
    title="The haptic rate",
    question="A haptic loop must finish each step within a millisecond. This page compares the engine's times with "
    "those of MuJoCo, Pinocchio, the printed formula and complementarity solvers. The programs "
    "are timed in turns "
    "within one run, so that the load of the machine affects all alike. The engine's step "
    "includes recording the state; MuJoCo's step does not.",
    checks=(
        RACES,
        SCALING,
        KERNELS,
        SOLVERS,
        FITTED,
        RATE,
        BODIES,
        ROBOTS,
        MOTIONS,
        WORTH,
        BUDGET_ROWS,
    ),
    says=_answer,
)
TOPIC = replace(BENCH, checks=tuple(check for check in BENCH.checks if check.key not in QUOTED))


def haptic_study(depth: str, progress: Callable[[int, int], None]) -> Finding:
    """Measure everything one after another, without any other computation of ours at the same
    time."""
    return BENCH(run_world, depth, progress)


def quoting(found: Finding, others: Iterable[Finding]) -> Finding:
    """Return the finding of TOPIC with tables of others: contacts at 1 kHz (C19), and times of
    solvers (C22).

    If another finding is absent, a part says so.
    """
    if not found.tables:
        return found
    tables = {
        check.key: found.tables[check.key] for check in TOPIC.checks if check.key in found.tables
    }
    given = {(other.key, name): table for other in others for name, table in other.tables.items()}
    tables |= {
        key: RATE.table_of(_rates(given[source])) if key == RATE.key else given[source]
        for key, source in QUOTED.items()
        if source in given
    }
    missing = [
        Part(f"Not computed: {key}, from {source[0]}.", NOT_COMPUTED, timed=True)
        for key, source in QUOTED.items()
        if source not in given
    ]
    return BENCH.conclude(tables, found.failures, missing)

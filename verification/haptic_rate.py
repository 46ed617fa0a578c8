"""Topic "haptic-rate": times of steps, impacts and motions beside those of others, and their
targets.

A report takes the tables of CLAIMED from the claims, so that nothing is measured twice (`quoting`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from verification.check import Check, Study, Topic
from verification.claims.speed import C19, C22
from verification.cost import growth, impact_times, robots, steps
from verification.cost.accuracy import LEMKE
from verification.cost.calls import PRINTED
from verification.cost.trajectories import MOTIONS, WORTH, aims
from verification.data import data_of
from verification.finding import NOT_COMPUTED, REPRODUCED, Finding, Part
from verification.numbers import Values, quoted
from verification.table import Columns, Row, Table

STEP = "One step at rest"
IMPACT = "One impact"
ROBOT = "Dynamics of a robot"
CALLED = ", called from Python"
BY_LEMKE = "Lemke, compiled"
QUOTES = data_of(__file__, "haptic_rate.yaml")


def ratios(study: Study) -> Iterator[Row]:
    """Yield our time over theirs: a row for each scene, size or robot.

    limit : the target of the ratio; slower : whether the row misses it, beyond noise
    """
    yield from _step_ratios(study.table(steps.RACES))
    yield from _printed_ratios(study.table(C19))
    yield from _solver_ratios(study.table(C22))
    yield from _robot_ratios(study.table(robots.ROBOTS))


def _ratio(
    group: str, what: str, against: str, case: str, ratio: float, limit: float, slower: bool
) -> Row:
    return {
        "group": group,
        "what": what,
        "against": against,
        "case": case,
        "ratio": ratio,
        "limit": limit,
        "slower": slower,
    }


def _step_ratios(races: Table) -> Iterator[Row]:
    for row in sorted(steps.hardest(races), key=lambda row: float(row["ratio"])):
        ratio = row["ratio"]
        limit = row["target"]
        yield _ratio(STEP, row["scene"], "MuJoCo", row["scene"], ratio, limit, ratio > limit)


def _printed_ratios(trials: Table) -> Iterator[Row]:
    ours, theirs = (
        dict(growth.times_over(trials, method, "contacts", coordinates=12))
        for method in (growth.FACTORED, PRINTED)
    )
    for contacts, factor in growth.FACTORS.items():
        if contacts in ours and contacts in theirs:
            ratio = ours[contacts] / theirs[contacts]
            what = f"{contacts} contacts, rank 8"
            yield _ratio(IMPACT, what, PRINTED, what, ratio, 1.0 / factor, ratio > 1.0 / factor)


def _solver_ratios(pairs: Table) -> Iterator[Row]:
    """Yield a row per size: Lemke's method compiled by family; DAQP, and all solvers, from
    Python."""
    for row, holds in zip(pairs.records(), pairs.holds, strict=True):
        family = row["impacts"]
        method = row["method"]
        if family == impact_times.STEPS or row["ratio"] is None:
            continue
        what = f"{family}, 1 to 300 contacts{CALLED}"
        against = method
        if method == LEMKE:
            what = f"{family}, 1 to 300 contacts"
            against = BY_LEMKE
        elif method in impact_times.SOLVERS:
            against = "six solvers, one interface"
        case = f"{method}, {row['contacts']} contacts"
        yield _ratio(IMPACT, what, against, case, row["ratio"], 1.0, holds is False)


def _robot_ratios(table: Table) -> Iterator[Row]:
    for row in table.records():
        ratio = row["ratio"]
        limit = robots.LIMITS[row["form"]]
        case = f"{row['quantity']}, {row['robot']}"
        yield _ratio(ROBOT, row["form"], "Pinocchio", case, ratio, limit, ratio > limit)


def summaries(rows: Iterable[Row]) -> list[Row]:
    """Return one row for each pair of what and against: median, least and largest ratio, and
    whether no case misses the target."""
    groups: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        key = tuple(row[name] for name in ("group", "what", "against", "limit"))
        groups.setdefault(key, []).append(row)
    return [
        {
            "group": group,
            "what": what,
            "against": against,
            "median": float(np.median([row["ratio"] for row in mine])),
            "least": min(row["ratio"] for row in mine),
            "largest": max(row["ratio"] for row in mine),
            "limit": limit,
            "cases": len(mine),
            "slower [cases]": sum(row["slower"] for row in mine),
            "met": not any(row["slower"] for row in mine),
        }
        for (group, what, against, limit), mine in groups.items()
    ]


def ratio_targets(table: Table) -> Iterator[Part]:
    """Yield the number of cases that miss each target, which is none."""
    for row in table.records():
        name = f"{row['what']}, cases above {row['limit']:.2g} of the time of {row['against']}"
        yield Part.on(name, row["slower"], 0, timed=True)


def growth_targets(trials: Table) -> Iterator[Part]:
    """Yield the power with which our time grows with the contacts."""
    sizes = growth.times_over(trials, growth.FACTORED, "contacts", coordinates=12)
    power = growth.power_law(*zip(*sizes, strict=True)) if len(sizes) > 1 else None
    name = "power of the time of an impact over contacts"
    yield Part.on(name, power, growth.LARGEST_EXPONENT, timed=True)


def motion_targets(motions: Table) -> Iterator[Part]:
    """Yield our smallest error over that of the best other world, and our time over MuJoCo's."""
    for row in aims(motions):
        name = f"{row['scene']}, our smallest error over that of {row['most exact other']}"
        yield Part.on(name, row["error"], 1.0)
        if row["time"] is not None:
            name = f"{row['scene']}, our time over MuJoCo's at its smallest error"
            yield Part.on(name, row["time"], 1.0, timed=True)


def _times(tables: Mapping[str, Table]) -> Values:
    """Return the numbers that the page on speed quotes; all of them depend on times."""
    parts = [part for check in BENCH.checks for part in check.judge(tables[check.key])]
    scenes = list(aims(tables[MOTIONS.key]))
    behind = [row["scene"] for row in scenes if row["error"] > 1.0]
    return {
        "targets": len(parts),
        "targets_met": sum(part.verdict == REPRODUCED for part in parts),
        "motions": len(scenes),
        "motions_most_exact": len(scenes) - len(behind),
        "motions_behind": ", ".join(behind),
        "motions_behind_error": max((row["error"] for row in scenes), default=None),
        "most_contacts_iapb_12": growth.most_contacts(tables[C19.key], growth.FACTORED, 12),
        "most_contacts_printed_12": growth.most_contacts(tables[C19.key], PRINTED, 12),
        **quoted(QUOTES, tables),
    }


TIMED = ("ratio", "median", "least", "largest", "slower", "met")
EACH = Check(
    key="our time over theirs",
    question="How fast is each case, beside the others?",
    cases=lambda study: list(ratios(study)),
    row=lambda _, row: row,
    columns=Columns(timed=TIMED, timed_rows=True),
)
RATIOS = Check(
    key="ratios",
    question="How fast are we, beside the others?",
    cases=lambda study: summaries(study.table(EACH).by_title()),
    row=lambda _, row: row,
    targets=ratio_targets,
    columns=Columns(timed=TIMED, timed_rows=True),
)
TOPIC = Topic(
    key="haptic-rate",
    title="Speed",
    question="What does accuracy cost, and is it fast enough?",
    checks=(
        steps.RACES,
        steps.BODIES,
        robots.ROBOTS,
        replace(MOTIONS, targets=motion_targets),
        WORTH,
    ),
)
# What a report takes from the claims, and what follows from it.
CLAIMED = (replace(C19, targets=growth_targets), replace(C22, targets=lambda _: ()))
DERIVED = (EACH, RATIOS)
BENCH = replace(
    TOPIC, checks=(*TOPIC.checks, *CLAIMED, *DERIVED), numbers=lambda _: {}, times=_times
)


def quoting(found: Finding, others: Iterable[Finding]) -> Finding:
    """Return the finding of TOPIC with the tables of claims C19 and C22, and all ratios.

    If one of the claims is absent, a part says so.
    """
    if not found.tables:
        return found
    keys = [claim.key for claim in CLAIMED]
    given = {key: other.tables[key] for other in others for key in keys if key in other.tables}
    missing = [Part("", NOT_COMPUTED, key, timed=True) for key in keys if key not in given]
    if missing:
        return TOPIC.conclude(found.tables, found.failures, missing)
    tables = {**found.tables, **given}
    study = Study(results={("table", key): table for key, table in tables.items()})
    tables |= {check.key: study.table(check) for check in DERIVED}
    return BENCH.conclude(tables, found.failures)
